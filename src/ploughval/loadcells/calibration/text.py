"""Columns of a text table by name, whatever its dialect; some may be missing."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.loadcells.logs.names import Wanted, matches
from ploughval.loadcells.logs.text_bytes import TextBytes, look_through
from ploughval.loadcells.logs.text_dialect import Dialect, find_dialect, split_line

_LARGEST = 1e15
_BLANK = frozenset({"", "nan", "na", "n/a", "-", "--"})


@dataclass(frozen=True, slots=True)
class Columns:
    """Columns of a text table.

    Attributes
    ----------
    text : DataFrame
        Fields as written, of the wanted columns that are there.
    line : (N,) int
        Lines of the file on which the rows stand, counted from 1.
    there : tuple of str
        Names of all columns of the file.
    decimal : str
        Sign that numbers have before their fraction.
    """

    text: pd.DataFrame
    line: NDArray[np.intp]
    there: tuple[str, ...]
    decimal: str

    def numbers(self, name: str, path: Path) -> NDArray[np.float64]:
        """A column as numbers (N,), NaN where it is empty or not there.

        Raises
        ------
        DataError
            A field holds text or a number that nothing can be.
        """
        if name not in self.text:
            return np.full(len(self.text), np.nan)
        fields = (
            self.text[name].str.replace(",", ".", regex=False) if self.decimal == "," else self.text[name]
        )
        values = pd.to_numeric(fields, errors="coerce").to_numpy(dtype=np.float64)
        odd = ~(np.abs(values) <= _LARGEST) & ~fields.str.casefold().isin(_BLANK).to_numpy()
        if odd.any():
            k = int(np.flatnonzero(odd)[0])
            limit = f" of at most {_LARGEST:g}" if np.isfinite(values[k]) else ""
            raise DataError(
                f"line {self.line[k]}: {name} is {self.text[name].iloc[k][:80]!r}; expected a number{limit}",
                path=path,
            )
        return values

    def words(self, name: str) -> list[str]:
        """A column as text (N,), empty where it is not there."""
        return self.text[name].tolist() if name in self.text else [""] * len(self.text)


def read_columns(path: Path, names: Mapping[str, str], numeric: frozenset[str]) -> Columns:
    """Read the columns of a text table that are there.

    Parameters
    ----------
    path : Path
        Separator, decimal comma, BOM and lines before the header are found.
    names : mapping of str
        Name in the file of each column; a whole number is a place counted from 1.
    numeric : frozenset of str
        Those that hold numbers, by which the rows are told from the headers.

    Raises
    ------
    DataError
        The file cannot be read, holds no row of numbers, or a name fits several columns.
    """
    content = look_through(path)
    wanted = Wanted({key: name for key, name in names.items() if key in numeric}, frozenset(names))
    dialect = find_dialect(content, wanted)
    places = {}
    for key, name in names.items():
        found = matches(name, dialect.names)
        if not found and name.isdecimal() and 0 < int(name) <= len(dialect.names):
            found = [int(name) - 1]
        if len(found) > 1:
            raise DataError(f"{len(found)} columns are called {name!r}; expected one", path=path)
        if found:
            places[key] = found[0]
    return _fields(content, dialect, places)


def _fields(content: TextBytes, dialect: Dialect, places: Mapping[str, int]) -> Columns:
    rows = [
        (k, split_line(text.rstrip("\r\n"), dialect.separator))
        for k, text in enumerate(content.lines(), start=1)
        if k > dialect.skip
    ]
    rows = [(k, row) for k, row in rows if any(row) and not row[0].startswith("#")]
    columns = {key: [row[p] if p < len(row) else "" for _, row in rows] for key, p in places.items()}
    text = pd.DataFrame(columns, index=range(len(rows)), dtype=str)
    return Columns(text, np.array([k for k, _ in rows], dtype=np.intp), dialect.names, dialect.decimal)
