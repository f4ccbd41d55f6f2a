"""Times of photographs from a CSV table."""

import csv
import io
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from ploughval.errors import DataError
from ploughval.limits import SETTINGS_BYTES, read_limited
from ploughval.photos.series.times import FrameTimes, exact, shorten

_LATEST_S = 1e12


class _Reader(Protocol):
    """What csv.reader gives."""

    line_num: int

    def __next__(self) -> list[str]: ...

    def __iter__(self) -> Iterator[list[str]]: ...


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
        wanted = name if name in frames else name.replace("\\", "/").removeprefix("./")
        for other in (name, wanted):
            if wanted not in frames and len(bare.get(other, ())) == 1:
                (wanted,) = bare[other]
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
    return FrameTimes(time_s, exact(time_s), faults, missing=tuple(unknown))


def _read_rows(table: Path) -> list[tuple[int, str, float]]:
    """Line, file and time of each row that is not blank."""
    try:
        remedy = "One row a photograph is enough."
        text = read_limited(table, SETTINGS_BYTES, remedy).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"cannot be read as UTF-8 text: {error}", path=table) from None
    sign = ";" if ";" in text[: text.find("\n")] else ","
    try:
        return _rows_of(
            table, csv.reader(io.StringIO(text, newline=""), delimiter=sign, skipinitialspace=True), sign
        )
    except csv.Error as error:
        raise DataError(
            f"is no CSV table: {error}; expected file and time_s in each line", path=table
        ) from None


def _rows_of(table: Path, reader: "_Reader", sign: str) -> list[tuple[int, str, float]]:
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
        if not abs(value) <= _LATEST_S:
            wrong.append(f"line {reader.line_num}: {sign.join(cells)[:80]!r}")
            continue
        rows.append((reader.line_num, cells[where].strip(), value))
    if wrong:
        raise DataError(f"holds times that are not numbers of seconds: {shorten(wrong)}", path=table)
    return rows


def _refuse_repeated(table: Path, used: dict[str, list[int]], frames: dict[str, list[int]]) -> None:
    over = [f"{n} (lines {', '.join(map(str, at))})" for n, at in used.items() if len(at) > len(frames[n])]
    if over:
        raise DataError(f"names the same photograph more than once: {shorten(over)}", path=table)
