"""Faults of a log's values: dropouts, spikes, readings at the end of the range, cells that stand still."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_LARGEST = 1e30  # no reading is larger
_DROPOUT_NOISE = 20.0  # a dropout leaves its neighbours by this many times the noise ...
_DROPOUT_RANGE = 0.5  # ... and by this part of the column's range
_DROPOUT_ALONE = 4.0
_SPIKE_ROWS = 8  # a spike lasts fewer rows
_SPIKE_NOISE = 20.0  # it rises and falls by this many times the usual step within one row ...
_SPIKE_RANGE = 0.1  # ... and by this part of the column's range ...
_SPIKE_RETURN = 0.25  # ... and comes back to where it started to within this part of its height
_LEAST_SATURATED = 5  # rows
_SIDE = 5  # rows looked at beside equal ones
_LEAST_STUCK = 20  # rows
_COARSE = 0.5  # share of equal neighbours above which steps are too coarse to tell a stop from chance
_SAMPLES = 100_000


def not_finite(values: Floats) -> Mask:
    """Rows that hold no number, or one too large to be a reading: (N,) bool."""
    return ~(np.abs(values) < _LARGEST)


def dropouts(values: Floats, scale: "Scale | None" = None) -> Mask:
    """Rows (at most two together) far from the median of the five rows around them: (N,) bool.

    Far is more than half the range of the column (1st to 99th percentile), 20 times its noise, and 4 times
    what the middle one of the five is off.

    Parameters
    ----------
    values : (N,) float
        The column; NaN where it holds no number.
    scale : Scale or None
        That of the column, where it is known.
    """
    found = np.zeros(values.size, dtype=bool)
    scale = scale or scale_of(values)
    if scale is None:
        return found
    limit = max(_DROPOUT_RANGE * scale.range, _DROPOUT_NOISE * scale.noise, 1e-12 * scale.largest)
    steep = np.flatnonzero(np.abs(np.diff(values)) > limit)
    missing = np.flatnonzero(~np.isfinite(values))
    # A dropout of two rows has its steep steps two rows apart: look at both sides of each. Beside a row
    # without a value there is no step to see.
    near = np.concatenate([steep - 1, steep, steep + 1, steep + 2])
    if missing.size < 0.01 * values.size:
        near = np.concatenate([near, missing - 1, missing + 1])
    near = np.unique(near)
    near = near[(near >= 0) & (near < values.size)]
    around = near[:, None] + np.arange(-2, 3)
    around = np.where(around < 0, -around, around)
    around = np.where(around >= values.size, 2 * (values.size - 1) - around, around)
    usable = np.isfinite(values[around]).sum(axis=1) > 1
    near, window = near[usable], values[around][usable]
    if near.size:
        off = np.abs(window - np.nanmedian(window, axis=1)[:, None])
        # A pulse that has risen over several rows is a load: the rows beside a dropout are like one another.
        found[near] = off[:, 2] > np.maximum(limit, _DROPOUT_ALONE * np.nanmedian(off, axis=1))
    return found


def spikes(values: Floats, scale: "Scale | None" = None) -> Mask:
    """Rows of short excursions that the rows around them do not explain: (N,) bool.

    A spike rises within one row and falls within one row, fewer than eight rows later, back to where it
    started. A drop of the force as a band gives way falls as steeply but stays: it is none. Where the steps
    of the reading are as coarse as the excursion nothing is told. Parameters as of :func:`dropouts`.
    """
    found = np.zeros(values.size, dtype=bool)
    scale = scale or scale_of(values)
    if scale is None:
        return found
    rows = np.flatnonzero(np.isfinite(values))
    v = values if rows.size == values.size else values[rows]
    steps = np.diff(v)
    limit = max(_SPIKE_RANGE * scale.range, _SPIKE_NOISE * scale.noise)
    edges = np.flatnonzero(np.abs(steps) > limit)
    last = -1
    for i, j in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        # The rows i + 1 to j stand between two steep steps.
        if i <= last or j - i >= _SPIKE_ROWS or steps[i] * steps[j] > 0:
            continue
        before, after = v[max(i - 4, 0) : i + 1], v[j + 1 : j + 6]
        height = float(np.median(v[i + 1 : j + 1])) - 0.5 * float(np.median(before) + np.median(after))
        back = abs(float(np.median(after) - np.median(before)))
        level = max(float(np.ptp(before)), float(np.ptp(after)))
        if abs(height) > limit and back < _SPIKE_RETURN * abs(height) and level < 0.5 * abs(height):
            found[rows[i + 1 : j + 1]] = True
            last = j
    return found


def saturated(values: Floats, onset: int) -> Mask:
    """Rows from ``onset`` on that repeat the column's extreme longer than chance allows: (N,) bool.

    The top of a smooth curve, which repeats its highest reading as well, is none.
    """
    found = np.zeros(values.size, dtype=bool)
    moving = values[onset:]
    finite = moving[np.isfinite(moving)]
    if finite.size < 2 * _LEAST_SATURATED or finite.min() == finite.max():
        return found
    low, high = float(finite.min()), float(finite.max())
    for extreme in (low, high):
        starts, ends = _runs(moving == extreme)
        long = ends - starts >= _LEAST_SATURATED
        if not long.any():
            continue
        least = _longest_by_chance(finite[(finite != low) & (finite != high)], finite.size)
        steps = np.abs(np.diff(finite))
        finest = float(steps[steps > 0].min())
        for start, end in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
            if end - start >= least and not _turns(moving, start, end, finest):
                found[onset + start : onset + end] = True
    return found


def _turns(values: Floats, start: int, end: int, finest: float) -> bool:
    """Whether a smooth curve turns at these equal rows: it leaves them by its finest step and ever more."""
    sides = [values[max(start - _SIDE, 0) : start][::-1], values[end : end + _SIDE]]
    away = [np.abs(side - values[start]) for side in sides if side.size]
    return all(a[0] <= 1.5 * finest and bool((np.diff(a) >= 0).all()) for a in away)


def stuck(values: Floats, other: Floats, onset: int) -> Mask:
    """Rows from ``onset`` on in which one cell stands still longer than chance allows as the other moves.

    Parameters
    ----------
    values, other : (N,) float
        The cell, and the other one.
    onset : int
        First row of motion.

    Returns
    -------
    (N,) bool
    """
    found = np.zeros(values.size, dtype=bool)
    moving, beside = values[onset:], other[onset:]
    if moving.size < _LEAST_STUCK:
        return found
    equal = np.concatenate([[False], np.diff(moving) == 0])
    starts, ends = _runs(equal)
    long = ends - starts + 1 >= _LEAST_STUCK
    if not long.any():
        return found
    inside = np.zeros(moving.size, dtype=bool)
    for start, end in zip(starts[long], ends[long], strict=True):
        inside[start - 1 : end] = True
    free = moving[~inside]
    least = max(_LEAST_STUCK, _longest_by_chance(free[np.isfinite(free)], moving.size))
    for start, end in zip(starts[long] - 1, ends[long], strict=True):
        part = beside[start:end]
        part = part[np.isfinite(part)]
        if end - start >= least and part.size > 1 and float(np.mean(np.diff(part) != 0)) > _COARSE:
            found[onset + start : onset + end] = True
    return found


def _longest_by_chance(values: Floats, count: int) -> float:
    """Rows that a run of one value is not longer than by chance, among values that repeat as these do.

    Coarse steps repeat by chance: a run of n has probability equal ** (n - 1) at each of the ``count`` rows.
    """
    equal = float(np.mean(np.diff(values) == 0)) if values.size > 1 else 0.0
    if equal > _COARSE:
        return np.inf
    return 1 + (np.log(count) + 7.0) / -np.log(equal) if equal > 0 else 0.0


def _runs(inside: Mask) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First rows, and rows after the last, of each stretch that is true."""
    edges = np.flatnonzero(np.diff(inside, prepend=False, append=False))
    return edges[::2], edges[1::2]


@dataclass(frozen=True, slots=True)
class Scale:
    """A column's range from 1st to 99th percentile, its usual step (as noise), and its largest number."""

    range: float
    noise: float
    largest: float


def scale_of(values: Floats) -> Scale | None:
    """The scale of a column from a sample of its rows; None with fewer than ten numbers."""
    every = max(values.size // _SAMPLES, 1)
    some = values[::every]
    some = some[np.isfinite(some)]
    if some.size < 10:
        return None
    low, high = np.percentile(some, [1.0, 99.0])
    steps = np.abs(values[1::every] - values[:-1:every])
    steps = steps[steps > 0]  # a coarse reading stands still between its steps
    noise = 1.4826 * float(np.median(steps)) if steps.size else 0.0
    return Scale(float(high - low), noise, float(np.abs(some).max()))
