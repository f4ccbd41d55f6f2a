"""Logs written as text tables: read in any dialect, every line that does not fit named."""

import csv
import re
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.loadcells.log_names import VALUE_COLUMNS, Wanted, column_unit, find_places
from ploughval.loadcells.log_rows import FileRows, name_rows
from ploughval.loadcells.log_units import stem_and_unit
from ploughval.loadcells.raw_log import RawLog
from ploughval.loadcells.text_bytes import TextBytes, look_through
from ploughval.loadcells.text_dialect import Dialect, find_dialect

_WRONG_LINES = 5


def read_text(path: Path, wanted: Wanted) -> RawLog:
    """Read a text table of any separator, decimal sign, encoding and number of header lines.

    Blank lines are passed over. Lines with too many fields, too few for the wanted columns, the headers once
    more, and a last line that is cut off are dropped. Text where a number was expected becomes NaN.

    Parameters
    ----------
    path : Path
        The file.
    wanted : Wanted
        The columns to read.

    Returns
    -------
    RawLog

    Raises
    ------
    DataError
        The file cannot be read as a table, or has not the columns.
    """
    content = look_through(path)
    dialect = find_dialect(content, wanted)
    places = find_places(dialect.names, wanted, path)
    units = {
        key: column_unit(
            key, wanted.names[key], dialect.names[k], dialect.below[k] if dialect.below else "", path
        )
        for key, k in places.items()
        if key != "date"
    }
    if "date" in places:
        told = (dialect.names[places["date"]], wanted.names["date"])
        units["date"] = next((unit for name in told if (unit := stem_and_unit(name)[1])), "")
    table, skipped = _parse(content, dialect)
    cells = {key: table[k] for key, k in places.items()}
    faults = _nul_faults(content)
    if dialect.quoted:
        lost = sum(1 for _ in content.lines()) - dialect.skip - len(table) - len(skipped)
        faults += [f"a quote that is not closed: {lost} lines lost in it"] if lost > 0 else []
    if skipped:
        shown = ", ".join(map(str, skipped[:_WRONG_LINES]))
        more = f" and {len(skipped) - _WRONG_LINES} more" if len(skipped) > _WRONG_LINES else ""
        faults.append(
            f"too many fields in line{'s' if len(skipped) > 1 else ''} {shown}{more} (expected "
            f"{len(dialect.names)}): dropped"
        )
    values = {key: numbers(cells[key], dialect.decimal) for key in VALUE_COLUMNS}
    keep, rows, more_faults = _sieve(content, dialect, table, cells, values, places, skipped)
    faults += more_faults
    if not keep.all():
        cells = {key: column[keep].reset_index(drop=True) for key, column in cells.items()}
        values = {key: column[keep] for key, column in values.items()}
    for key, column in values.items():
        faults += _text_faults(key, cells[key], column, rows)
    headers = {key: dialect.names[k] for key, k in places.items()}
    time, date = cells.get("time_s"), cells.get("date")
    return RawLog(path, time, date, values, headers, units, rows, tuple(faults))


def numbers(column: pd.Series, decimal: str) -> NDArray[np.float64]:
    """A column as float64; text that is no number becomes NaN.

    Parameters
    ----------
    column : (N,) Series
        Cells as read.
    decimal : str
        The sign before the decimals. Where cells hold a decimal comma, a point is no decimal point.

    Returns
    -------
    (N,) float
    """
    if column.dtype.kind in "fiu":
        return column.to_numpy(dtype=np.float64, copy=True)
    column = column.astype(object)
    found = pd.to_numeric(column, errors="coerce").to_numpy(dtype=np.float64, copy=True)
    if decimal == ",":
        text = np.array([isinstance(cell, str) for cell in column], dtype=bool)
        words = column[text].astype(str).str.strip()
        comma = words.str.contains(",", regex=False)
        if comma.any():
            words = words.where(~words.str.contains(".", regex=False), "").str.replace(",", ".", regex=False)
            found[text] = pd.to_numeric(words, errors="coerce").to_numpy(dtype=np.float64)
    return found


