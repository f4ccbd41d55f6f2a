"""Faults of a log's times: rows without one, rows out of order, doubled times, a clock that jumps, gaps."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Places = NDArray[np.intp]

_GAP_STEPS = 5.5  # a step of time longer than this many usual steps is a gap
_IRREGULAR = 3.0  # ... and than this many times the step that all but 1 % of the steps keep below
_LATE_ROWS = 20  # as many rows behind the clock are a jump of the clock, fewer are rows out of order
_SHUFFLED = 0.1  # share of steps back in time above which rows are shuffled, whatever their runs
_LEAP_STEPS = 50.0  # a row whose time is so many steps ahead, and the next back again, has a wrong time
_COARSE_SHARE = 0.2  # share of doubled times above which the clock is coarser than the rows
_SAMPLES = 100_000  # steps looked at for what is usual
_EPS = 1e-9  # relative; equal steps of decimal numbers differ by rounding


@dataclass(slots=True)
class Rows:
    """A log's columns, the places of its rows in the raw table, and the faults found so far.

    Attributes
    ----------
    columns : dict of (N,) float
        time_s, s, and the values.
    places : (N,) int
    name : callable
        Words for places: :func:`ploughval.loadcells.logs.rows.name_rows`.
    faults : list of str
    """

    columns: dict[str, Floats]
    places: Places
    name: Callable[[Places], str]
    faults: list[str] = field(default_factory=list)

    @property
    def time(self) -> Floats:
        """Times of the rows, s."""
        return self.columns["time_s"]

    def say(self, which: NDArray[np.bool_] | Places) -> str:
        """The rows that are meant, in words."""
        return self.name(self.places[which])

    def keep(self, which: NDArray[np.bool_] | Places) -> None:
        """Keep only these rows, or put them in this order."""
        self.columns = {name: values[which] for name, values in self.columns.items()}
        self.places = self.places[which]


def order_times(rows: Rows) -> None:
    """Make times strictly increasing.

    Rows without a time, and rows whose time alone leaps away and back, are dropped; a clock that was put
    back goes on one step later; other rows out of order are sorted; of rows with one time the first is kept.
    """
    timed = np.isfinite(rows.time)
    if not timed.all():
        rows.faults.append(f"{rows.say(~timed)} without a time: dropped")
        rows.keep(timed)
    if rows.time.size < 2:
        return
    if (np.diff(rows.time) < 0).any():
        _drop_leaps(rows)
        _take_out_jumps_back(rows)
        time = rows.time
        behind = time < np.maximum.accumulate(time)
        if behind.any():
            rows.faults.append(f"{rows.say(behind)} out of order: sorted by time")
            rows.keep(np.argsort(time, kind="stable"))
    _drop_doubles(rows)


def usual_step(time: Floats) -> float:
    """The median step of time that is not zero or back, s; 0 without any."""
    steps = np.diff(time)[:: max(time.size // _SAMPLES, 1)]
    steps = steps[steps > 0]
    return float(np.median(steps)) if steps.size else 0.0


def _drop_leaps(rows: Rows) -> None:
    """Drop rows far ahead of those around them, fewer than a jump has, and lone ones behind."""
    time, step = rows.time, usual_step(rows.time)
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0) + 1
    if step == 0 or back.size > _SHUFFLED * time.size:
        return
    leap = np.zeros(time.size, dtype=bool)
    for k in back.tolist():
        start = max(k - _LATE_ROWS, 0)
        ahead = np.flatnonzero((steps[start : k - 1] > _LEAP_STEPS * step) & (time[start : k - 1] <= time[k]))
        if ahead.size:
            leap[start + int(ahead[-1]) + 1 : k] = True
        elif (
            k + 1 < time.size
            and 1.5 * step < time[k + 1] - time[k - 1] < 2.5 * step
            and time[k - 1] - time[k] > _LATE_ROWS * step
        ):
            leap[k] = True
    # A first row far ahead of all others has none before it to compare with.
    if time[0] > time[1] and time[0] - time[1] > _LEAP_STEPS * step and (steps[1 : _LATE_ROWS + 1] > 0).all():
        leap[0] = bool(time[0] > time[-1])
    if leap.any():
        rows.faults.append(f"time leaps away and back in {rows.say(leap)}: dropped")
        rows.keep(~leap)


def _take_out_jumps_back(rows: Rows) -> None:
    """Later times moved on to go on one step after each place where the clock was put back."""
    time, step = rows.time, usual_step(rows.time)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(time) < 0) + 1])
    if starts.size == 1 or starts.size > max(_SHUFFLED * time.size, 2):
        return
    ends = np.concatenate([starts[1:], [time.size]])
    shifts = np.zeros(starts.size)
    shift, latest = 0.0, -np.inf
    for i, (a, b) in enumerate(zip(starts.tolist(), ends.tolist(), strict=True)):
        first, last = float(time[a]) + shift, float(time[b - 1]) + shift
        late = int(np.searchsorted(time[a:b], latest - shift)) if first < latest else 0
        if late >= _LATE_ROWS and not _belongs_before(rows, starts[:i], ends[:i], (a, a + late), step):
            put_back = latest + step - first
            rows.faults.append(
                f"the clock jumps back by {put_back:.9g} s at {rows.say(np.array([a]))}: later times moved "
                "on by that"
            )
            shift += put_back
            last += put_back
        shifts[i] = shift
        latest = max(latest, last)
    if shifts.any():
        rows.columns["time_s"] = time + np.repeat(shifts, ends - starts)


def _belongs_before(rows: Rows, starts: Places, ends: Places, late: tuple[int, int], step: float) -> bool:
    """Whether late rows fill a hole in the runs of rows before them, or repeat rows that are there."""
    time, (a, b) = rows.time, late
    begin, end = float(time[a]), float(time[b - 1])
    first, last = time[starts], time[ends - 1]
    left = float(last[last < begin].max(initial=-np.inf))
    right = float(first[first > end].min(initial=np.inf))
    for j in np.flatnonzero((first <= end) & (last >= begin)).tolist():
        run = time[starts[j] : ends[j]]
        low, high = int(np.searchsorted(run, begin)), int(np.searchsorted(run, end, side="right"))
        if high > low:
            return _repeats(rows, np.arange(a, min(b, a + 50)), slice(starts[j], ends[j]))
        left, right = max(left, float(run[low - 1])), min(right, float(run[low]))
    near = _GAP_STEPS * step
    return (np.isinf(left) or begin - left <= near) and (np.isinf(right) or right - end <= near)


def _repeats(rows: Rows, late: Places, run: slice) -> bool:
    """Whether rows stand, with the same time and values, in an earlier run."""
    there = rows.time[run]
    at = np.minimum(np.searchsorted(there, rows.time[late]), there.size - 1)
    same = np.ones(late.size, dtype=bool)
    for values in rows.columns.values():
        one, other = values[run][at], values[late]
        same &= (one == other) | (np.isnan(one) & np.isnan(other))
    return bool(same.all())


def _drop_doubles(rows: Rows) -> None:
    double = np.zeros(rows.time.size, dtype=bool)
    double[1:] = np.diff(rows.time) == 0
    if not double.any():
        return
    share = float(double.mean())
    advice = (
        " (the clock is coarser than the rows: count them instead, with rate_hz)"
        if share > _COARSE_SHARE
        else ""
    )
    rows.faults.append(
        f"{rows.say(double)} ({100 * share:.2g} % of all) with the time of the row before: dropped{advice}"
    )
    rows.keep(~double)


def gap_places(time: Floats) -> Places:
    """Rows before which time is missing: (M,) int.

    A step is a gap when it is several times the usual step of the rows around it (so that a log that
    changes its rate has none), and of the whole log (so that irregular sampling has none).
    """
    steps = np.diff(time)
    if steps.size < 3:
        return np.empty(0, dtype=np.intp)
    some = steps[:: max(steps.size // _SAMPLES, 1)]
    usual, most = (float(v) for v in np.percentile(some, [50.0, 99.0]))
    limit = (1 + _EPS) * max(_GAP_STEPS * usual, _IRREGULAR * most if most <= _GAP_STEPS * usual else 0.0)
    long = np.flatnonzero(steps > limit)
    around = np.abs(long[:, None] + np.arange(-3, 4))
    around = np.clip(np.where(around >= steps.size, 2 * (steps.size - 1) - around, around), 0, None)
    local = np.median(steps[around], axis=1) if long.size else np.empty(0)
    return np.asarray(long[steps[long] > _GAP_STEPS * local] + 1, dtype=np.intp)


def take_out_jumps_on(rows: Rows) -> None:
    """Take out the leaps of the clock over which a moving blade did not go on."""
    time, u = rows.time, rows.columns["displacement_mm"]
    step = usual_step(time)
    lost_before = np.zeros(time.size)
    for k in gap_places(time).tolist():
        before, after = slice(max(k - 20, 0), k), slice(k, k + 20)
        if min(k, time.size - k) < 5:
            continue
        speed = min(_speed(time[before], u[before]), _speed(time[after], u[after]), key=abs)
        lost = float(time[k] - time[k - 1]) - step
        scatter = _scatter(u[before]) + _scatter(u[after])
        went_on = abs(u[k] - u[k - 1])
        if abs(speed) * lost > 5 * abs(speed) * step + scatter and went_on < 0.2 * abs(speed) * (lost + step):
            lost_before[k] = lost
            rows.faults.append(
                f"the clock jumps on by {lost:.9g} s at {rows.say(np.array([k]))}: later times moved back "
                "by that"
            )
    if lost_before.any():
        rows.columns["time_s"] = time - np.cumsum(lost_before)


def _speed(time: Floats, u: Floats) -> float:
    good = np.isfinite(u)
    if good.sum() < 3:
        return 0.0
    t = time[good] - time[good].mean()
    return float((t * u[good]).sum() / (t * t).sum())


def _scatter(u: Floats) -> float:
    """Ten standard deviations of the displacement's noise within a short window."""
    steps = np.diff(u[np.isfinite(u)])
    return 10 * float(np.std(steps)) if steps.size else 0.0
