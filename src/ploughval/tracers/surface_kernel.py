"""Compiled parts of the surface's search: costs of a border, the likeliest path, profiles across it."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.tracers.view import Bytes, Floats, Image

Ints = NDArray[np.int64]
Words = NDArray[np.uint16]
_JUMP = 1e3  # price of a step that the slope forbids: paid only where nothing else is left


@njit(cache=True, nogil=True)
def border_costs(
    band: tuple[Image, Bytes, Words], known: Ints, tables: Image, place: Ints, first: Ints, cost: Floats
) -> None:
    """Cost of the border standing above each row of a strip: air above it, skin below, then sand.

    docs/theory-geometry.md, Eq. (3).

    Parameters
    ----------
    band : (rows, w) float32, uint8, uint16
        Grey, level and change, as in :class:`ploughval.tracers.appearance.Band`.
    known : (w,) int64
        Rows of each column, counted in the band, whose look at rest counts as air.
    tables : (3 + 8, 256) float32
        Air, skin, sand and the densities of a change, one after the other.
    place : (4,) int64
        First column of the first point, columns a point, rows of skin, rows of the band that may be sand.
    first : (points,) int64
        Uppermost row of each strip, in the band.
    cost : (points, strip + 1) float64
        Written.
    """
    _, level, change = band
    column0, step, skin_rows, limit = place
    same = tables[3:].ravel()
    strip = cost.shape[1] - 1
    heap = np.zeros((3, strip + skin_rows + 1))
    for k in range(len(first)):
        for r in range(strip + skin_rows):
            row = first[k] + r
            air = skin = sand = 0.0
            if row < limit:
                for column in range(column0 + k * step, column0 + (k + 1) * step):
                    grey = level[row, column]
                    density = tables[0, grey]
                    if row < known[column]:
                        density += same[change[row, column]]
                    air += np.log(density)
                    skin += tables[1, grey]
                    sand += tables[2, grey]
            heap[0, r + 1] = heap[0, r] + air / step
            heap[1, r + 1] = heap[1, r] + skin / step
            heap[2, r + 1] = heap[2, r] + sand / step
        last = heap[2, strip + skin_rows]
        for r in range(strip + 1):
            below = r + skin_rows
            cost[k, r] = -(heap[0, r] + heap[1, below] - heap[1, r] + last - heap[2, below])


@njit(cache=True, nogil=True)
def likeliest_path(cost: Floats, first: Ints, reach: int, price: float) -> Ints:
    """Row of least total cost in each column: a rise costs in proportion, up to the steepest slope.

    Dynamic programming (Viterbi 1967).

    Parameters
    ----------
    cost : (columns, rows) float64
        Cost of each row of each column's strip.
    first : (columns,) int64
        Row at which each strip begins.
    reach : int
        Most rows from one column to the next.
    price : float
        Of a row.

    Returns
    -------
    (columns,) int64, rows
    """
    columns, rows = cost.shape
    before = np.zeros((columns, rows), np.int32)
    total = cost[0].copy()
    now = np.empty(rows)
    for k in range(1, columns):
        cheapest = int(np.argmin(total))
        for r in range(rows):
            best, at = total[cheapest] + _JUMP, cheapest
            middle = first[k] + r - first[k - 1]
            for other in range(max(middle - reach, 0), min(middle + reach + 1, rows)):
                value = total[other] + price * abs(other - middle)
                if value < best:
                    best, at = value, other
            now[r] = best + cost[k, r]
            before[k, r] = at
        total, now = now, total
    path = np.empty(columns, np.int64)
    at = int(np.argmin(total))
    for k in range(columns - 1, -1, -1):
        path[k] = first[k] + at
        at = int(before[k, at])
    return path


@njit(cache=True, nogil=True)
def profiles(grey: Image, column: Floats, row: Floats, slope: Floats, half: int, reach: int) -> Floats:
    """Grey across a line, averaged along it: (points, 2 reach + 1) float64.

    Bilinear; along the line's slope over 2 half + 1 columns; pixels beyond the picture are those at its edge.
    """
    height, width = grey.shape
    count = 2 * half + 1
    out = np.zeros((len(column), 2 * reach + 1))
    for k in range(len(column)):
        for along in range(-half, half + 1):
            x = min(max(column[k] + along, 0.0), width - 1.0)
            left = min(int(x), width - 2)
            right_share = x - left
            start = row[k] + slope[k] * along
            for across in range(-reach, reach + 1):
                y = min(max(start + across, 0.0), height - 1.0)
                top = min(int(y), height - 2)
                part = y - top
                upper = grey[top, left] * (1 - right_share) + grey[top, left + 1] * right_share
                lower = grey[top + 1, left] * (1 - right_share) + grey[top + 1, left + 1] * right_share
                out[k, across + reach] += (upper * (1 - part) + lower * part) / count
    return out


@njit(cache=True, nogil=True)
def surroundings(
    band: tuple[Image, Bytes, Words],
    known: Ints,
    tables: Image,
    column: Floats,
    row: Floats,
    size: tuple[int, int, int],
) -> Floats:
    """What lies just above and below each point: (points, 4) float64.

    Mean density of the pixels below as sand, texture there, mean density of the pixels above as air,
    texture there; over windows of half width ``size[0]``, from ``size[1]`` to ``size[2]`` rows away.
    Texture: rms difference of pixels two columns apart, by the root of two. NaN outside the band.
    """
    grey, level, change = band
    half, near, far = size
    same = tables[3:].ravel()
    height, width = grey.shape
    out = np.full((len(column), 4), np.nan)
    for k in range(len(column)):
        left, right = max(int(column[k]) - half, 0), min(int(column[k]) + half + 1, width - 2)
        middle = int(np.rint(row[k]))
        for side in range(2):
            if side == 0:
                first, last = middle + near, min(middle + far, height)
            else:
                first, last = max(middle - far, 0), middle - near
            total = square = density = 0.0
            for r in range(max(first, 0), min(last, height)):
                for c in range(left, right):
                    if side == 0:
                        total += np.exp(tables[2, level[r, c]])
                    square += (grey[r, c + 2] - grey[r, c]) ** 2
                    if side == 1:
                        density += tables[0, level[r, c]]
                        if r < known[c]:
                            density += same[change[r, c]]
            count = max(min(last, height) - max(first, 0), 0) * max(right - left, 0)
            if count > 0 and side == 0:
                out[k, 0], out[k, 1] = total / count, np.sqrt(square / count / 2)
            elif count > 0:
                out[k, 2], out[k, 3] = density / count, np.sqrt(square / count / 2)
    return out
