"""Load-cell logs: CSV of any common dialect, or TDMS, as one table with its faults named."""

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ploughval.errors import DataError, MissingExtraError
from ploughval.loadcells.checks import check_table
from ploughval.scene import LogColumns

VALUE_COLUMNS = ("time_s", "displacement_mm", "moment_upper", "moment_lower")
_SETTINGS = ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
_HEAD_LINES = 200
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?$")
_NOT_A_NUMBER = frozenset({"", "nan", "na", "n/a", "inf", "+inf", "-inf", "null", "none", "-", "--"})


@dataclass(frozen=True, slots=True)
class Log:
    """One log, in order of time.

    Attributes
    ----------
    data : DataFrame
        time_s, displacement_mm, moment_upper, moment_lower (float64, moments in the log's own unit, NaN where
        not measured) and status (categorical of ForceStatus values). A gap holds a row of NaN at its middle.
    faults : tuple of str
        What was found wrong and what was done about it; rows are counted from 0 after the headers.
    """

    data: pd.DataFrame
    faults: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Dialect:
    separator: str
    decimal: str
    names: tuple[str, ...]
    skip: int  # lines before the first row of numbers


def read_log(path: Path | str, columns: LogColumns) -> Log:
    """Read a log of displacement and two bending moments.

    Parameters
    ----------
    path : path-like
        A text table (separator, decimal comma, BOM, preamble and rows of units are found) or a .tdms file.
    columns : LogColumns
        What the four columns are called; a text table without names calls them 1, 2, 3 and so on.

    Returns
    -------
    Log

    Raises
    ------
    DataError
        The file cannot be read, a column is missing, or fewer than two rows hold a time.
    MissingExtraError
        A .tdms file without the package nptdms.
    """
    path = Path(path)
    wanted = [getattr(columns, name) for name in _SETTINGS]
    if path.suffix.lower() == ".tdms":
        table, faults = _read_tdms(path, wanted), list[str]()
    else:
        table, faults = _read_text(path, wanted)
    if int(np.isfinite(table["time_s"].to_numpy()).sum()) < 2:
        raise DataError(
            f"column {wanted[0]!r} holds fewer than two times; expected one a row, in seconds", path=path
        )
    checked, more = check_table(table)
    return Log(checked, tuple([*faults, *more]))


def _read_text(path: Path, wanted: Sequence[str]) -> tuple[pd.DataFrame, list[str]]:
    encoding = _encoding(path)
    try:
        with path.open(encoding=encoding, newline=None) as file:
            head = [line.rstrip("\r\n") for _, line in zip(range(_HEAD_LINES), file, strict=False)]
    except (OSError, UnicodeError) as error:
        raise DataError(f"cannot be read as a text table: {error}", path=path) from None
    dialect = _sniff(head, wanted, path)
    places = _places(dialect.names, wanted, path)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", pd.errors.ParserWarning)
        try:
            raw = pd.read_csv(
                path,
                sep=dialect.separator,
                decimal=dialect.decimal,
                header=None,
                names=list(range(len(dialect.names))),
                index_col=False,
                skiprows=dialect.skip,
                skipinitialspace=True,
                encoding=encoding,
                on_bad_lines="warn",
                low_memory=False,
            )
        except (ValueError, OSError) as error:
            raise DataError(f"cannot be read as a text table: {error}", path=path) from None
    lines = [int(n) for item in caught for n in re.findall(r"line (\d+)", str(item.message))]
    faults = []
    if lines:
        where = ", ".join(str(n) for n in lines[:5])
        faults.append(f"{len(lines)} lines with too many fields (line {where}): dropped")
    values = {
        name: _numbers(raw[place], dialect.decimal) for name, place in zip(VALUE_COLUMNS, places, strict=True)
    }
    return pd.DataFrame(values), faults


def _encoding(path: Path) -> str:
    try:
        with path.open("rb") as file:
            start = file.read(65536)
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror or error}", path=path) from None
    if start.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    try:
        start.decode("utf-8")
    except UnicodeDecodeError as error:
        if error.start < len(start) - 4:  # not just a letter cut in two by the end of the block
            return "latin-1"
    return "utf-8-sig"


def _split(line: str, separator: str) -> list[str]:
    fields = line.split() if separator == r"\s+" else line.split(separator)
    return [field.strip().strip('"').strip() for field in fields]


def _is_number(field: str) -> bool:
    return _NUMBER.match(field) is not None


def _is_data(fields: Sequence[str], places: Sequence[int]) -> bool:
    """Whether a line belongs to the numbers, judged by the fields at these places (none: by all of them)."""
    judged = [fields[k] for k in places if k < len(fields)] if places else list(fields)
    numbers = sum(map(_is_number, judged))
    return numbers >= 2 and all(_is_number(f) or f.lower() in _NOT_A_NUMBER for f in judged)