def _parse(content: TextBytes, dialect: Dialect) -> tuple[pd.DataFrame, list[int]]:
    """All cells, blank lines as empty rows; and the lines, from 1, left out for too many fields."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            with content.open() as file:
                table = pd.read_csv(
                    file,
                    sep=dialect.separator,
                    decimal=dialect.decimal,
                    header=None,
                    names=list(range(len(dialect.names))),
                    index_col=False,
                    skiprows=dialect.skip,
                    skipinitialspace=True,
                    skip_blank_lines=False,
                    encoding=content.encoding,
                    encoding_errors="replace",
                    # A stray quote must not swallow the lines up to the next one.
                    quoting=csv.QUOTE_MINIMAL if dialect.quoted else csv.QUOTE_NONE,
                    on_bad_lines="warn",
                )
        except (ValueError, OSError, OverflowError, MemoryError) as error:
            raise DataError(f"cannot be read as a text table: {error}", path=content.path) from None
    lines = [int(n) for item in caught for n in re.findall(r"[Ss]kipping line (\d+)", str(item.message))]
    return table, sorted(lines)


def _nul_faults(content: TextBytes) -> list[str]:
    if not content.nuls:
        return []
    if content.nul_line is None:
        return ["NUL bytes at the end: taken off (the file was not closed as it should)"]
    return [f"NUL bytes, first in line {content.nul_line}: what they stand in is no number"]


def _sieve(
    content: TextBytes,
    dialect: Dialect,
    table: pd.DataFrame,
    cells: Mapping[str, pd.Series],
    values: Mapping[str, NDArray[np.float64]],
    places: Mapping[str, int],
    skipped: Sequence[int],
) -> tuple[NDArray[np.bool_], FileRows, list[str]]:
    """Which rows are kept, where they stand, and what was dropped."""
    count = len(table)
    lines = _line_numbers(count, dialect.skip + 1, skipped)
    empty = np.zeros(count, dtype=bool)
    suspect = np.zeros(count, dtype=bool)
    for column in values.values():
        suspect |= np.isnan(column)
    places_in_doubt = np.flatnonzero(suspect)
    empty[places_in_doubt] = table.iloc[places_in_doubt].isna().all(axis=1).to_numpy()
    if not skipped and not empty.any():
        rows = FileRows(content.path.name, count, dialect.skip + 1)
    else:
        # A line with too many fields is a row as well; a blank one is none.
        extra = np.searchsorted(np.asarray(skipped, dtype=np.intp), lines)
        place = np.cumsum(~empty) - 1 + extra
        rows = FileRows(content.path.name, count, dialect.skip + 1, place, lines)
    dropped = empty.copy()
    faults = []
    again = suspect & ~empty
    for key, k in places.items():
        if again.any():
            again[again] = (
                cells[key][again].astype(str).str.strip().str.strip('"') == dialect.names[k]
            ).to_numpy()
    again &= dialect.skip > 0
    short = _short_rows(content, dialect, suspect & ~empty & ~again, lines, max(places.values()))
    if count and content.last_line_is_cut():
        last = int(np.flatnonzero(~empty)[-1]) if not empty.all() else 0
        short[last] = False
        dropped[last] = True
        faults.append(f"the last line is cut off: {name_rows(np.array([last]), [rows])} dropped")
    for which, what in ((again, "the headers once more"), (short, "too few fields")):
        if which.any():
            faults.append(f"{what} in {name_rows(np.flatnonzero(which), [rows])}: dropped")
            dropped |= which
    return ~dropped, rows.take(np.flatnonzero(~dropped)) if dropped.any() else rows, faults


def _line_numbers(count: int, first: int, skipped: Sequence[int]) -> NDArray[np.intp]:
    """Line, from 1, of each row of the table, given the lines that are not in it."""
    lines = np.arange(first, first + count, dtype=np.intp)
    if skipped:
        gone = np.asarray(skipped, dtype=np.intp) - np.arange(len(skipped)) - first
        lines += np.searchsorted(gone, np.arange(count), side="right")
    return lines


def _short_rows(
    content: TextBytes,
    dialect: Dialect,
    suspect: NDArray[np.bool_],
    lines: NDArray[np.intp],
    last_place: int,
) -> NDArray[np.bool_]:
    """Of the suspect rows, those that have not the fields up to the last wanted one."""
    short = np.zeros(suspect.size, dtype=bool)
    rows = np.flatnonzero(suspect)
    if rows.size == 0:
        return short
    asked = dict(zip(lines[rows].tolist(), rows.tolist(), strict=True))
    for number, line in enumerate(content.lines(), start=1):
        row = asked.get(number)
        if row is not None:
            short[row] = dialect.fields(line) <= last_place
    return short


def _text_faults(key: str, cells: pd.Series, found: NDArray[np.float64], rows: FileRows) -> list[str]:
    """A column's text where numbers were expected, if there is any."""
    if cells.dtype.kind in "fiu":
        return []
    text = np.flatnonzero(np.isnan(found) & cells.notna().to_numpy())
    if text.size == 0:
        return []
    sample = str(cells.iloc[int(text[0])])[:20]
    return [f"{key} holds text where a number was expected ({sample!r}) in {name_rows(text, [rows])}"]
