"""What a folder holds that could be a test: photographs and their times, logs, empty runs, boards."""

import csv
import glob
import logging
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ploughval.errors import PloughvalError
from ploughval.loadcells.log import read_log
from ploughval.loadcells.motion import find_motion
from ploughval.photos.decode import ENDINGS, read_header
from ploughval.photos.exif_times import exif_times
from ploughval.photos.header import Header
from ploughval.photos.order import natural_key
from ploughval.scene import LogColumns

log = logging.getLogger(__name__)

_NO_TEST = ("results", "empty", "calibration", "truth")
_HEAD_BYTES = 65_536
_WORDS = {
    "time_s": r"time|zeit|temps|elapsed|t",
    "displacement_mm": r"displacement|disp|travel|stroke|position|lvdt|weg|u",
    "moment_upper_Nm": r"upper|up|top|high|oben",
    "moment_lower_Nm": r"lower|low|bottom|unten",
}
_UNIT = {"time_s": r"s|sec|seconds?", "displacement_mm": r"mm"}
_OTHER_UNITS = r"ms|us|min|h|hours?|m|cm|um|in|inch|v|mv|n|kn"


@dataclass(frozen=True, slots=True)
class Photos:
    """Photographs of one kind in one folder: pattern, number, first header, seconds by EXIF or video."""

    pattern: str
    count: int
    header: Header | None
    exif_span_s: float | None
    video_span_s: float | None = None


@dataclass(frozen=True, slots=True)
class LogFound:
    """A log: its name, its header, the columns recognised, and what its displacement says."""

    name: str
    header: tuple[str, ...]
    columns: dict[str, str]
    rest_s: tuple[float, float] | None = None
    speed_mm_s: float | None = None
    travel_mm: float | None = None
    trouble: str = ""


@dataclass(frozen=True, slots=True)
class Survey:
    """What was found in a folder; names are relative to it, with forward slashes."""

    photos: Photos | None = None
    times: str | None = None
    log: LogFound | None = None
    empty: tuple[str, ...] = ()
    boards: tuple[str, ...] = field(default=())


def survey(folder: Path) -> Survey:
    """Look through a folder and its folders, one level down, without changing anything."""
    files = sorted(p for depth in ("*", "*/*") for p in folder.glob(depth) if p.is_file())
    files = [p for p in files if not any(part.startswith(".") for part in p.relative_to(folder).parts)]
    tables = [p for p in files if p.suffix.lower() in (".csv", ".txt", ".dat", ".tdms")]
    empty = [p for p in tables if re.match(r"empty|leer", _room(p, folder) or p.name, re.IGNORECASE)]
    boards = [p for p in files if _room(p, folder) == "calibration" and p.suffix.lower() in ENDINGS]
    rest = [p for p in tables if p not in empty and _room(p, folder) not in _NO_TEST]
    return Survey(
        photos=_photos([p for p in files if _room(p, folder) not in _NO_TEST], folder),
        times=next((_name(p, folder) for p in rest if {"file", "time_s"} <= set(_header(p)[0])), None),
        log=_log(rest, folder),
        empty=tuple(dict.fromkeys(_pattern(p, folder) for p in empty)),
        boards=tuple(_name(p, folder) for p in boards),
    )


def _room(path: Path, folder: Path) -> str:
    """Name of the folder below `folder` that a file stands in, lower case; empty at the top."""
    return path.relative_to(folder).parts[0].lower() if path.parent != folder else ""


