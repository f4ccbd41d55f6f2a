"""Compiled parts of the search for dyed layers: runs of dyed pixels, their chains, the names of chains."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.tracers.view import Floats, Image

Ints = NDArray[np.int64]
MOST_RUNS = 32  # of dyed pixels in one column


@njit(cache=True, nogil=True)
def dyed_runs(share: Image, top: Ints, bottom: Ints, runs: Floats) -> Ints:
    """Runs of pixels that are more than half dyed, in each column between two rows.

    Parameters
    ----------
    share : (rows, columns) float32
        How much of each pixel is dyed.
    top, bottom : (columns,) int64
        First row that is looked at, and the one after the last.
    runs : (columns, MOST_RUNS, 3) float64
        Written: rows of the upper and lower half-level crossings, mean share between them.

    Returns
    -------
    (columns,) int64, number of runs
    """
    rows, columns = share.shape
    count = np.zeros(columns, np.int64)
    for k in range(columns):
        row, end = max(top[k], 0), min(bottom[k], rows)
        while row < end:
            if share[row, k] <= 0.5:
                row += 1
                continue
            outside = share[row - 1, k] if row > max(top[k], 0) else 0.0
            upper = row - (share[row, k] - 0.5) / (share[row, k] - min(outside, 0.5))
            total, start = 0.0, row
            while row < end and share[row, k] > 0.5:
                total += share[row, k]
                row += 1
            outside = share[row, k] if row < end else 0.0
            last = share[row - 1, k]
            lower = row - 1 + (last - 0.5) / (last - min(outside, 0.5))
            if count[k] < MOST_RUNS:
                runs[k, count[k], 0] = upper
                runs[k, count[k], 1] = lower
                runs[k, count[k], 2] = total / (row - start)
                count[k] += 1
    return count


@njit(cache=True, nogil=True)
def chains(column: Ints, middle: Floats, width: Floats, limit: Floats, most_gap: int) -> Ints:
    """Number of the chain that each run belongs to; runs are in order of their columns.

    Two runs are linked where each is the other's nearest, not steeper than ``limit[0]`` rows a column,
    with widths that differ by less than ``limit[1]``; over at most ``most_gap`` columns without one.
    """
    count = len(column)
    following = np.full(count, -1, np.int64)
    back = np.full(count, -1, np.int64)
    ahead = np.empty(count, np.int64)
    behind = np.empty(count, np.int64)
    for gap in range(1, most_gap + 2):
        for i in range(count):
            ahead[i] = -1 if following[i] >= 0 else _nearest(i, gap, back, column, middle, width, limit)
            behind[i] = -1 if back[i] >= 0 else _nearest(i, -gap, following, column, middle, width, limit)
        for i in range(count):
            j = ahead[i]
            if j >= 0 and behind[j] == i:
                following[i], back[j] = j, i
    chain = np.full(count, -1, np.int64)
    number = 0
    for i in range(count):
        if chain[i] < 0:
            j = i
            while j >= 0:
                chain[j] = number
                j = following[j]
            number += 1
    return chain


@njit(cache=True, nogil=True)
def _nearest(i, gap, taken, column, middle, width, limit):  # type: ignore[no-untyped-def]
    """Run ``gap`` columns from run i that is free and nearest to it in height; -1: none."""
    sign = 1 if gap > 0 else -1
    best, at = limit[0] * abs(gap), -1
    j = i + sign
    while 0 <= j < len(column) and abs(column[j] - column[i]) <= abs(gap):
        if column[j] - column[i] == gap and taken[j] < 0:
            off = abs(middle[j] - middle[i])
            if off <= best and abs(width[j] - width[i]) < limit[1]:
                best, at = off, j
        j += sign
    return at


@njit(cache=True, nogil=True)
def names(cost: Floats, chain: Ints, change: float) -> Ints:
    """Which name each run bears: least total cost (runs, names) along its chain, a change costs ``change``.

    Runs of one chain are successive. Dynamic programming (Viterbi 1967).
    """
    count, layers = cost.shape
    total = np.empty((count, layers))
    before = np.zeros((count, layers), np.int64)
    for i in range(count):
        fresh = i == 0 or chain[i] != chain[i - 1]
        cheapest = 0
        if not fresh:
            for name in range(1, layers):
                if total[i - 1, name] < total[i - 1, cheapest]:
                    cheapest = name
        for name in range(layers):
            total[i, name] = cost[i, name]
            if not fresh:
                stay, leave = total[i - 1, name], total[i - 1, cheapest] + change
                before[i, name] = name if stay <= leave else cheapest
                total[i, name] += min(stay, leave)
    out = np.empty(count, np.int64)
    for i in range(count - 1, -1, -1):
        if i == count - 1 or chain[i + 1] != chain[i]:
            best = 0
            for name in range(1, layers):
                if total[i, name] < total[i, best]:
                    best = name
            out[i] = best
        else:
            out[i] = before[i + 1, out[i + 1]]
    return out
