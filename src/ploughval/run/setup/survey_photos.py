"""The photographs of a folder: the largest series, and the times that its files or a table tell."""

import glob
import logging
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import PloughvalError
from ploughval.photos.reading import video
from ploughval.photos.reading.decode import ENDINGS, read_header
from ploughval.photos.reading.header import Header
from ploughval.photos.series.exif_times import exif_times
from ploughval.photos.series.order import natural_key
from ploughval.photos.series.times import FrameTimes
from ploughval.photos.series.times_table import table_times

log = logging.getLogger(__name__)

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Photos:
    """Photographs of one kind in one folder.

    Attributes
    ----------
    pattern : str
        Relative to the folder.
    files : tuple of (Path, int)
        File and picture in it, in natural order of the names.
    header : Header or None
        Of the first that can be read.
    coloured : bool
    unreadable : tuple of str
        What is wrong with files whose header cannot be read.
    times : str or None
        What [camera] times may say: the name of a table, "exif", "video"; None: nothing usable.
    time_s : (F,) float
        Those times; NaN where unknown.
    remarks : tuple of str
        What is to be known of times that are used, or why others are not.
    left : tuple of str
        Other pictures and videos that are there.
    """

    pattern: str
    files: tuple[tuple[Path, int], ...]
    header: Header | None
    coloured: bool
    unreadable: tuple[str, ...]
    times: str | None
    time_s: Floats
    remarks: tuple[str, ...] = ()
    left: tuple[str, ...] = field(default=())

    @property
    def span_s(self) -> float:
        """From the first time to the last, s."""
        return float(np.nanmax(self.time_s) - np.nanmin(self.time_s))

    @property
    def own_clock(self) -> bool:
        """Whether the times are of another clock than the log's."""
        return self.times in ("exif", "video")


def find_photos(files: Sequence[Path], folder: Path, tables: Sequence[Path]) -> Photos | None:
    """The largest series; ``tables``: those of times."""
    kinds: dict[tuple[Path, str], list[Path]] = defaultdict(list)
    for path in files:
        if path.suffix.lower() in ENDINGS:
            kinds[path.parent, path.suffix].append(path)
    if not kinds:
        return None
    headers = {path: _header(path) for paths in kinds.values() for path in paths[:1]}
    place, suffix = max(kinds, key=lambda kind: _pictures(kinds[kind], headers))
    paths = sorted(kinds.pop((place, suffix)), key=lambda p: natural_key(p.name))
    prefix = "" if place == folder else f"{glob.escape(place.relative_to(folder).as_posix())}/"
    pattern = f"{prefix}*{suffix}"
    if suffix.lower() in video.ENDINGS and len(paths) > 1:
        pattern, paths = f"{prefix}{glob.escape(paths[0].name)}", paths[:1]
    read = [_header(path) for path in paths]
    sound = [header for header in read if isinstance(header, Header)]
    frames = [
        (path, page)
        for path, header in zip(paths, read, strict=True)
        for page in (header.pages if isinstance(header, Header) else (0,))
    ]
    times, stamped, remarks = _times(frames, folder, tables, paths, read)
    return Photos(
        pattern=pattern,
        files=tuple(frames),
        header=sound[0] if sound else None,
        coloured=bool(sound)
        and _coloured(next(p for p, h in zip(paths, read, strict=True) if h is sound[0])),
        unreadable=tuple(text for text in read if isinstance(text, str)),
        times=times,
        time_s=np.full(len(frames), np.nan) if stamped is None else stamped.time_s,
        remarks=remarks,
        left=tuple(
            f"{len(other)} more in {where.relative_to(folder).as_posix()} ({end})"
            for (where, end), other in kinds.items()
        ),
    )


def _header(path: Path) -> Header | str:
    """A file's header, or what is wrong with it."""
    try:
        return read_header(path)
    except PloughvalError as error:
        log.warning("%s", error)
        return str(error)


def _pictures(paths: Sequence[Path], headers: dict[Path, Header | str]) -> int:
    """How many pictures a kind holds, by the first of its files."""
    first = headers[paths[0]]
    return len(paths) * (len(first.pages) if isinstance(first, Header) else 1)


def _coloured(path: Path) -> bool:
    """Whether a photograph's channels differ; a video counts as coloured."""
    if path.suffix.lower() in video.ENDINGS:
        return True
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            return image.mode not in ("1", "L", "LA") and not image.mode.startswith(("I", "F"))
    except (OSError, UnidentifiedImageError, ValueError):
        return True


def _times(
    frames: Sequence[tuple[Path, int]],
    folder: Path,
    tables: Sequence[Path],
    paths: Sequence[Path],
    headers: Sequence[Header | str],
) -> tuple[str | None, FrameTimes | None, tuple[str, ...]]:
    """What times are there: a table first, then the files' own."""
    remarks: list[str] = []
    names = [path.relative_to(folder).as_posix() for path, _ in frames]
    for table in tables:
        try:
            stamped = table_times(table, names)
        except PloughvalError as error:
            remarks.append(str(error))
            continue
        lost = int(np.isnan(stamped.time_s).sum())
        if lost:
            which = ", ".join(names[k] for k in np.flatnonzero(np.isnan(stamped.time_s))[:3].tolist())
            remarks.append(f"{table.name} misses {lost} of {len(names)} photographs: {which}")
        if stamped.missing:
            which = ", ".join(stamped.missing[:3])
            remarks.append(f"{table.name} names {len(stamped.missing)} that are not there: {which}")
        return table.relative_to(folder).as_posix(), stamped, tuple(remarks)
    first = headers[0]
    if len(paths) == 1 and isinstance(first, Header) and first.page_time_s:
        shown = np.array(first.page_time_s)
        return "video", FrameTimes(shown, np.zeros_like(shown)), tuple(remarks)
    tags = [h.tags.time if isinstance(h, Header) else None for h in headers]
    if not any(tag is not None and tag.date for tag in tags):
        return None, None, tuple(remarks)
    try:
        stamped = exif_times(tags, paths)
    except PloughvalError as error:
        return None, None, (*remarks, str(error).removeprefix(f"{paths[0].parent}: "))
    remarks += stamped.notes
    remarks += [f"{paths[k].name} {fault}" for k, fault in list(stamped.faults.items())[:3]]
    std = float(np.nanmax(stamped.std_s))
    if len(stamped.time_s) > 1 and std > 0:
        remarks.append(f"standard uncertainty of a time: up to {std:.2g} s")
    return "exif", stamped, tuple(remarks)
