"""Faults of a log: each is found, named with its rows, and handled by one stated rule."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import ForceStatus
from ploughval.loadcells.motion import find_motion

STATUSES = tuple(ForceStatus)
_CODE = {status: np.int8(k) for k, status in enumerate(STATUSES)}
_GAP_STEPS = 5.0  # a step of time longer than this many median steps is a gap
_LATE_ROWS = 20  # as many rows behind the clock are a jump of the clock, fewer are rows out of order
_MOST_JUMPS = 1000
_SPIKE_NOISE = 20.0  # a dropout leaves its neighbours by this many times the noise ...
_SPIKE_RANGE = 0.5  # ... and by this part of the column's range
_LEAST_SATURATED = 5  # rows
_COARSE = (
    0.5  # share of equal neighbours above which steps are too coarse to tell a stop from a turning point
)
_VALUES = ("displacement_mm", "moment_upper", "moment_lower")


def check_table(table: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """Put a raw log in order and mark what cannot be used.

    Rules: rows without a time are dropped; a row whose time alone leaps is dropped; rows out of order are
    sorted; jumps of the clock are taken out; of rows with the same time the first is kept; values that are
    not finite, drop out for one or two rows or stand at the end of the range become NaN with a status; a gap
    gets one row of NaN.

    Parameters
    ----------
    table : DataFrame
        time_s, displacement_mm, moment_upper, moment_lower: float64, rows as in the file.

    Returns
    -------
    table : DataFrame
        The same columns with strictly increasing times, and status (categorical of ForceStatus values).
    faults : list of str
    """
    faults: list[str] = []
    columns = {name: table[name].to_numpy(dtype=np.float64, copy=True) for name in ("time_s", *_VALUES)}
    rows = np.arange(len(table))
    timed = np.isfinite(columns["time_s"])
    if not timed.all():
        faults.append(f"{name_rows(rows[~timed])} without a time: dropped")
        columns, rows = _keep(columns, rows, timed)
    columns, rows = _order(columns, rows, faults)
    status = np.full(len(rows), _CODE[ForceStatus.OK], dtype=np.int8)
    for name in _VALUES:
        bad = ~np.isfinite(columns[name])
        if bad.any():
            columns[name][bad] = np.nan
            faults.append(f"{name} is not finite in {name_rows(rows[bad])}: left empty")
            status[bad] = _CODE[ForceStatus.NOT_FINITE]
    for name in _VALUES:
        out = dropouts(columns[name])
        if out.any():
            faults.append(f"{name} drops out in {name_rows(rows[out])}: left empty")
        _mark(columns[name], out, ForceStatus.DROPOUT, status)
    motion = find_motion(columns["displacement_mm"])
    onset = len(rows) if motion is None else motion.onset
    for name in _VALUES[1:]:
        stuck = saturated(columns[name], onset)
        if stuck.any():
            extreme = columns[name][stuck][0]
            faults.append(f"{name} stands at its extreme {extreme:g} in {name_rows(rows[stuck])}: left empty")
        _mark(columns[name], stuck, ForceStatus.SATURATED, status)
    columns, status = _fill_gaps(columns, rows, status, faults)
    return pd.DataFrame({**columns, "status": status_column(status)}), faults


def status_column(codes: NDArray[np.int8]) -> "pd.Categorical[str]":
    """Places in STATUSES as a column of their names."""
    return pd.Categorical.from_codes(codes, categories=pd.Index([str(s) for s in STATUSES]))


def name_rows(rows: NDArray[np.integer]) -> str:
    """Rows in words: the first few, and how many more.

    >>> name_rows(np.array([4, 7])), name_rows(np.arange(10, 90))
    ('rows 4, 7', 'rows 10, 11, 12, 13, 14 and 75 more')
    """
    shown = ", ".join(str(int(k)) for k in rows[:5])
    more = f" and {len(rows) - 5} more" if len(rows) > 5 else ""
    return f"row{'s' if len(rows) > 1 else ''} {shown}{more}"


def dropouts(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Rows (at most two together) far from the median of the five rows around them: (N,) bool."""
    found = np.zeros(values.size, dtype=bool)
    finite = values[np.isfinite(values)]
    if finite.size < 10:
        return found
    low, high = np.percentile(finite[:: max(finite.size // 100_000, 1)], [1.0, 99.0])
    steps = np.abs(np.diff(values))
    noise = 1.4826 * float(np.nanmedian(steps))
    limit = max(_SPIKE_RANGE * (high - low), _SPIKE_NOISE * noise, 1e-12 * float(np.abs(finite).max()))
    steep = np.flatnonzero(steps > limit)
    # A dropout of two rows has its steep steps two rows apart: look at both sides of each.
    near = np.unique(np.concatenate([steep - 1, steep, steep + 1, steep + 2]))
    near = near[(near >= 0) & (near < values.size)]
    around = near[:, None] + np.arange(-2, 3)
    around = np.where(around < 0, -around, around)
    around = np.where(around >= values.size, 2 * (values.size - 1) - around, around)
    window = values[around]
    window = window[np.isfinite(window).any(axis=1)]
    near = near[np.isfinite(values[around]).any(axis=1)]
    middle = np.nanmedian(window, axis=1) if near.size else np.empty(0)
    found[near] = np.abs(values[near] - middle) > limit
    return found


def saturated(values: NDArray[np.float64], onset: int) -> NDArray[np.bool_]:
    """Rows from ``onset`` on that repeat the column's extreme longer than chance allows: (N,) bool."""
    found = np.zeros(values.size, dtype=bool)
    moving = values[onset:]
    finite = moving[np.isfinite(moving)]
    if finite.size < 2 * _LEAST_SATURATED or finite.min() == finite.max():
        return found
    for extreme in (float(finite.min()), float(finite.max())):
        at = moving == extreme
        edges = np.flatnonzero(np.diff(np.concatenate([[False], at, [False]]).astype(np.int8)))
        starts, ends = edges[::2], edges[1::2]
        rest = finite[finite != extreme]
        equal = float(np.mean(np.diff(rest) == 0)) if rest.size > 1 else 0.0
        if equal > _COARSE:
            continue
        # Coarse steps repeat by chance: a run of n has probability equal ** (n - 1) at each row.
        chance = 1 + (np.log(finite.size) + 7.0) / -np.log(equal) if equal > 0 else 0.0
        for start, end in zip(starts, ends, strict=True):
            if end - start >= max(_LEAST_SATURATED, chance):
                found[onset + start : onset + end] = True
    return found


def _keep(
    columns: dict[str, NDArray[np.float64]],
    rows: NDArray[np.intp],
    which: NDArray[np.bool_] | NDArray[np.intp],
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.intp]]:
    return {name: values[which] for name, values in columns.items()}, rows[which]


def _mark(
    values: NDArray[np.float64],
    bad: NDArray[np.bool_],
    reason: ForceStatus,
    status: NDArray[np.int8],
) -> None:
    values[bad] = np.nan
    status[bad] = _CODE[reason]


def _order(
    columns: dict[str, NDArray[np.float64]], rows: NDArray[np.intp], faults: list[str]
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.intp]]:
    """Strictly increasing times: leaps dropped, clock jumps taken out, the rest sorted, doubles dropped."""
    time = columns["time_s"]
    steps = np.diff(time)
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    leap = np.zeros(time.size, dtype=bool)
    leap[1:-1] = (steps[:-1] > 10 * step) & (steps[1:] < 0) & (time[2:] >= time[:-2])
    if leap.any():
        faults.append(f"time leaps forward and back in {name_rows(rows[leap])}: dropped")
        columns, rows = _keep(columns, rows, ~leap)
    columns["time_s"] = _without_backward_jumps(columns["time_s"], rows, step, faults)
    behind = columns["time_s"] < np.maximum.accumulate(columns["time_s"])
    if behind.any():
        faults.append(f"{name_rows(rows[behind])} out of order: sorted by time")
        columns, rows = _keep(columns, rows, np.argsort(columns["time_s"], kind="stable"))
    double = np.zeros(len(rows), dtype=bool)
    double[1:] = np.diff(columns["time_s"]) == 0
    if double.any():
        share = 100 * double.mean()
        faults.append(
            f"{name_rows(rows[double])} ({share:.2g} % of all) with the time of the row before: dropped"
        )
        columns, rows = _keep(columns, rows, ~double)
    columns["time_s"] = _without_forward_jumps(columns, rows, step, faults)
    return columns, rows


def _without_backward_jumps(
    time: NDArray[np.float64], rows: NDArray[np.intp], step: float, faults: list[str]
) -> NDArray[np.float64]:
    """Times that go on one step after each place where the clock was put back."""
    time = time.copy()
    for _ in range(_MOST_JUMPS):
        before = np.maximum.accumulate(time)
        behind = np.concatenate([[False], time[1:] < before[:-1], [False]])
        edges = np.flatnonzero(np.diff(behind.astype(np.int8))) + 1
        long = np.flatnonzero(np.diff(edges)[::2] >= _LATE_ROWS)
        if long.size == 0:
            break
        k = int(edges[2 * long[0]])
        shift = float(before[k - 1] + step - time[k])
        time[k:] += shift
        faults.append(f"the clock jumps back by {shift:g} s at row {rows[k]}: later times moved on by that")
    return time


def _without_forward_jumps(
    columns: dict[str, NDArray[np.float64]], rows: NDArray[np.intp], step: float, faults: list[str]
) -> NDArray[np.float64]:
    """Times without the leaps of the clock over which a moving blade did not go on."""
    time, u = columns["time_s"].copy(), columns["displacement_mm"]
    places = np.flatnonzero(np.diff(time) > _GAP_STEPS * step) + 1
    for k in places[:_MOST_JUMPS]:
        before, after = slice(max(k - 20, 0), k), slice(k, k + 20)
        if min(k, time.size - k) < 5:
            continue
        speed = _speed(time[before], u[before])
        speed = speed if abs(speed) < abs(_speed(time[after], u[after])) else _speed(time[after], u[after])
        lost = time[k] - time[k - 1] - step
        if abs(speed) * lost > 5 * abs(speed) * step + _scatter(u[before]) + _scatter(u[after]) and abs(
            u[k] - u[k - 1]
        ) < 0.2 * abs(speed) * (lost + step):
            time[k:] -= lost
            faults.append(
                f"the clock jumps on by {lost:g} s at row {rows[k]}: later times moved back by that"
            )
    return time


def _speed(time: NDArray[np.float64], u: NDArray[np.float64]) -> float:
    good = np.isfinite(u)
    if good.sum() < 3:
        return 0.0
    t = time[good] - time[good].mean()
    return float((t * u[good]).sum() / (t * t).sum())


def _scatter(u: NDArray[np.float64]) -> float:
    """Ten standard deviations of the displacement's noise within a short window."""
    steps = np.diff(u[np.isfinite(u)])
    return 10 * float(np.std(steps)) if steps.size else 0.0


def _fill_gaps(
    columns: dict[str, NDArray[np.float64]],
    rows: NDArray[np.intp],
    status: NDArray[np.int8],
    faults: list[str],
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.int8]]:
    """One row of NaN at the middle of every gap, with the status that says so."""
    time = columns["time_s"]
    steps = np.diff(time)
    if steps.size == 0:
        return columns, status
    places = np.flatnonzero(steps > _GAP_STEPS * float(np.median(steps))) + 1
    if places.size == 0:
        return columns, status
    longest = float(steps[places - 1].max())
    faults.append(
        f"{places.size} gap{'s' if places.size > 1 else ''} in time before {name_rows(rows[places])}, "
        f"the longest {longest:g} s: one empty row each"
    )
    filled = {name: np.insert(values, places, np.nan) for name, values in columns.items()}
    filled["time_s"] = np.insert(time, places, 0.5 * (time[places] + time[places - 1]))
    return filled, np.insert(status, places, _CODE[ForceStatus.GAP])
