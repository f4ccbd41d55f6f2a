"""Times of photographs: from EXIF, from a CSV table, or from a constant interval."""

import csv
import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.photos.exif import ExifTime

_LONGEST_TEST_S = 86_400.0
_SHOWN = 5


@dataclass(frozen=True, slots=True)
class FrameTimes:
    """Times of the frames in the order of their names, and what was wrong with some of them.

    time_s (F,) float, s, NaN where unknown; faults by frame; notes on what belongs to no frame; missing
    photographs that have a time.
    """

    time_s: NDArray[np.float64]
    faults: dict[int, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()


def interval_times(count: int, start_s: float, interval_s: float) -> FrameTimes:
    """Times of `count` photographs taken at a constant interval, s."""
    return FrameTimes(start_s + interval_s * np.arange(count, dtype=float))


def exif_times(exif: Sequence[ExifTime | None], paths: Sequence[Path]) -> FrameTimes:
    """Times from DateTimeOriginal, SubSecTimeOriginal and OffsetTimeOriginal.

    Parameters
    ----------
    exif : sequence of ExifTime or None
        One a frame; None for a file that could not be read.
    paths : sequence of Path
        The files, for messages.

    Returns
    -------
    FrameTimes
        Seconds since the earliest photograph. Photographs without a time, or more than a day away
        from the middle of the series, are faults.

    Raises
    ------
    DataError
        No photograph holds a time, or all hold the same (a clock that stands still).
    """
    zoned = all(e.offset for e in exif if e is not None and e.date)
    stamps = np.array([_stamp(e, zoned=zoned) if e is not None else np.nan for e in exif])
    known = np.isfinite(stamps)
    remedy = 'Give times as a CSV file (file,time_s) or as {start_s, interval_s} in place of "exif".'
    if not known.any():
        raise DataError(
            f"none of {len(paths)} photographs holds DateTimeOriginal. {remedy}", path=paths[0].parent
        )
    if known.sum() > 1 and np.ptp(stamps[known]) == 0:
        raise DataError(
            f"all photographs hold the same DateTimeOriginal: the camera's clock stood still. {remedy}",
            path=paths[0].parent,
        )
    false = known & (np.abs(stamps - np.median(stamps[known])) > _LONGEST_TEST_S)
    faults = {}
    for k, tags in enumerate(exif):
        if tags is not None and not known[k]:
            faults[k] = f"holds no usable DateTimeOriginal (got {tags.date!r})"
        elif tags is not None and false[k]:
            faults[k] = (
                f"holds DateTimeOriginal {tags.date}, more than a day away from the series: a false tag"
            )
    stamps[false] = np.nan
    return FrameTimes(stamps - np.nanmin(stamps), faults)


def _stamp(tags: ExifTime, *, zoned: bool) -> float:
    """Seconds since 1970 of one photograph, in UTC where all have a zone; NaN if it cannot be read."""
    try:
        moment = datetime.strptime(tags.date, "%Y:%m:%d %H:%M:%S").replace(tzinfo=UTC)
    except ValueError:
        return float("nan")
    zone = re.fullmatch(r"([+-])(\d\d):(\d\d)", tags.offset)
    if zoned and zone:
        shift = timedelta(hours=int(zone[2]), minutes=int(zone[3]))
        moment -= shift if zone[1] == "+" else -shift
    fraction = float(f"0.{tags.subsecond}") if re.fullmatch(r"[0-9]+", tags.subsecond) else 0.0
    return moment.timestamp() + fraction


def table_times(table: Path, names: Sequence[str]) -> FrameTimes:
    """Times from a CSV table with the columns file and time_s.

    Parameters
    ----------
    table : Path
        Comma or semicolon between the columns; with a semicolon, a comma may be the decimal sign.
    names : sequence of str
        File of each frame, relative to the test folder with forward slashes, in the order of frames. A
        file that holds several frames stands several times and needs as many rows.

    Returns
    -------
    FrameTimes
        Frames without a row are faults; rows for files that are not there are missing.

    Raises
    ------
    DataError
        Missing columns, times that are not numbers, a file named too often, no file known at all.
    """
    rows = _read_rows(table)
    frames: defaultdict[str, list[int]] = defaultdict(list)
    for k, name in enumerate(names):
        frames[name].append(k)
    bare: defaultdict[str, set[str]] = defaultdict(set)
    for name in frames:
        bare[name.rsplit("/", 1)[-1]].add(name)
    time_s, used = np.full(len(names), np.nan), defaultdict(list)
    unknown: list[str] = []
    for line, name, value in rows:
        wanted = name.replace("\\", "/").removeprefix("./")
        if wanted not in frames and len(bare.get(wanted, ())) == 1:
            (wanted,) = bare[wanted]
        if wanted not in frames:
            unknown.append(name)
            continue
        used[wanted].append(line)
        if len(used[wanted]) <= len(frames[wanted]):
            time_s[frames[wanted][len(used[wanted]) - 1]] = value
    _refuse_repeated(table, used, frames)
    if not np.isfinite(time_s).any():
        raise DataError(f"names none of the {len(names)} photographs, such as {names[0]}", path=table)
    faults = {int(k): f"has no row in {table.name}" for k in np.flatnonzero(np.isnan(time_s))}
    return FrameTimes(time_s, faults, missing=tuple(unknown))


def _read_rows(table: Path) -> list[tuple[int, str, float]]:
    """Line, file and time of each row that is not blank."""
    try:
        text = table.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"cannot be read as UTF-8 text: {error}", path=table) from None
    lines = text.splitlines()
    sign = ";" if lines and ";" in lines[0] else ","
    reader = csv.reader(lines, delimiter=sign, skipinitialspace=True)
    header = [cell.strip() for cell in next(reader, [])]
    if not {"file", "time_s"} <= set(header):
        raise DataError(f"has the columns {header}; expected file and time_s in the first line", path=table)
    where, when = header.index("file"), header.index("time_s")
    rows, wrong = [], []
    for cells in reader:
        if not any(cell.strip() for cell in cells):
            continue
        try:
            value = float(cells[when].replace(",", ".") if sign == ";" else cells[when])
        except (ValueError, IndexError):
            value = float("nan")
        if not np.isfinite(value):
            wrong.append(f"line {reader.line_num}: {sign.join(cells)!r}")
            continue
        rows.append((reader.line_num, cells[where].strip(), value))
    if wrong:
        raise DataError(f"holds times that are not numbers of seconds: {_list(wrong)}", path=table)
    return rows


def _refuse_repeated(table: Path, used: dict[str, list[int]], frames: dict[str, list[int]]) -> None:
    over = [f"{n} (lines {', '.join(map(str, at))})" for n, at in used.items() if len(at) > len(frames[n])]
    if over:
        raise DataError(f"names the same photograph more than once: {_list(over)}", path=table)


def refuse_doubled(time_s: NDArray[np.float64], names: Sequence[str], source: Path) -> None:
    """Refuse two frames at the same time.

    Raises
    ------
    DataError
        Naming the pairs: order and displacement of such frames cannot be told.
    """
    order = np.argsort(time_s, kind="stable")
    same = np.flatnonzero(np.diff(time_s[order]) == 0)
    if same.size:
        pairs = [f"{names[order[k]]} and {names[order[k + 1]]} at {time_s[order[k]]:g} s" for k in same]
        raise DataError(
            f"photographs with the same time: {_list(pairs)}. Remove copies; where the camera writes no "
            "fractions of a second, give times as a CSV file or as {start_s, interval_s}.",
            path=source,
        )


def _list(items: Sequence[str]) -> str:
    more = f" and {len(items) - _SHOWN} more" if len(items) > _SHOWN else ""
    return ", ".join(items[:_SHOWN]) + more
