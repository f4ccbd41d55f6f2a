"""A noisy line as straight pieces: where it is kinked, and the line through each point's own piece.

Kinks are found by least squares with a price for every piece (optimal partitioning, Jackson et al. 2005;
docs/theory-geometry.md, Eq. (4)); a point is then read from the straight line through its neighbours in its
own piece.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.tracers.view import Floats

_SHORTEST = 6  # points of a piece
_LONGEST = 300
_PRICE = 100.0  # of a piece, in variances of a point
_HALF = 24  # points on either side of the one that is read
_MEETING = 12  # points from a cut to the crossing of the lines on its two sides
_NOTCH = 40  # points of a piece that may be such a notch
_NOTCH_PIECES = 3
_STEP = 4.0  # deviations of a point, by which it stands off
_ALIKE = 5  # successive points that share their error, by that averaging and the grains


@njit(cache=True, nogil=True)
def pieces(value: Floats, price: float, shortest: int, longest: int) -> NDArray[np.int64]:
    """Number of the straight piece that each value belongs to, for least sum of squares and prices: (N,)."""
    count = len(value)
    one, two, cross = np.zeros(count + 1), np.zeros(count + 1), np.zeros(count + 1)
    for i in range(count):
        one[i + 1] = one[i] + value[i]
        two[i + 1] = two[i] + value[i] ** 2
        cross[i + 1] = cross[i] + i * value[i]
    best = np.full(count + 1, np.inf)
    start = np.zeros(count + 1, np.int64)
    best[0] = 0.0
    for end in range(min(shortest, count), count + 1):
        for first in range(max(end - longest, 0), end - min(shortest, count) + 1):
            if not np.isfinite(best[first]):
                continue
            n = float(end - first)
            mean = (one[end] - one[first]) / n
            slope_sum = cross[end] - cross[first] - mean * n * (first + end - 1) / 2
            rest = two[end] - two[first] - n * mean**2
            rest -= 12 * slope_sum**2 / max(n * (n * n - 1), 1.0)
            total = best[first] + max(rest, 0.0) + price
            if total < best[end]:
                best[end] = total
                start[end] = first
    number = np.zeros(count, np.int64)
    end, piece = count, 0
    while end > 0:
        first = start[end]
        for i in range(first, end):
            number[i] = piece
        end, piece = first, piece + 1
    return number


@njit(cache=True, nogil=True)
def read_along(value: Floats, piece: NDArray[np.int64], half: int, out: Floats) -> None:
    """Straight line through each point's neighbours in its own piece: written into out (N, 4).

    The line's value at the point; the scatter about it; the variance of the value where that of a point is 1;
    the line's slope.
    """
    count = len(value)
    first = 0
    while first < count:
        last = first
        while last + 1 < count and piece[last + 1] == piece[first]:
            last += 1
        for i in range(first, last + 1):
            low, high = max(i - half, first), min(i + half, last)
            low = max(min(low, high - half), first)
            high = min(max(high, low + half), last)
            n = high - low + 1
            middle = (low + high) / 2
            mean = product = 0.0
            for j in range(low, high + 1):
                mean += value[j] / n
                product += (j - middle) * value[j]
            spread = max(n * (n * n - 1) / 12.0, 1e-9)
            slope = product / spread
            square = 0.0
            for j in range(low, high + 1):
                square += (value[j] - mean - slope * (j - middle)) ** 2
            out[i, 0] = mean + slope * (i - middle)
            out[i, 1] = np.sqrt(square / max(n - 2, 1))
            out[i, 2] = 1.0 / n + (i - middle) ** 2 / spread
            out[i, 3] = slope
        first = last + 1


def straightened(value: Floats) -> tuple[Floats, Floats, Floats]:
    """Values read from the straight pieces of a noisy line, their std, and the scatter about them, (N,) each.

    The std is that of docs/theory-geometry.md, Eq. (5), without its last term.

    Parameters
    ----------
    value : (N,) float
        Heights at equal distances.
    """
    jumps = np.abs(value[2 * _ALIKE :] - 2 * value[_ALIKE:-_ALIKE] + value[: -2 * _ALIKE])
    usual = max(float(np.median(jumps)) * 1.4826 / np.sqrt(6.0), 0.02)
    piece = pieces(value, _PRICE * usual**2, _SHORTEST, _LONGEST)
    out = np.empty((len(value), 4))
    read_along(value, piece, _HALF, out)
    line, scatter, leverage, slope = out.T
    _meet(line, slope, piece)
    std = np.maximum(scatter, np.median(scatter)) * np.sqrt(np.minimum(_ALIKE * leverage, 1.0))
    _bridge_notches(line, std, piece, usual)
    return line, std, scatter


def _meet(line: Floats, slope: Floats, piece: NDArray[np.int64]) -> None:
    """Let the lines of two pieces meet at their crossing, where that lies close to the cut between them."""
    straight, size = line.copy(), len(line)
    for cut in (np.flatnonzero(np.diff(piece)) + 1).tolist():
        turn = slope[cut] - slope[cut - 1]
        if turn == 0:
            continue
        crossing = cut - (straight[cut] - straight[cut - 1] - slope[cut - 1]) / turn
        if not cut - _MEETING <= crossing <= cut + _MEETING:
            continue
        over = np.arange(cut, min(int(np.ceil(crossing)), size))
        line[over] = straight[cut - 1] + slope[cut - 1] * (over - cut + 1)
        under = np.arange(max(int(np.ceil(crossing)), 0), cut)
        line[under] = straight[cut] + slope[cut] * (under - cut)


def _bridge_notches(line: Floats, std: Floats, piece: NDArray[np.int64], usual: float) -> None:
    """Put short pieces that stand off the same way at both ends onto the line between their neighbours.

    Sand does not stand in steps: there the edge of something in the sand was read, such as of a dark
    layer before a dark background. The std is then the step itself.
    """
    cuts = np.flatnonzero(np.diff(piece)) + 1
    done = 0
    for k, first in enumerate(cuts.tolist()):
        for last in cuts[k + 1 : k + 1 + _NOTCH_PIECES].tolist():
            if first < done or last - first > _NOTCH:
                continue
            fore, after = line[first] - line[first - 1], line[last - 1] - line[last]
            step = min(abs(fore), abs(after))
            if step > _STEP * usual and fore * after > 0:
                ends = [line[first - 1], line[last]]
                line[first:last] = np.interp(np.arange(first, last), [first - 1, last], ends)
                std[first:last] = np.maximum(std[first:last], step)
                done = last
