"""Logs written as text tables: read in any dialect, every line that does not fit named."""

import csv
import re
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.columns import floats_of
from ploughval.errors import DataError
from ploughval.loadcells.logs.names import VALUE_COLUMNS, Wanted, column_unit, find_places
from ploughval.loadcells.logs.raw import RawLog
from ploughval.loadcells.logs.rows import FileRows, name_rows
from ploughval.loadcells.logs.text_bytes import TextBytes, look_through
from ploughval.loadcells.logs.text_dialect import Dialect, find_dialect
from ploughval.loadcells.logs.text_rows import Lines, sieve
from ploughval.loadcells.logs.units import stem_and_unit

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
    units = _units(dialect, places, wanted, path)
    table, skipped = _parse(content, dialect)
    faults = _file_faults(content, dialect, len(table), skipped)
    cells = {key: table[k] for key, k in places.items()}
    values = {key: numbers(cells[key], dialect.decimal) for key in VALUE_COLUMNS}
    suspect = np.zeros(len(table), dtype=bool)
    for column in values.values():
        suspect |= np.isnan(column)
    rows, keep, lost = sieve(Lines(content, dialect, table, places, tuple(skipped)), suspect)
    faults += lost
    if keep.size < len(table):
        cells = {key: column.iloc[keep].reset_index(drop=True) for key, column in cells.items()}
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
    found = floats_of(column)
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


def _units(dialect: Dialect, places: Mapping[str, int], wanted: Wanted, path: Path) -> dict[str, str]:
    """The unit of each column, and the form of the dates, as headers and settings tell them."""
    units = {}
    for key, k in places.items():
        header, name = dialect.names[k], wanted.names[key]
        if key == "date":
            units[key] = stem_and_unit(header)[1] or stem_and_unit(name)[1]
        else:
            units[key] = column_unit(key, name, header, dialect.below[k] if dialect.below else "", path)
    return units


def _file_faults(content: TextBytes, dialect: Dialect, count: int, skipped: list[int]) -> list[str]:
    """What is wrong with the file as a whole, of whose rows ``count`` were read."""
    faults = []
    if content.nul_line is not None:
        faults.append(f"NUL bytes, first in line {content.nul_line}: what they stand in is no number")
    elif content.nuls:
        faults.append("NUL bytes at the end: taken off (the file was not closed as it should)")
    if dialect.quoted:
        lost = sum(1 for _ in content.lines()) - dialect.skip - count - len(skipped)
        faults += [f"a quote that is not closed: {lost} lines lost in it"] if lost > 0 else []
    if skipped:
        shown = ", ".join(map(str, skipped[:_WRONG_LINES]))
        more = f" and {len(skipped) - _WRONG_LINES} more" if len(skipped) > _WRONG_LINES else ""
        faults.append(
            f"too many fields in line{'s' if len(skipped) > 1 else ''} {shown}{more} (expected "
            f"{len(dialect.names)}): dropped"
        )
    return faults


def _text_faults(key: str, cells: pd.Series, found: NDArray[np.float64], rows: FileRows) -> list[str]:
    """A column's text where numbers were expected, if there is any."""
    if cells.dtype.kind in "fiu":
        return []
    text = np.flatnonzero(np.isnan(found) & cells.notna().to_numpy())
    if text.size == 0:
        return []
    sample = str(cells.iloc[int(text[0])])[:20]
    return [f"{key} holds text where a number was expected ({sample!r}) in {name_rows(text, [rows])}"]
