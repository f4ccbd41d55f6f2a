"""Load-cell logs: one file or several, text of any dialect or TDMS, as one table with its faults named."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.limits import LOG_ROWS
from ploughval.loadcells.logs.checks import check_columns
from ploughval.loadcells.logs.clock import read_clock
from ploughval.loadcells.logs.ends import stops_early
from ploughval.loadcells.logs.names import KINDS, VALUE_COLUMNS, Wanted, wanted_columns
from ploughval.loadcells.logs.raw import RawLog
from ploughval.loadcells.logs.rows import FileRows, name_rows
from ploughval.loadcells.logs.series import join_files
from ploughval.loadcells.logs.tdms import read_tdms
from ploughval.loadcells.logs.text_table import read_text
from ploughval.loadcells.logs.time_faults import Rows, order_times
from ploughval.loadcells.logs.units import OURS, unit_factor
from ploughval.scene import CellCalibration, LogColumns

_SHORTEST_S = 1e-9  # times that rise by less in all are the same
_SCALES = {"moment_upper": "upper_Nm_per_unit", "moment_lower": "lower_Nm_per_unit"}


@dataclass(frozen=True, slots=True)
class Log:
    """One log, in order of time.

    Attributes
    ----------
    data : DataFrame
        time_s, displacement_mm, moment_upper, moment_lower (float64, NaN where not measured) and status
        (categorical of ForceStatus values). Moments are in N m where the header names a unit of moment and no
        calibration was given, else in the log's own unit. Date-times count in seconds from the log's first
        row. A gap holds a row of NaN at its middle.
    faults : tuple of str
        What was found wrong and what was done about it; rows are counted from 0 after the headers, lines of
        the file from 1.
    notes : tuple of str
        How times and units were read, and that the log ends before the blade does: nothing wrong, but to be
        known.
    """

    data: pd.DataFrame
    faults: tuple[str, ...]
    notes: tuple[str, ...] = ()


def read_log(
    paths: Path | str | Sequence[Path | str],
    columns: LogColumns,
    *,
    rate_hz: float | None = None,
    calibration: CellCalibration | None = None,
) -> Log:
    """Read a log of displacement and two bending moments.

    Parameters
    ----------
    paths : path-like, or sequence of them
        Text tables (separator, decimal comma, encoding, preamble and rows of units are found) or .tdms
        files. Several files are one log: in order of time where their times tell, else as given.
    columns : LogColumns
        What the columns are called; a text table without names calls them 1, 2, 3 and so on. A unit in
        brackets after a name is that of the column, where its header names none.
    rate_hz : float or None
        Rows a second, where the log holds sample numbers or no times.
    calibration : CellCalibration or None
        Constants other than 1 and -1, and constants found from files, are N m per unit of the log as it is
        written: moments of that cell are then not converted to N m.

    Returns
    -------
    Log

    Raises
    ------
    DataError
        A file cannot be read, a column is missing or can mean two, times can mean two things, or fewer than
        two rows hold a time.
    MissingExtraError
        A .tdms file without the package nptdms.
    """
    files = [Path(p) for p in ([paths] if isinstance(paths, str | Path) else dict.fromkeys(paths))]
    if not files:
        raise DataError("no file of the log was found")
    table, rows, faults, notes = _collected(files, columns, rate_hz, calibration or CellCalibration())
    if int(np.isfinite(table["time_s"]).sum()) < 2:
        raise DataError(
            f"column {columns.time_s!r} holds fewer than two times; expected one a row, in seconds",
            path=files[0],
        )
    data, more = check_columns(table, rows)
    if len(data) < 2 or not np.ptp(data["time_s"].to_numpy()) > _SHORTEST_S:
        raise DataError(
            f"all times in column {columns.time_s!r} are the same; expected times that rise. Where the clock "
            'stood still, count the rows: rate_hz, and columns.time_s = ""',
            path=files[0],
        )
    for key, name in (("moment_upper", columns.moment_upper_Nm), ("moment_lower", columns.moment_lower_Nm)):
        if not np.isfinite(data[key].to_numpy()).any():
            raise DataError(
                f"column {name!r} holds no number that can be a reading; expected one a row. Check which "
                f"column is meant: [loadcells.columns] {key}_Nm",
                path=files[0],
            )
    early = stops_early(data["time_s"].to_numpy(), data["displacement_mm"].to_numpy())
    return Log(data, (*faults, *more), tuple(dict.fromkeys([*notes, *early])))


def _collected(
    files: Sequence[Path], columns: LogColumns, rate_hz: float | None, calibration: CellCalibration
) -> tuple[dict[str, NDArray[np.float64]], tuple[FileRows, ...], list[str], list[str]]:
    """Columns of all files, where their rows stand, faults, and notes."""
    wanted = wanted_columns(columns, rate_hz=rate_hz)
    raws: list[RawLog] = []
    for path in files:
        raws.append(_read(path, wanted))
        if sum(raw.rows.count for raw in raws) > LOG_ROWS:
            raise DataError(
                f"makes more than {LOG_ROWS // 1_000_000} million rows with the files before it; expected at "
                "most as many in one log. Thin it out",
                path=path,
            )
    clock = read_clock(raws, rate_hz=rate_hz)
    faults: list[str] = []
    notes = list(clock.notes)
    parts = []
    for raw, seconds in zip(raws, clock.seconds, strict=True):
        prefix = "" if len(raws) == 1 else f"{raw.path.name}: "
        faults += [f"{prefix}{text}" for text in raw.faults]
        parts.append({"time_s": seconds, **_converted(raw, calibration, notes)})
    table, rows, more = _joined(parts, [raw.rows for raw in raws])
    return table, rows, [*faults, *clock.faults, *more], notes


def _read(path: Path, wanted: Wanted) -> RawLog:
    return read_tdms(path, wanted) if path.suffix.lower() == ".tdms" else read_text(path, wanted)


def _converted(raw: RawLog, calibration: CellCalibration, notes: list[str]) -> dict[str, NDArray[np.float64]]:
    """Values in mm and, where the unit is known and no calibration is given, in N m."""
    values = {}
    for key in VALUE_COLUMNS:
        column, unit, kind = raw.values[key], raw.units.get(key, ""), KINDS[key]
        factor = unit_factor(unit, kind) if unit else None
        given = abs(getattr(calibration, _SCALES[key])) if key in _SCALES else 1.0
        fitted = key in _SCALES and bool(calibration.files or calibration.staircases)
        named = repr(raw.headers[key])
        if unit and factor is None:
            if not fitted and given == 1.0:  # else the calibration is of this unit, whatever it is
                own = "the log's own unit" if kind == "moment" else OURS[kind]
                notes.append(f"{key}: the unit {unit!r} of {named} is not known: read as {own}")
        elif factor is not None and given != 1.0:
            if not 0.5 <= given / factor <= 2.0:
                notes.append(
                    f"{key}: {named} is in {unit} ({factor:g} N m), but {_SCALES[key]} is {given:g}: the "
                    "calibration is used"
                )
        elif factor is not None and factor != 1.0 and not fitted:
            notes.append(f"{key}: {named} is in {unit}, times {factor:g} for {OURS[kind]}")
            column = column * factor
        values[key] = column
    return values


def _joined(
    parts: Sequence[dict[str, NDArray[np.float64]]], rows: Sequence[FileRows]
) -> tuple[dict[str, NDArray[np.float64]], tuple[FileRows, ...], list[str]]:
    """One table of all files: the times of each put in order before one follows the other."""
    if len(parts) == 1:
        return dict(parts[0]), tuple(rows), []
    faults: list[str] = []
    ordered, places = [], []
    for part, where in zip(parts, rows, strict=True):
        own = Rows(dict(part), np.arange(where.count), partial(name_rows, files=[where]))
        order_times(own)
        faults += [f"{where.name}: {text}" for text in own.faults]
        ordered.append(own.columns)
        places.append(where.take(own.places))
    columns, where_all, more = join_files(ordered, places)
    return columns, where_all, [*faults, *more]
