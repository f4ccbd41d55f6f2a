"""The photographs of a test as one series: order, times, size, and reading one by one."""

import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import ConfigError, DataError, Fault
from ploughval.photos import times
from ploughval.photos.decode import ENDINGS, decode, read_header
from ploughval.photos.grey import Channel, Samples
from ploughval.photos.header import Header
from ploughval.scene import Camera, Interval, Scene

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class FrameSeries:
    """Photographs numbered from 0 in order of time.

    Attributes
    ----------
    paths : tuple of Path
        File of each frame; a multi-page file stands once for each of its pictures.
    time_s : (F,) float
        Time on the camera's clock, s; NaN where unknown. From EXIF: seconds since the earliest photograph.
    shape : (H, W)
        Size of every picture, px, rows and columns as stored in the file.
    faults : dict
        Frames that cannot be used and why, as found without decoding; :meth:`read` refuses them.
    notes : tuple of str
        What was found wrong that belongs to no frame (order, files left out).
    missing : tuple of str
        Photographs that have a time but are not there.
    """

    paths: tuple[Path, ...]
    time_s: NDArray[np.float64]
    shape: tuple[int, int]
    faults: dict[int, str]
    notes: tuple[str, ...] = ()
    pages: tuple[int, ...] = ()
    channel: Channel = "grey"
    missing: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.paths)

    def read(self, frame: int) -> Samples:
        """Decode one frame.

        Parameters
        ----------
        frame : int
            From 0 in order of time.

        Returns
        -------
        (H, W) uint8 or uint16, contiguous

        Raises
        ------
        DataError
            A frame in :attr:`faults`, or a file that cannot be decoded in full.
        """
        if not 0 <= frame < len(self):
            raise DataError(f"no such frame; the series holds 0 to {len(self) - 1}", frame=frame)
        path = self.paths[frame]
        if frame in self.faults:
            raise DataError(self.faults[frame], path=path, frame=frame)
        try:
            image = decode(path, self.pages[frame], channel=self.channel)
        except DataError as error:
            raise DataError(str(error).removeprefix(f"{path}: "), path=path, frame=frame) from error
        if image.shape != self.shape:
            raise DataError(
                f"decodes to {_size(image.shape)}; expected {_size(self.shape)}", path=path, frame=frame
            )
        return image


@dataclass(frozen=True, slots=True)
class _Found:
    """One frame before it is numbered: its file, its page, its header or what is wrong with it."""

    path: Path
    page: int
    header: Header | None
    fault: str = ""


