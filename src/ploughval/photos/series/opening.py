"""Opens the photographs of a test: which files, in which order, taken when, and what is wrong with them."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from ploughval.errors import ConfigError, DataError, Fault
from ploughval.photos.reading.decode import ENDINGS, read_header
from ploughval.photos.reading.exif import Shot
from ploughval.photos.reading.header import Header
from ploughval.photos.reading.reader import Reader
from ploughval.photos.series import order, times
from ploughval.photos.series.copies import is_copy_of, same_files
from ploughval.photos.series.exif_times import exif_times, stamps_s
from ploughval.photos.series.frames import FrameSeries, size_text
from ploughval.photos.series.times_table import table_times
from ploughval.scene import Camera, Interval, Scene

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Found:
    """One frame before it is numbered: its file, its page, its header or what is wrong with it."""

    path: Path
    name: str
    page: int
    header: Header | None
    fault: str = ""

    @property
    def told(self) -> str:
        """What messages call the frame."""
        many = self.header is not None and len(self.header.pages) > 1
        return f"{self.name}, picture {self.page}" if many else self.name


def open_frames(scene: Scene) -> FrameSeries:
    """Open the photographs of a test without decoding them; a video is gone through once.

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
        No photographs, none readable, size, depth, orientation or camera changing, times that cannot be used.
    ConfigError
        No [camera], or view_px outside the picture.
    MissingExtraError
        RAW photographs without the extra ``raw``.
    """
    camera = scene.camera
    if camera is None:
        raise ConfigError(scene.source, [Fault("camera", "no such table", "a [camera] table", "Add it.")])
    files, notes = _files(scene, camera)
    found = [frame for path in files for frame in _look(path, scene.folder)]
    notes += [note for f in found if f.header and f.page == f.header.pages[0] for note in f.header.notes]
    shape = _one_shape(found)
    _check_view(scene, camera, shape)
    stamped = _times(scene, camera, found)
    names = [frame.told for frame in found]
    places = order.by_time(stamped.time_s)
    notes += [*stamped.notes, *_disorder(camera, stamped, found)]
    notes += times.gaps(stamped.time_s[places], stamped.std_s[places], [names[k] for k in places])
    for note in notes:
        log.warning("%s: %s", scene.source, note)
    faults = {}
    places = places[:: camera.every]
    for number, k in enumerate(places):
        text = found[k].fault or stamped.faults.get(int(k), "")
        if text:
            faults[number] = text
            log.warning("%s, frame %d: %s", found[k].path, number, text)
    return FrameSeries(
        paths=tuple(found[k].path for k in places),
        time_s=stamped.time_s[places],
        time_std_s=stamped.std_s[places],
        shape=shape,
        faults=faults,
        notes=tuple(notes),
        pages=tuple(found[k].page for k in places),
        missing=stamped.missing,
        bits=next(frame.header.bits for frame in found if frame.header is not None),
        shots=tuple(_shot(found[k]) for k in places),
        reader=Reader(camera.channel),
    )


def _files(scene: Scene, camera: Camera) -> tuple[list[Path], list[str]]:
    """Photographs that match, in natural order, and notes on files that are left out and on the order."""
    matched = [p for p in scene.matches(camera.photos) if not p.name.startswith(".")]
    files = [p for p in matched if p.suffix.lower() in ENDINGS]
    notes = [f"not a photograph, left out: {p.name}" for p in matched if p.suffix.lower() not in ENDINGS]
    notes += [
        f"no file but a link, pipe or device, left out: {p.name}" for p in scene.not_files(camera.photos)
    ]
    if not files:
        other = ", ".join(sorted({p.suffix for p in matched}))
        more = f"; files of other kinds do ({other}): convert them to PNG, TIFF or JPEG" if matched else ""
        raise DataError(f"no photograph matches {camera.photos!r}{more}", path=scene.folder)
    files.sort(key=lambda p: (order.natural_key(p.relative_to(scene.folder).as_posix()), p.name))
    for group in same_files(files):
        copies = [p for p in group if any(is_copy_of(p, other) for other in group)]
        if camera.times == "exif":  # no two exposures of one time have the same bytes
            copies += [p for p in group if p not in copies][1:]
        notes += [f"a copy of another photograph, left out: {p.name}" for p in copies]
        files = [p for p in files if p not in copies]
        places = [files.index(p) for p in group if p in files]
        apart = [k for k, later in pairwise(places) if later - k > 1]
        notes += [f"the same picture, to the byte, as one further on: {files[k].name}" for k in apart]
    files, assumed = _order_of_names(files, scene.folder)
    if camera.times is None or isinstance(camera.times, Interval):
        notes += assumed  # else the times tell
    return files, notes


def _order_of_names(files: list[Path], folder: Path) -> tuple[list[Path], list[str]]:
    """The photographs by name, a counter that began anew followed, and what that rests on."""
    notes = []
    names = [p.relative_to(folder).as_posix() for p in files]
    front = order.unroll(names)
    if front:
        notes.append(f"the counter in the names began anew: {names[front]} is taken as the first photograph")
        files = files[front:] + files[:front]
    kinds = order.kinds_of_names(names)
    if kinds:
        notes.append(f"names of several kinds ({', '.join(kinds)}) and no times: one kind follows the other")
    return files, notes


def _look(path: Path, folder: Path) -> list[_Found]:
    name = path.relative_to(folder).as_posix()
    try:
        header = read_header(path)
    except DataError as error:
        return [_Found(path, name, 0, None, str(error).removeprefix(f"{path}: "))]
    return [_Found(path, name, page, header) for page in header.pages]


def _shot(frame: _Found) -> Shot:
    return Shot() if frame.header is None else frame.header.tags.shot


def _one_shape(found: Sequence[_Found]) -> tuple[int, int]:
    """The size all frames share."""
    first: Header | None = None
    for k, frame in enumerate(found):
        if frame.header is None:
            continue
        if first is None:
            first = frame.header
        tags, expected_tags = frame.header.tags, first.tags
        for what, got, expected in (
            ("size", size_text(frame.header.shape), size_text(first.shape)),
            ("EXIF orientation", tags.orientation, expected_tags.orientation),
            ("bits a sample", frame.header.bits, first.bits),
            ("camera", tags.camera or expected_tags.camera, expected_tags.camera or tags.camera),
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
        expected = f"[x0, y0, x1, y1] with x0 < x1 and y0 < y1 inside a picture of {size_text(shape)}"
        raise ConfigError(scene.source, [Fault("camera.view_px", str(list(camera.view_px)), expected)])


def _times(scene: Scene, camera: Camera, found: Sequence[_Found]) -> times.FrameTimes:
    """Times of the frames in the order of their names."""
    names = [frame.name for frame in found]
    if camera.times is None:
        unknown = np.full(len(found), np.nan)
        return times.FrameTimes(unknown, unknown)
    if isinstance(camera.times, Interval):
        return times.interval_times(len(found), camera.times.start_s, camera.times.interval_s)
    if camera.times == "exif":
        return exif_times([f.header.tags.time if f.header else None for f in found], [f.path for f in found])
    if camera.times == "video":
        stamped = _shown_times(scene, found)
        times.refuse_doubled(stamped.time_s, [frame.told for frame in found], scene.folder)
        return stamped
    table = scene.path(camera.times)
    stamped = table_times(table, names)
    times.refuse_doubled(stamped.time_s, names, table)
    return stamped


def _shown_times(scene: Scene, found: Sequence[_Found]) -> times.FrameTimes:
    """The times at which a video or an animation shows its pictures."""
    files = {frame.path for frame in found}
    header = found[0].header
    if len(files) > 1 or header is None or not header.page_time_s:
        got = f"{len(files)} files" if len(files) > 1 else f"{found[0].name}, which holds no times"
        raise DataError(
            f'times = "video" needs one file: a video or an animated GIF; got {got}. Give times as a CSV '
            "file (file,time_s) or as {start_s, interval_s}.",
            path=scene.folder,
        )
    time_s = np.array(header.page_time_s)
    return times.FrameTimes(time_s, times.exact(time_s))


def _disorder(camera: Camera, stamped: times.FrameTimes, found: Sequence[_Found]) -> list[str]:
    """A note where the times, or EXIF where the times do not come from the files, contradict the names."""
    names = [frame.told for frame in found]
    text = order.disagreement(stamped.time_s, names)
    if text:
        return [f"{text}; frames are numbered by time"]
    if camera.times is None or isinstance(camera.times, Interval):
        shot_s, _ = stamps_s([f.header.tags.time if f.header else None for f in found])
        text = order.disagreement(shot_s, names)
        if text:
            return [f'by EXIF, {text}; frames are numbered by name, as times = "exif" would not']
    return []