def _sniff(head: Sequence[str], wanted: Sequence[str], path: Path) -> _Dialect:
    """Separator, decimal sign, column names and number of lines before the numbers."""
    separator = _separator(head, wanted)
    rows = [_split(line, separator) for line in head]
    known = {name.casefold() for name in wanted}
    named = next((k for k, row in enumerate(rows) if known & {f.casefold() for f in row}), None)
    start = 0 if named is None else named + 1
    places = [] if named is None else [k for k, f in enumerate(rows[named]) if f.casefold() in known]
    first = next((k for k in range(start, len(rows)) if _is_data(rows[k], places)), None)
    if first is None:
        raise DataError(
            f"no row of numbers in its first {_HEAD_LINES} lines; expected the columns {', '.join(wanted)}",
            path=path,
        )
    if named is None and first > 0 and any(rows[first - 1]):
        above = [k for k in range(first) if len(rows[k]) == len(rows[first]) and any(rows[k])]
        named = above[0] if above else None
    width = len(rows[first])
    names = tuple(rows[named]) if named is not None else tuple(str(k + 1) for k in range(width))
    names += tuple(f"column {k + 1}" for k in range(len(names), width))
    comma = separator != "," and any("," in f for row in rows[first:] for f in row if _is_number(f))
    return _Dialect(separator, "," if comma else ".", names, first)


def _separator(head: Sequence[str], wanted: Sequence[str]) -> str:
    """The separator whose fields hold most of the wanted names, then most numbers."""
    known = {name.casefold() for name in wanted}

    def score(separator: str) -> tuple[int, int]:
        rows = [_split(line, separator) for line in head]
        names = max((len(known & {f.casefold() for f in row}) for row in rows), default=0)
        return names, sum(sum(map(_is_number, row)) for row in rows if len(row) > 1)

    return max((";", "\t", ",", "|", r"\s+"), key=score)


def _places(names: Sequence[str], wanted: Sequence[str], path: Path) -> list[int]:
    """Place of every wanted column: by its exact name, else regardless of case."""
    folded = [name.casefold() for name in names]
    places = []
    for name in wanted:
        if name in names:
            places.append(names.index(name))
        elif name.casefold() in folded:
            places.append(folded.index(name.casefold()))
    missing = [name for name in wanted if name not in names and name.casefold() not in folded]
    if missing:
        shown = ", ".join(name for name in names if name)
        raise DataError(
            f"no column {', '.join(map(repr, missing))}; the columns there are: {shown}. "
            "Name the right ones in [loadcells.columns] of test.toml",
            path=path,
        )
    return places


def _numbers(column: pd.Series, decimal: str) -> np.ndarray:
    """A column as float64; text that is no number becomes NaN (and is named by the checks)."""
    if column.dtype.kind in "fiu":
        return column.to_numpy(dtype=np.float64)
    text = column.astype(str).str.strip()
    if decimal == ",":
        text = text.str.replace(",", ".", regex=False)
    return pd.to_numeric(text, errors="coerce").to_numpy(dtype=np.float64)


def _read_tdms(path: Path, wanted: Sequence[str]) -> pd.DataFrame:
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise MissingExtraError("nptdms", "tdms", f"Reading {path}") from None
    try:
        file = TdmsFile.read(path)
    except (OSError, ValueError, KeyError) as error:
        raise DataError(f"cannot be read as TDMS: {error}", path=path) from None
    channels: dict[str, Any] = {}
    for group in file.groups():
        for channel in group.channels():
            channels.setdefault(channel.name, channel)
            channels[f"{group.name}/{channel.name}"] = channel
    time, *values = wanted
    timed = time in channels or all(
        name in channels and "wf_increment" in channels[name].properties for name in values
    )
    _places([*channels, *([time] if timed else [])], wanted, path)
    data = [np.asarray(channels[name][:], dtype=np.float64) for name in values]
    clock = channels[time][:] if time in channels else channels[values[0]].time_track()
    data.insert(0, _seconds(np.asarray(clock)))
    lengths = [len(column) for column in data]
    if len(set(lengths)) > 1:
        shown = ", ".join(f"{name}: {n}" for name, n in zip(wanted, lengths, strict=True))
        raise DataError(f"channels of different lengths ({shown}); expected one sample each a row", path=path)
    return pd.DataFrame(dict(zip(VALUE_COLUMNS, data, strict=True)))


def _seconds(clock: np.ndarray) -> np.ndarray:
    """A channel of times as seconds; absolute times count from the first."""
    if clock.dtype.kind == "M":
        return np.asarray((clock - clock[0]) / np.timedelta64(1, "us") * 1e-6, dtype=np.float64)
    return clock.astype(np.float64)
