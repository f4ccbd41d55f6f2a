"""The tables of a folder, told apart by their headers: times of photographs, calibrations, logs."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ploughval.loadcells.log_names import matches
from ploughval.run.log_words import guess_columns

ENDINGS = frozenset({".csv", ".txt", ".dat", ".tsv", ".asc", ".tdms"})
_HEAD_BYTES = 65_536
_HEAD_LINES = 200
_EMPTY = re.compile(
    r"(?i)(.*[\W_])?(empty|leer|leerfahrt|vide|vacio|vuoto|leeg|blank|friction|reibung|no[-_ ]?sand|"
    r"ohne[-_ ]?sand)([\W_\d].*)?"
)
_LOADS = ("load_N", "mass_kg", "moment_upper_Nm")

Kind = Literal["times", "calibration", "empty", "log", "other"]


@dataclass(frozen=True, slots=True)
class TableFile:
    """A table: its file, the names in its header, the columns of a log that they mean, and its kind."""

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
    return "log" if len(columns) >= 2 or (path.suffix.lower() == ".tdms" and names) else "other"


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
    try:
        with path.open("rb") as file:
            data = file.read(_HEAD_BYTES)
    except OSError:
        return (), {}
    text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig", errors="replace")
    if "\ufffd" in text:
        text = data.decode("latin-1")
    best: tuple[tuple[str, ...], dict[str, str]] = ((), {})
    for line in text.splitlines()[:_HEAD_LINES]:
        for sign in ";\t,|":
            names = _fields(line, sign)
            columns = guess_columns(names)
            if len(names) > 1 and (len(columns), len(names)) > (len(best[1]), len(best[0]) if columns else 0):
                best = names, columns
        if not best[0] and "," in line:
            best = _fields(line, ","), {}
    return best


def _fields(line: str, sign: str) -> tuple[str, ...]:
    try:
        return tuple(cell.strip() for cell in next(csv.reader([line], delimiter=sign), []))
    except csv.Error:
        return ()
