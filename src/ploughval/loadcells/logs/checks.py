"""Faults of a log: each is found, named with its rows, and handled by one stated rule."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import ForceStatus
from ploughval.loadcells.logs.names import VALUE_COLUMNS
from ploughval.loadcells.logs.rows import FileRows, name_rows
from ploughval.loadcells.logs.time_faults import Rows, gap_places, order_times, take_out_jumps_on
from ploughval.loadcells.logs.value_faults import dropouts, not_finite, saturated, scale_of, spikes, stuck
from ploughval.loadcells.motion import find_motion

STATUSES = tuple(ForceStatus)
_CODE = {status: np.int8(k) for k, status in enumerate(STATUSES)}


def check_columns(
    columns: dict[str, NDArray[np.float64]], files: Sequence[FileRows] = ()
) -> tuple[pd.DataFrame, list[str]]:
    """Put a raw log in order and mark what cannot be used.

    Rules: rows without a time are dropped; rows whose time alone leaps are dropped; jumps of the clock are
    taken out; rows out of order are sorted; of rows with the same time the first is kept; values that are
    not finite, drop out for one or two rows, spike for a few, stand at the end of the range, or stand still
    as the other cell moves, become NaN with a status; a gap gets one row of NaN.

    Parameters
    ----------
    columns : dict of (N,) float
        time_s, displacement_mm, moment_upper, moment_lower, rows as in the files; they are written to.
    files : sequence of FileRows
        Where the rows stand, for messages.

    Returns
    -------
    table : DataFrame
        The same columns with strictly increasing times, and status (categorical of ForceStatus values).
    faults : list of str
    """
    rows = Rows(columns, np.arange(columns["time_s"].size), partial(name_rows, files=files))
    order_times(rows)
    take_out_jumps_on(rows)
    status = np.full(rows.time.size, _CODE[ForceStatus.OK], dtype=np.int8)
    for name in VALUE_COLUMNS:
        _mark(rows, status, name, not_finite(rows.columns[name]), ForceStatus.NOT_FINITE, "is not finite")
    for name in VALUE_COLUMNS:
        scale = scale_of(rows.columns[name])
        _mark(rows, status, name, dropouts(rows.columns[name], scale), ForceStatus.DROPOUT, "drops out")
        _mark(rows, status, name, spikes(rows.columns[name], scale), ForceStatus.SPIKE, "spikes")
    _mark_standing(rows, status)
    columns, status = _fill_gaps(rows, status)
    return pd.DataFrame({**columns, "status": status_column(status)}, copy=False), rows.faults


def status_column(codes: NDArray[np.int8]) -> "pd.Categorical[str]":
    """Places in STATUSES as a column of their names."""
    return pd.Categorical.from_codes(codes, categories=pd.Index([str(s) for s in STATUSES]))


def _mark(
    rows: Rows,
    status: NDArray[np.int8],
    name: str,
    bad: NDArray[np.bool_],
    reason: ForceStatus,
    what: str,
) -> None:
    """Leave values empty, with a status and a fault that says so."""
    if bad.any():
        rows.faults.append(f"{name} {what} in {rows.say(bad)}: left empty")
        rows.columns[name][bad] = np.nan
        status[bad] = _CODE[reason]


def _mark_standing(rows: Rows, status: NDArray[np.int8]) -> None:
    """Readings of the cells that stand at their extreme, or still, as the blade moves."""
    motion = find_motion(rows.columns["displacement_mm"])
    if motion is None:
        return
    upper, lower = (rows.columns[name].copy() for name in VALUE_COLUMNS[1:])
    for name, values, other in zip(VALUE_COLUMNS[1:], (upper, lower), (lower, upper), strict=True):
        ends = saturated(values, motion.onset)
        if ends.any():
            extreme = f"stands at its extreme {values[ends][0]:g}"
            _mark(rows, status, name, ends, ForceStatus.SATURATED, extreme)
        still = stuck(values, other, motion.onset) & ~ends
        if still.any():
            level = f"stands still at {values[still][0]:g} as the other cell moves"
            _mark(rows, status, name, still, ForceStatus.STUCK, level)


def _fill_gaps(
    rows: Rows, status: NDArray[np.int8]
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.int8]]:
    """One row of NaN at the middle of every gap, with the status that says so."""
    time = rows.time
    places = gap_places(time)
    if places.size == 0:
        return rows.columns, status
    longest = float(np.diff(time)[places - 1].max())
    rows.faults.append(
        f"{places.size} gap{'s' if places.size > 1 else ''} in time before {rows.say(places)}, "
        f"the longest {longest:g} s: one empty row each"
    )
    filled = {name: np.insert(values, places, np.nan) for name, values in rows.columns.items()}
    filled["time_s"] = np.insert(time, places, 0.5 * (time[places] + time[places - 1]))
    return filled, np.insert(status, places, _CODE[ForceStatus.GAP])
