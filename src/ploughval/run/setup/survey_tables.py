"""The tables of a folder, told apart by their headers: times of photographs, calibrations, logs."""

import csv
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ploughval.loadcells.logs.names import matches
from ploughval.run.setup.log_words import guess_columns

ENDINGS = frozenset({".csv", ".txt", ".dat", ".tsv", ".asc", ".tdms"})
_HEAD_BYTES = 65_536
_HEAD_LINES = 200
_EMPTY = re.compile(
    r"(?i)(.*[\W_])?(empty|leer|leerfahrt|vide|vacio|vuoto|leeg|blank|friction|reibung|no[-_ ]?sand|"
    r"ohne[-_ ]?sand)([\W_\d].*)?"
)
_LOADS = ("load_N", "mass_kg", "moment_upper_Nm")

_LEAST_COLUMNS = 2  # of a log whose columns are not recognised
_LEAST_ROWS = 3
_NUMBER = re.compile(r"\s*[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?\s*")

Kind = Literal["times", "calibration", "empty", "log", "unclear", "other"]


@dataclass(frozen=True, slots=True)
class TableFile:
    """A table: its file, the names in its header, the columns of a log that they mean, and its kind.

    Columns without names are called 1, 2, 3 and so on.
    """

    path: Path
    names: tuple[str, ...]
    columns: dict[str, str]
    kind: Kind


def look_at_table(path: Path, folder: Path) -> TableFile:
    """Read a table's header and say what kind of table it is."""
    names, columns = _tdms_header(path) if path.suffix.lower() == ".tdms" else _header(path)
    return TableFile(path, names, columns, _kind(path, folder, names, columns))


def _kind(path: Path, folder: Path, names: tuple[str, ...], columns: dict[str, str]) -> Kind:
    if {"file", "time_s"} <= set(names):
        return "times"
    readings = all(matches(cell, names) for cell in ("upper", "lower"))
    if readings and any(matches(load, names) for load in _LOADS) and "displacement_mm" not in columns:
        return "calibration"
    if of_empty_box(path, folder):
        return "empty"
    if len(columns) >= 2:
        return "log"
    wide = len(names) if path.suffix.lower() == ".tdms" else _width_of_numbers(_lines(path))
    return "unclear" if wide >= _LEAST_COLUMNS else "other"


def of_empty_box(path: Path, folder: Path) -> bool:
    """Whether a file's name, or that of a folder it stands in, says that the box held no sand."""
    inside = path.relative_to(folder)
    return any(_EMPTY.fullmatch(part) for part in (*inside.parts[:-1], inside.stem))


def _tdms_header(path: Path) -> tuple[tuple[str, ...], dict[str, str]]:
    """Names of the channels; none where the file or the package that reads it is not sound."""
    try:
        from nptdms import TdmsFile

        groups = TdmsFile.read_metadata(path).groups()
    except Exception:  # a spoiled binary file can raise anything within that package
        return (), {}
    names = tuple(channel.name for group in groups for channel in group.channels())
    return names, guess_columns(names)


def _header(path: Path) -> tuple[tuple[str, ...], dict[str, str]]:
    """The line of a text table that names most wanted columns, and which it names."""
    lines = _lines(path)
    best: tuple[tuple[str, ...], dict[str, str]] = ((), {})
    for line in lines:
        for sign in ";\t,|":
            names = _fields(line, sign)
            columns = guess_columns(names)
            if len(names) > 1 and columns and (len(columns), len(names)) > (len(best[1]), len(best[0])):
                best = names, columns
    return best if best[1] else (_names_above(lines), {})


def _names_above(lines: list[str]) -> tuple[str, ...]:
    """The line above the first one of numbers, where it has as many fields; else the first line's fields."""
    for k, line in enumerate(lines):
        numbers = _numbers(line)
        if len(numbers) < _LEAST_COLUMNS:
            continue
        above = [_fields(lines[k - 1], sign) for sign in ";\t,|"] if k else []
        named = next((names for names in above if len(names) == len(numbers)), ())
        return named or tuple(str(n + 1) for n in range(len(numbers)))
    return next((names for line in lines[:1] for names in [_fields(line, ",")] if len(names) > 1), ())


def _numbers(line: str) -> list[str]:
    """Fields of a line that holds numbers alone; none of another."""
    fields = line.strip().split(";") if ";" in line else re.split(r"[\t|,]|\s{2,}", line.strip())
    return fields if all(_NUMBER.fullmatch(field) for field in fields) else []


def _lines(path: Path) -> list[str]:
    """The first lines of a text file; none of one that cannot be read."""
    try:
        with path.open("rb") as file:
            data = file.read(_HEAD_BYTES)
    except OSError:
        return []
    text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig", errors="replace")
    if "\ufffd" in text:
        text = data.decode("latin-1")
    return text.splitlines()[:_HEAD_LINES]


def _width_of_numbers(lines: list[str]) -> int:
    """How many numbers stand in most of the lines that hold nothing else; 0 where those are few."""
    widths = Counter(len(fields) for fields in map(_numbers, lines) if len(fields) > 1)
    width, count = widths.most_common(1)[0] if widths else (0, 0)
    return width if count >= _LEAST_ROWS else 0


def _fields(line: str, sign: str) -> tuple[str, ...]:
    try:
        return tuple(cell.strip() for cell in next(csv.reader([line], delimiter=sign), []))
    except csv.Error:
        return ()
