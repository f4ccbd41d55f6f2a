"""How values that follow each other scatter about their trend: what their standard deviations must cover."""

import numpy as np

from ploughval.tracers.view import Floats, Mask

_SIDE = 4  # values to one side that foresee one
_LEAST = 3
_WINDOW = 4  # values to either side whose scatter counts
_CLEAR = 2.0  # times the stated std: less may be chance
_VAGUE = 1 / 3  # share of the increments about one that one line does not describe


def widened(place: Floats, value: Floats, std: Floats, vague: Mask) -> Floats:
    """Standard deviations that cover how values scatter about their trend where one line is not enough.

    A value is foreseen by the straight line through the four before it, and by that through the four after
    it; the nearer counts, so that a jump is no scatter. Where these differences, of a value and its
    neighbours without the largest, exceed twice what is stated, the std grows in proportion (type A of the
    GUM; Eq. (16b) of theory-bands.md). Sharp bands state their std rightly and may follow each other quickly:
    only where a third of the increments about one are vague is it widened.

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


def _unforeseen(place: Floats, value: Floats) -> Floats:
    """Distance of each value (K,) from the nearer of the lines through those before and after it."""
    off = np.full(len(value), np.nan)
    for k in range(len(value)):
        for side in (slice(max(k - _SIDE, 0), k), slice(k + 1, k + 1 + _SIDE)):
            x, y = place[side] - place[k], value[side]
            if len(y) >= _LEAST:
                off[k] = np.fmin(off[k], abs(value[k] - np.polyval(np.polyfit(x, y, 1), 0.0)))
    return off