def _name(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()


def _pattern(path: Path, folder: Path) -> str:
    """Pattern of the files like this one in its folder; the name itself at the top."""
    if path.parent == folder:
        return _name(path, folder)
    return f"{glob.escape(path.parent.name)}/*{path.suffix}"


def _photos(files: list[Path], folder: Path) -> Photos | None:
    """The largest set of pictures of one kind in one folder."""
    kinds = Counter((p.parent, p.suffix) for p in files if p.suffix.lower() in ENDINGS)
    if not kinds:
        return None
    place, suffix = kinds.most_common(1)[0][0]
    paths = sorted(
        (p for p in files if (p.parent, p.suffix) == (place, suffix)), key=lambda p: natural_key(p.name)
    )
    headers: list[Header | None] = []
    for path in paths:
        try:
            headers.append(read_header(path))
        except PloughvalError as error:
            log.warning("%s", error)
            headers.append(None)
    try:
        stamped = exif_times([h.tags.time if h else None for h in headers], paths).time_s
        span = float(np.nanmax(stamped)) if len(np.unique(stamped)) == len(paths) else None
    except PloughvalError:
        span = None
    prefix = "" if place == folder else f"{glob.escape(place.name)}/"
    count = sum(len(h.pages) if h else 1 for h in headers)
    first = next((h for h in headers if h), None)
    shown = first.page_time_s[-1] if first and len(paths) == 1 and first.page_time_s else None
    return Photos(f"{prefix}*{suffix}", count, first, span, shown)


def _header(path: Path) -> tuple[tuple[str, ...], dict[str, str]]:
    """The line of a text table that names most wanted columns, and which it names."""
    if path.suffix.lower() == ".tdms":
        return (), {}
    try:
        with path.open("rb") as file:
            data = file.read(_HEAD_BYTES)
    except OSError:
        return (), {}
    text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig", errors="replace")
    best: tuple[tuple[str, ...], dict[str, str]] = ((), {})
    for line in text.splitlines()[:200]:
        for sign in ";\t,":
            names = tuple(cell.strip() for cell in next(csv.reader([line], delimiter=sign), []))
            columns = guess_columns(names)
            if len(names) > 1 and (len(columns), len(names)) > (len(best[1]), len(best[0]) if columns else 0):
                best = names, columns
        if not best[0] and "," in line:
            best = tuple(cell.strip() for cell in line.split(",")), {}
    return best


def guess_columns(names: tuple[str, ...]) -> dict[str, str]:
    """Which of a log's columns are time, displacement and the two moments; only what is clear.

    >>> guess_columns(("Time (s)", "Disp [mm]", "M top", "M bottom"))["moment_upper_Nm"]
    'M top'
    """
    found: dict[str, str] = {}
    for wanted, words in _WORDS.items():
        exact = [n for n in names if n == wanted]
        similar = [n for n in names if _is_meant(n, words, _UNIT.get(wanted, r"n\s?m"))]
        choice = exact or similar
        if len(choice) == 1 and choice[0] not in found.values():
            found[wanted] = choice[0]
    return found


def _is_meant(name: str, words: str, unit: str) -> bool:
    parts = re.sub(r"[^a-z0-9]+", " ", name.lower()).split()
    if not any(re.fullmatch(words, part) for part in parts):
        return False
    others = [p for p in parts[1:] if re.fullmatch(_OTHER_UNITS, p) and not re.fullmatch(unit, p)]
    return not others or " ".join(others) == "n m"


def _log(tables: list[Path], folder: Path) -> LogFound | None:
    """The table that names most of the wanted columns; a TDMS file where there is none."""
    known = [(len(columns), p, names, columns) for p in tables for names, columns in [_header(p)]]
    known = [k for k in known if k[0] >= 2 and "file" not in k[2]]
    if not known:
        tdms = [p for p in tables if p.suffix.lower() == ".tdms"]
        return LogFound(_name(tdms[0], folder), (), {}) if tdms else None
    count, path, names, columns = max(known, key=lambda k: k[0])
    found = LogFound(_name(path, folder), names, columns)
    if count < len(_WORDS):
        return found
    try:
        data = read_log(path, LogColumns(**columns)).data
    except PloughvalError as error:
        return LogFound(found.name, names, columns, trouble=str(error))
    time, travel = data["time_s"].to_numpy(), data["displacement_mm"].to_numpy()
    motion = find_motion(travel)
    if motion is None:
        return LogFound(found.name, names, columns, trouble="the displacement does not move")
    rest = None
    if motion.rest_end > 1:
        start, end = np.ceil(100 * time[0]) / 100, np.floor(100 * time[motion.rest_end - 1]) / 100
        rest = (float(start), float(end)) if start < end else None
    steady = slice(motion.steady_start, motion.steady_end)
    kept = np.isfinite(time[steady]) & np.isfinite(travel[steady])
    speed = abs(float(np.polyfit(time[steady][kept], travel[steady][kept], 1)[0])) if kept.sum() > 2 else None
    return LogFound(found.name, names, columns, rest, speed, abs(motion.travel_mm))
