"""The rows of a text table: where each stands in the file, and which are none that can be read."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.loadcells.logs.rows import FileRows, name_rows
from ploughval.loadcells.logs.text_bytes import TextBytes
from ploughval.loadcells.logs.text_dialect import Dialect

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Lines:
    """A text table as parsed.

    Attributes
    ----------
    content : TextBytes
    dialect : Dialect
    table : DataFrame
        All cells; a blank line is a row without any.
    places : mapping of int
        Place of each wanted column.
    skipped : tuple of int
        Lines, from 1 and rising, that the table does not hold as they have too many fields.
    """

    content: TextBytes
    dialect: Dialect
    table: pd.DataFrame
    places: Mapping[str, int]
    skipped: tuple[int, ...]

    def numbers(self) -> NDArray[np.intp]:
        """Line, from 1, of each row of the table."""
        first, count = self.dialect.skip + 1, len(self.table)
        lines = np.arange(first, first + count, dtype=np.intp)
        if self.skipped:
            gone = np.asarray(self.skipped, dtype=np.intp) - np.arange(len(self.skipped)) - first
            lines += np.searchsorted(gone, np.arange(count), side="right")
        return lines


def sieve(lines: Lines, suspect: Mask) -> tuple[FileRows, NDArray[np.intp], list[str]]:
    """Drop what is no row: blank lines, headers once more, too few fields, a last line that is cut off.

    Parameters
    ----------
    lines : Lines
        The table.
    suspect : (N,) bool
        Rows in which a wanted value is no number: no other is looked at.

    Returns
    -------
    rows : FileRows
        Where the rows that are kept stand.
    keep : (M,) int
        Their places in the table.
    faults : list of str
    """
    blank = suspect.copy()
    blank[suspect] = lines.table[suspect].isna().all(axis=1).to_numpy()
    rows = _where(lines, blank)
    again = _headers_again(lines, suspect & ~blank)
    short = _too_few_fields(lines, suspect & ~blank & ~again)
    cut = np.zeros_like(blank)
    if not blank.all() and lines.content.last_line_is_cut():
        cut[np.flatnonzero(~blank)[-1]] = True
        short &= ~cut
    faults = []
    for which, what in (
        (again, "the headers once more"),
        (short, "too few fields"),
        (cut, "the last line is cut off"),
    ):
        if which.any():
            faults.append(f"{what} in {name_rows(np.flatnonzero(which), [rows])}: dropped")
    dropped = blank | again | short | cut
    keep = np.flatnonzero(~dropped)
    return rows if keep.size == dropped.size else rows.take(keep), keep, faults


def _where(lines: Lines, blank: Mask) -> FileRows:
    """Where every row stands; a line with too many fields is a row as well, a blank one is none."""
    name, first = lines.content.path.name, lines.dialect.skip + 1
    if not lines.skipped and not blank.any():
        return FileRows(name, blank.size, first)
    numbers = lines.numbers()
    extra = np.searchsorted(np.asarray(lines.skipped, dtype=np.intp), numbers)
    return FileRows(name, blank.size, first, np.cumsum(~blank) - 1 + extra, numbers)


def _headers_again(lines: Lines, suspect: Mask) -> Mask:
    """Of the suspect rows, those that hold the names of the wanted columns."""
    again = suspect.copy()
    for place in lines.places.values():
        cells = lines.table[place]
        if cells.dtype.kind in "fiu" or not again.any():
            return np.zeros_like(suspect)
        words = cells[again].astype(str).str.strip().str.strip('"')
        again[again] = (words == lines.dialect.names[place]).to_numpy()
    return again


def _too_few_fields(lines: Lines, suspect: Mask) -> Mask:
    """Of the suspect rows, those that have not the fields up to the last wanted one."""
    short = np.zeros_like(suspect)
    last = max(lines.places.values())
    places = np.flatnonzero(suspect)
    places = places[lines.table[last].iloc[places].isna().to_numpy()]
    if places.size == 0:
        return short
    asked = dict(zip(lines.numbers()[places].tolist(), places.tolist(), strict=True))
    for number, line in enumerate(lines.content.lines(), start=1):
        place = asked.get(number)
        if place is not None:
            short[place] = lines.dialect.fields(line) <= last
    return short