def open_frames(scene: Scene) -> FrameSeries:
    """Open the photographs of a test without decoding them.

    Parameters
    ----------
    scene : Scene
        With a [camera] table.

    Returns
    -------
    FrameSeries

    Raises
    ------
    DataError
        No photographs, none readable, size or orientation changing, times that cannot be used.
    ConfigError
        No [camera], or view_px outside the picture.
    MissingExtraError
        RAW photographs without the extra ``raw``.
    """
    camera = scene.camera
    if camera is None:
        raise ConfigError(scene.source, [Fault("camera", "no such table", "a [camera] table", "Add it.")])
    files, notes = _files(scene, camera)
    found = [frame for path in files for frame in _look(path)]
    shape = _one_shape(found)
    _check_view(scene, camera, shape)
    stamped = _times(scene, camera, found)
    order, disorder = _order(stamped.time_s, found, scene.folder)
    notes += [*stamped.notes, *disorder]
    for note in notes:
        log.warning("%s: %s", scene.source, note)
    faults = {}
    for number, k in enumerate(order):
        text = found[k].fault or stamped.faults.get(int(k), "")
        if text:
            faults[number] = text
            log.warning("%s, frame %d: %s", found[k].path, number, text)
    return FrameSeries(
        paths=tuple(found[k].path for k in order),
        time_s=stamped.time_s[order],
        shape=shape,
        faults=faults,
        notes=tuple(notes),
        pages=tuple(found[k].page for k in order),
        channel=camera.channel,
        missing=stamped.missing,
    )


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Sorting key that counts numbers in names as numbers.

    >>> sorted(["img10.png", "img9.png", "Img2.png"], key=natural_key)
    ['Img2.png', 'img9.png', 'img10.png']
    """
    parts = re.split(r"([0-9]+)", name)
    return tuple((0, int(p), p) if p.isdecimal() else (1, 0, p.casefold()) for p in parts if p)


def _files(scene: Scene, camera: Camera) -> tuple[list[Path], list[str]]:
    """Photographs that match, in natural order, and notes on files that match but are none."""
    matched = [p for p in scene.matches(camera.photos) if not p.name.startswith(".")]
    files = [p for p in matched if p.suffix.lower() in ENDINGS]
    other = [p.name for p in matched if p.suffix.lower() not in ENDINGS]
    if not files:
        raise DataError(f"no photograph matches {camera.photos!r}", path=scene.folder)
    files.sort(key=lambda p: (natural_key(p.relative_to(scene.folder).as_posix()), p.name))
    return files, [f"not a photograph, left out: {name}" for name in other]


def _look(path: Path) -> list[_Found]:
    try:
        header = read_header(path)
    except DataError as error:
        return [_Found(path, 0, None, str(error).removeprefix(f"{path}: "))]
    return [_Found(path, page, header) for page in header.pages]


def _one_shape(found: Sequence[_Found]) -> tuple[int, int]:
    """The size all frames share."""
    first: Header | None = None
    for k, frame in enumerate(found):
        if frame.header is None:
            continue
        if first is None:
            first = frame.header
        for what, got, expected in (
            ("size", _size(frame.header.shape), _size(first.shape)),
            ("EXIF orientation", frame.header.tags.orientation, first.tags.orientation),
            ("bits a sample", frame.header.bits, first.bits),
        ):
            if got != expected:
                raise DataError(
                    f"{what} changes within the series: got {got}; expected {expected} as in the photographs "
                    "before it. Take it out, or process the parts as separate tests.",
                    path=frame.path,
                    frame=k,
                )
    if first is None:
        raise DataError(f"none of {len(found)} photographs can be read: {found[0].fault}", path=found[0].path)
    return first.shape


def _check_view(scene: Scene, camera: Camera, shape: tuple[int, int]) -> None:
    if camera.view_px is None:
        return
    x0, y0, x1, y1 = camera.view_px
    if not (0 <= x0 < x1 <= shape[1] and 0 <= y0 < y1 <= shape[0]):
        expected = f"[x0, y0, x1, y1] with x0 < x1 and y0 < y1 inside a picture of {_size(shape)}"
        raise ConfigError(scene.source, [Fault("camera.view_px", str(list(camera.view_px)), expected)])


def _times(scene: Scene, camera: Camera, found: Sequence[_Found]) -> times.FrameTimes:
    """Times of the frames in the order of their names."""
    paths = [frame.path for frame in found]
    if camera.times is None:
        return times.FrameTimes(np.full(len(found), np.nan))
    if isinstance(camera.times, Interval):
        return times.interval_times(len(found), camera.times.start_s, camera.times.interval_s)
    if camera.times == "exif":
        stamped = times.exif_times([f.header.tags.time if f.header else None for f in found], paths)
        source = scene.folder
    else:
        source = scene.path(camera.times)
        stamped = times.table_times(source, [p.relative_to(scene.folder).as_posix() for p in paths])
    times.refuse_doubled(stamped.time_s, [p.name for p in paths], source)
    return stamped


def _order(
    time_s: NDArray[np.float64], found: Sequence[_Found], folder: Path
) -> tuple[NDArray[np.intp], list[str]]:
    """Order of time; a frame without a time keeps its place among its neighbours by name."""
    count, known = np.arange(len(time_s)), np.flatnonzero(np.isfinite(time_s))
    if not known.size:
        return count.astype(np.intp), []
    key = np.interp(count, known, time_s[known])
    order = np.argsort(key, kind="stable")
    back = np.flatnonzero(np.diff(time_s[known]) < 0)
    if not back.size:
        return order, []
    earlier, later = (found[known[back[0] + k]].path.relative_to(folder).as_posix() for k in (1, 0))
    note = f"order of time differs from the order of names: {earlier} was taken before {later}"
    return order, [f"{note} ({back.size} such places); frames are numbered by time"]


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]} x {shape[0]} px"
