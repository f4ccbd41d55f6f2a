"""Compiled search for the line that divides a subset into two motions: where a shear band crosses it."""

import numpy as np
from numba import njit

from ploughval.piv.compiled import KERNEL, Floats, Ints, Singles, compiled
from ploughval.piv.kernel import centre, difference
from ploughval.piv.sampling import (
    OK,
    Pictures,
    Tables,
    Work,
    gather,
    sample,
)

PARTS = "20d684b34a1d"
"""Digest of the files this kernel is made of: compiled code is kept by this file alone, so it must change
with them (a test says what it is)."""
DIRECTIONS = 24
"""Directions of a band that are tried."""


@compiled
def _errors(
    pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats, work: Work, out: Singles
) -> bool:
    """Squared residuals of a subset that moves by p, free of gain and offset; -1 beyond the picture."""
    n = tables.mono.shape[1]
    if gather(pictures, tables, cx, cy, work) != OK:
        return False
    sample(pictures, tables, cx, cy, p, work)
    work.level[1] = 0.0
    count, norm = centre(work, n)
    work.level[0] = work.level[1]
    if not norm > 0.0:
        return False
    difference(work, n, count, norm)
    for i in range(n):
        out[i] = work.g[i] * work.g[i] if work.weight[i] > 0.0 else np.float32(-1.0)
    return True


@compiled
def _best_cut(side: int, scratch: Singles, line: Floats) -> None:
    """Line with the least sum of the first motion's residuals on its near side and the second's beyond it."""
    half, wide = side // 2, (side + 15) // 16 * 16
    reach = np.int64(1.5 * half + 2)
    first, second = 0.0, 0.0
    for n in range(side * wide):
        if scratch[0, n] >= 0.0 and scratch[1, n] >= 0.0:
            first += scratch[0, n]
            second += scratch[1, n]
    best, whole = 0.0, min(first, second)
    for turn in range(DIRECTIONS):
        angle = 2.0 * np.pi * turn / DIRECTIONS
        nx, ny = np.cos(angle), np.sin(angle)
        sums = scratch[2, : 2 * reach + 1]
        sums[:] = np.float32(0.0)
        for row in range(side):
            for i in range(side):
                n = row * wide + i
                if scratch[0, n] >= 0.0 and scratch[1, n] >= 0.0:
                    place = np.int64(np.floor((i - half) * nx + (row - half) * ny + 0.5)) + reach
                    sums[min(max(place, np.int64(0)), 2 * reach)] += scratch[0, n] - scratch[1, n]
        gained = 0.0
        for m in range(2 * reach, 0, -1):
            gained += sums[m]
            if whole - first + gained > best:
                best = whole - first + gained
                line[0], line[1] = angle, m - reach - 0.5


@njit(cache=True, **KERNEL)
def divide_points(
    pictures: Pictures,
    tables: Tables,
    centres: Ints,
    sides: Floats,
    lines: Floats,
    work: Work,
    scratch: Singles,
) -> None:
    """Find the line that best divides each subset into a part that moves one way and one that moves another.

    Parameters
    ----------
    pictures, tables : Pictures, Tables
        As of ``kernel.match_points``.
    centres : (N, 2) int64, px
        Centres of the subsets.
    sides : (N, 2, 2 terms) float64
        Both motions, as parameters of the shape function.
    lines : (N, 2) float64
        Set to the direction t (rad) of the normal that points to the second motion's side, and the line's
        distance c from the centre along it (px); NaN: none.
    work, scratch : Work, (3, side * wide) float32
        Scratch of this thread.
    """
    side = tables.side
    for k in range(centres.shape[0]):
        lines[k] = np.nan
        cx, cy = centres[k, 0], centres[k, 1]
        known = _errors(pictures, tables, cx, cy, sides[k, 0], work, scratch[0])
        if not known or not _errors(pictures, tables, cx, cy, sides[k, 1], work, scratch[1]):
            continue
        _best_cut(side, scratch, lines[k])
