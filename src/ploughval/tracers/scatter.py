"""How values that follow each other scatter about their trend: what their standard deviations must cover."""

import numpy as np
from numpy.typing import NDArray

from ploughval.tracers.view import Floats, Mask

Ints = NDArray[np.int64]

_SIDE = 4  # values to one side that foresee one
_LEAST = 3
_WINDOW = 4  # values to either side whose scatter counts
_ENOUGH = 10  # values that tell how they scatter
_CLEAR = 2.0  # times the stated std: less may be chance
_VAGUE = 1 / 3  # share of the increments about one that one line does not describe


def widened(place: Floats, value: Floats, std: Floats, vague: Mask) -> Floats:
    """Standard deviations that cover how values scatter about their trend where one line is not enough.

    A value is foreseen by the straight line through the four before it, and by that through the four after
    it; the nearer counts, so that a jump is no scatter. Where these differences, of a value and its
    neighbours without the largest, exceed twice what is stated, the std grows in proportion (type A of the
    GUM; docs/theory-bands.md, Eq. (18)). Sharp bands state their std rightly and may follow each other
    quickly: only where a third of the increments about one are vague is it widened.

    Parameters
    ----------
    place, value, std : (K,) float
        In order of place; NaN values are passed over and keep their std.
    vague : (K,) bool
        Increments that one line does not describe.

    Returns
    -------
    (K,) float
    """
    known = np.flatnonzero(np.isfinite(value) & np.isfinite(std))
    out = std.copy()
    if known.size < 2 * _LEAST:
        return out
    off = _unforeseen(place[known], value[known])
    for n, k in enumerate(known):
        near = slice(max(n - _WINDOW, 0), n + _WINDOW + 1)
        there = np.sort(off[near][np.isfinite(off[near])])[:-1]
        if there.size >= _LEAST and np.mean(vague[known][near]) >= _VAGUE:
            ratio = np.sqrt(np.mean(there**2)) / max(float(np.median(std[known][near])), 1e-12)
            out[k] *= ratio if ratio > _CLEAR else 1.0
    return out


def common_scale(place: Floats, value: Floats, std: Floats, band: Ints) -> float:
    """Factor by which the scatter of a series exceeds its stated standard deviations, at least 1.

    Each value is compared with the straight line through the two before it and the two after it, if all five
    belong to one band; the median of the ratios is what most values scatter by.

    Parameters
    ----------
    place, value, std : (K,) float
        In order of place; NaN values are passed over.
    band : (K,) int
        Band of each value.
    """
    known = np.flatnonzero(np.isfinite(value) & np.isfinite(std) & (std > 0))
    x, y, s, b = place[known], value[known], std[known], band[known]
    ratios = []
    for k in range(2, known.size - 2):
        beside = [k - 2, k - 1, k + 1, k + 2]
        if (b[beside] != b[k]).any():
            continue
        arm = x[beside] - x[k]
        # weights of the line's value at the middle one
        weight = np.linalg.pinv(np.column_stack([np.ones(4), arm]))[0]
        expected = np.hypot(s[k], np.linalg.norm(weight * s[beside]))
        ratios.append(abs(y[k] - weight @ y[beside]) / expected)
    return max(1.4826 * float(np.median(ratios)), 1.0) if len(ratios) >= _ENOUGH else 1.0


def _unforeseen(place: Floats, value: Floats) -> Floats:
    """Distance of each value (K,) from the nearer of the lines through those before and after it."""
    off = np.full(len(value), np.nan)
    for k in range(len(value)):
        for side in (slice(max(k - _SIDE, 0), k), slice(k + 1, k + 1 + _SIDE)):
            x, y = place[side] - place[k], value[side]
            if len(y) >= _LEAST:
                off[k] = np.fmin(off[k], abs(value[k] - np.polyval(np.polyfit(x, y, 1), 0.0)))
    return off
