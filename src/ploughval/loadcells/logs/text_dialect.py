"""The dialect of a text table: encoding, separator, decimal sign, headers and where its numbers start."""

import contextlib
import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ploughval.errors import DataError
from ploughval.loadcells.logs.names import Wanted
from ploughval.loadcells.logs.text_bytes import TextBytes
from ploughval.loadcells.logs.units import stem_and_unit

SPACES = r"\s+"
_SEPARATORS = (";", "\t", ",", "|", SPACES)
_HEAD_LINES = 200
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
_MOMENT_IN_TIME = re.compile(r"(?=.*[:/.-].*)\d[\dT:/., +-]*\d?( ?[AaPp][Mm]|Z)?")
_NOT_A_NUMBER = frozenset({"", "nan", "na", "n/a", "inf", "+inf", "-inf", "null", "none", "-", "--"})


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a text table is written.

    Attributes
    ----------
    separator, decimal : str
    names, below : tuple of str
        Fields of the header, and of the row of units under it; numbers from 1 without a header.
    skip : int
        Lines before the first row of numbers.
    quoted : bool
        Whether lines hold cells in quotes as a rule; else a quote is a letter.
    """

    separator: str
    decimal: str
    names: tuple[str, ...]
    below: tuple[str, ...]
    skip: int
    quoted: bool

    def fields(self, line: str) -> int:
        """How many fields a line has."""
        if self.quoted:
            return len(split_line(line, self.separator))
        return len(line.split() if self.separator == SPACES else line.split(self.separator))


def find_dialect(content: TextBytes, wanted: Wanted) -> Dialect:
    """Find the dialect from the first lines of a file.

    Raises
    ------
    DataError
        No row of numbers within the first lines.
    """
    head = _head(content)
    separator = max(_SEPARATORS, key=lambda sign: _score(head, sign, wanted))
    rows = [split_line(line, separator) for line in head]
    counts = [_names_in(row, wanted) for row in rows]
    named = counts.index(max(counts)) if any(counts) else None
    header = [] if named is None else rows[named]
    places = _places(header, wanted)
    values = [k for key, k in places if key not in ("time_s", "date")]
    start = 0 if named is None else named + 1
    first = next((k for k in range(start, len(rows)) if _is_data(rows[k], values)), None)
    if first is None:
        raise DataError(
            f"no row of numbers in its first {_HEAD_LINES} lines; expected the columns "
            f"{', '.join(wanted.names.values())}",
            path=content.path,
        )
    if named is None and first > 0:
        above = [k for k in range(first) if len(rows[k]) == len(rows[first]) and any(rows[k])]
        named = above[0] if above else None
    width = len(rows[first])
    if separator == "," and named is not None:
        _refuse_decimal_commas(rows[named], rows[first:], content.path)
    names = rows[named] if named is not None else [str(k + 1) for k in range(width)]
    names = [*names, *(f"column {k + 1}" for k in range(len(names), width))]
    filled = [] if named is None else [rows[k] for k in range(named + 1, first) if any(rows[k])]
    below = next((row for row in filled if len(row) == len(names) and not _is_data(row, [])), [])
    decimal = _decimal(rows[first:], [k for key, k in places if key != "date"], content.path)
    cells = [line for line in head[first:] if line.strip()]
    quoted = 2 * sum('"' in line for line in cells) >= len(cells)
    return Dialect(separator, decimal, tuple(names), tuple(below), first, quoted)


def _refuse_decimal_commas(header: Sequence[str], rows: Sequence[Sequence[str]], path: Path) -> None:
    """DataError where most rows hold numbers in about twice as many fields as headers: 0,5,1,25."""
    beyond = [row[len(header) :] for row in rows if any(row)]
    cut = [
        row for row in beyond if len(row) > 1 and len(row) >= len(header) - 1 and all(map(_is_number, row))
    ]
    if 2 * len(cut) > len(beyond):
        raise DataError(
            f"rows of {len(header) + len(cut[0])} numbers under {len(header)} headers, as where commas "
            "stand before decimals and between columns. Save it with semicolons between columns, or with "
            "decimal points",
            path=path,
        )


def _head(content: TextBytes) -> list[str]:
    """The first lines, without their ends."""
    lines = content.start.decode(content.encoding, errors="replace").split("\n")
    if len(lines) <= _HEAD_LINES and len(lines) > 1 and len(content.start) > len(content.tail):
        lines = lines[:-1]  # cut by the end of what was read
    return [line.rstrip("\r") for line in lines[:_HEAD_LINES]]


def _decimal(rows: Sequence[Sequence[str]], places: Sequence[int], path: Path) -> str:
    """The sign before the decimals: that of most cells of each column that is read (none known: of all).

    Raises
    ------
    DataError
        One column holds points, another commas, which may stand between thousands.
    """
    shown: dict[str, str] = {}
    for k in places or range(max(map(len, rows))):
        cells = [row[k] for row in rows if 0 <= k < len(row) and _is_number(row[k])]
        commas, points = ([cell for cell in cells if sign in cell] for sign in ",.")
        if commas or points:
            sign, cell = (",", commas[0]) if len(commas) > len(points) else (".", points[0])
            shown.setdefault(sign, cell)
    if places and len(shown) > 1:
        raise DataError(
            f"one column holds numbers as {shown['.']}, another as {shown[',']}: expected one decimal sign. "
            "Take out the marks between thousands, or write points alone",
            path=path,
        )
    return "," if "," in shown else "."


def split_line(line: str, separator: str) -> list[str]:
    """Fields of one line, without quotes and blanks around them."""
    if separator == SPACES:
        line, separator = " ".join(line.split()), " "
    fields = line.split(separator)
    if '"' in line:
        with contextlib.suppress(csv.Error):  # at a stray quote the plain fields are as good
            fields = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [field.strip().strip('"').strip() for field in fields]


def _is_number(field: str) -> bool:
    return _NUMBER.fullmatch(field) is not None


@lru_cache(maxsize=4096)
def _folded(field: str) -> frozenset[str]:
    return frozenset({field.casefold(), stem_and_unit(field)[0].casefold()}) - {""}


def _names_in(fields: Sequence[str], wanted: Wanted) -> int:
    """How many of the wanted names stand in a line that is not one of numbers alone."""
    if all(map(_is_number, fields)):
        return 0
    there = frozenset[str]().union(*map(_folded, fields))
    return sum(bool(_folded(name) & there) for name in wanted.names.values())


def _score(head: Sequence[str], separator: str, wanted: Wanted) -> tuple[int, int, int, int]:
    """How well a separator splits: wanted names in one line, numbers in lines as wide, numbers, times."""
    rows = [row for line in head if len(row := split_line(line, separator)) > 1]
    if not rows:
        return 0, 0, 0, 0
    names = [_names_in(row, wanted) for row in rows]
    widths = Counter(map(len, rows))
    width = len(rows[names.index(max(names))]) if any(names) else widths.most_common(1)[0][0]
    numbers = [sum(map(_is_number, row)) for row in rows]
    alike = sum(n for n, row in zip(numbers, rows, strict=True) if len(row) == width)
    return max(names), alike, sum(numbers), sum(sum(map(_is_time, row)) for row in rows)


def _is_time(field: str) -> bool:
    return len(field) < 40 and _MOMENT_IN_TIME.fullmatch(field) is not None


def _places(header: Sequence[str], wanted: Wanted) -> list[tuple[str, int]]:
    """Wanted columns and their places by a line of names, or by numbers in place of names."""
    places = []
    for key, name in wanted.names.items():
        stem = stem_and_unit(name)[0]
        found = [k for k, field in enumerate(header) if _folded(name) & _folded(field)]
        if not found and stem.isdecimal() and len(stem) < 6:
            found = [int(stem) - 1]
        places += [(key, k) for k in found]
    return places


def _is_data(fields: Sequence[str], places: Sequence[int]) -> bool:
    """Whether a line belongs to the numbers, judged by the fields at these places (none: by all of them)."""
    judged = [fields[k] for k in places if 0 <= k < len(fields)] if places else list(fields)
    numbers = sum(map(_is_number, judged))
    least = min(2, len(places)) if places else 2
    return numbers >= least and all(
        _is_number(f) or f.lower() in _NOT_A_NUMBER or (not places and _is_time(f)) for f in judged
    )
