"""Compiled reading of subsets from spline coefficients: at pixels with slopes, and at warped places."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.interpolate import PAD

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]

OK, MASKED, EDGE = int(Status.OK), int(Status.MASKED), int(Status.EDGE)
LEAST_SHARE = 0.4
"""A subset needs this share of its pixels valid."""

FAST = {"contract", "reassoc", "nsz", "arcp"}
_BARE = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
compiled = njit(nogil=True, fastmath=FAST, **_BARE)  # type: ignore[call-overload]
"""Parts of a kernel: without wrappers for Python and kept in the kernel's own cache, they compile faster."""


class Pictures(NamedTuple):
    """Spline coefficients (H + 2 PAD, W + 2 PAD) of both pictures; usable pixels (H, W) of the reference."""

    reference: Singles
    current: Singles
    mask: NDArray[np.uint8]


class Tables(NamedTuple):
    """What depends on the recipe: side, node taps, basis polynomials, shape function (terms, side^2)."""

    side: int
    taps: Floats
    poly: Singles
    mono: Floats


class Work(NamedTuple):
    """Scratch of one chunk: every array is overwritten for each point."""

    f: Floats
    g: Floats
    r: Floats
    weight: Floats
    jac: Floats
    hessian: Floats
    inverse: Floats
    rhs: Floats
    step: Floats
    rows: NDArray[np.float32]
    column: NDArray[np.float32]
    slopes: Floats
    line: NDArray[np.float32]
    place: Floats
    floor: NDArray[np.int64]
    smooth: Floats


def make_work(side: int, terms: int) -> Work:
    """Scratch for subsets of ``side`` px and shape functions of ``terms`` coefficients an axis."""
    n = side * side
    wide = (side + 7) // 8 * 8
    return Work(
        f=np.zeros(n),
        g=np.zeros(n),
        r=np.zeros(n),
        weight=np.zeros(n),
        jac=np.zeros((2 * terms, n)),
        hessian=np.zeros((2 * terms, 2 * terms)),
        inverse=np.zeros((2 * terms, 2 * terms)),
        rhs=np.zeros(2 * terms),
        step=np.zeros(2 * terms),
        rows=np.zeros((4, side + 2 * PAD, wide), np.float32),
        column=np.zeros((5, wide), np.float32),
        slopes=np.zeros(3),
        line=np.zeros((14, 2 * wide), np.float32),
        place=np.zeros((2, 2 * wide)),
        floor=np.zeros((2, 2 * wide), np.int64),
        smooth=np.zeros((2, n)),
    )


# Value, slope x, slope y, plain slope x, plain slope y: which row pass and which taps down the column.
COLUMN_OF = (0, 2, 1, 3, 0)
TAP_OF = (0, 1, 2, 0, 3)


@compiled
def _correlate_line(line: Singles, taps: Floats, out: Singles) -> None:
    """Taps along a row of coefficients."""
    count = out.size
    out[:] = 0.0
    for k in range(taps.size):
        c, t = line[k : k + count], np.float32(taps[k])
        if t != 0.0:
            for i in range(count):
                out[i] += t * c[i]


@compiled
def _correlate_columns(rows: Singles, first: int, taps: Floats, out: Singles) -> None:
    """Taps down the columns of filtered rows."""
    count = out.size
    out[:] = 0.0
    for k in range(taps.size):
        c, t = rows[first + k, :count], np.float32(taps[k])
        if t != 0.0:
            for i in range(count):
                out[i] += t * c[i]


@compiled
def gather(pictures: Pictures, tables: Tables, cx: int, cy: int, work: Work) -> int:
    """Values, slopes and weights of the subset's pixels; returns EDGE, MASKED or OK."""
    reference, mask, side = pictures.reference, pictures.mask, tables.side
    taps, mono = tables.taps, tables.mono
    half = side // 2
    reach = taps.shape[1] // 2
    terms = mono.shape[0]
    work.weight[:] = 0.0
    work.jac[:] = 0.0
    work.f[:] = 0.0
    y0, y1 = max(cy - half, 0), min(cy + half, mask.shape[0] - 1)
    x0, x1 = max(cx - half, 0), min(cx + half, mask.shape[1] - 1)
    if (y1 - y0 + 1) * (x1 - x0 + 1) < LEAST_SHARE * side * side or y1 < y0 or x1 < x0:
        return EDGE
    width = x1 - x0 + 1
    padded = (width + 7) // 8 * 8
    for k in range(y1 - y0 + 1 + 2 * reach):
        line = reference[y0 - reach + k + PAD, x0 - reach + PAD :]
        for m in range(4):
            _correlate_line(line, taps[m], work.rows[m, k, :padded])
    used = 0
    work.slopes[:] = 0.0
    for y in range(y0, y1 + 1):
        for m in range(5):
            _correlate_columns(work.rows[COLUMN_OF[m]], y - y0, taps[TAP_OF[m]], work.column[m, :padded])
        for i in range(width):
            x = x0 + i
            if mask[y, x] == 0:
                continue
            used += 1
            n = (y - cy + half) * side + x - cx + half
            fx, fy = work.column[1, i], work.column[2, i]
            work.f[n] = work.column[0, i]
            work.weight[n] = 1.0
            work.slopes[0] += fx * fx + fy * fy
            gx, gy = work.column[3, i], work.column[4, i]
            work.slopes[1] += fx * gx + fy * gy
            work.slopes[2] += gx * gx + gy * gy
            for m in range(terms):
                work.jac[m, n] = fx * mono[m, n]
                work.jac[terms + m, n] = fy * mono[m, n]
    return OK if used >= LEAST_SHARE * side * side else MASKED


@compiled
def _blend_quintic(current: Singles, row: int, column: int, first: int, count: int, line: Singles) -> None:
    """Interpolate pixels that read consecutive columns of the same rows: contiguous, to vectorise."""
    a0, a1, a2 = (
        line[0, first : first + count],
        line[1, first : first + count],
        line[2, first : first + count],
    )
    a3, a4, a5 = (
        line[3, first : first + count],
        line[4, first : first + count],
        line[5, first : first + count],
    )
    out = line[12, first : first + count]
    out[:] = np.float32(0.0)
    for k in range(6):
        c = current[row + k, column : column + count + 5]
        b = line[6 + k, first : first + count]
        for i in range(count):
            out[i] += b[i] * (
                a0[i] * c[i]
                + a1[i] * c[i + 1]
                + a2[i] * c[i + 2]
                + a3[i] * c[i + 3]
                + a4[i] * c[i + 4]
                + a5[i] * c[i + 5]
            )


@compiled
def _blend_cubic(current: Singles, row: int, column: int, first: int, count: int, line: Singles) -> None:
    """The same with the four nodes of a cubic spline."""
    a0, a1 = line[0, first : first + count], line[1, first : first + count]
    a2, a3 = line[2, first : first + count], line[3, first : first + count]
    out = line[12, first : first + count]
    out[:] = np.float32(0.0)
    for k in range(4):
        c = current[row + k, column : column + count + 3]
        b = line[6 + k, first : first + count]
        for i in range(count):
            out[i] += b[i] * (a0[i] * c[i] + a1[i] * c[i + 1] + a2[i] * c[i + 2] + a3[i] * c[i + 3])


@compiled
def _weigh(place: Floats, floor: Ints, poly: Singles, weights: Singles, t: Singles) -> None:
    """Basis functions of every pixel of a row, by Horner's rule; pixels innermost, to vectorise."""
    for i in range(t.size):
        t[i] = place[i] - floor[i]
    quintic = poly.shape[0] == 6
    for k in range(poly.shape[0]):
        out = weights[k]
        a0, a1, a2, a3 = poly[k, 0], poly[k, 1], poly[k, 2], poly[k, 3]
        if quintic:
            a4, a5 = poly[k, 4], poly[k, 5]
            for i in range(t.size):
                x = t[i]
                out[i] = a0 + x * (a1 + x * (a2 + x * (a3 + x * (a4 + x * a5))))
        else:
            for i in range(t.size):
                x = t[i]
                out[i] = a0 + x * (a1 + x * (a2 + x * a3))


@compiled
def _warp(extent: tuple[int, ...], tables: Tables, cx: int, cy: int, row: int, p: Floats, work: Work) -> int:
    """Places of one row's pixels in the current picture; pixels that leave it lose their weight."""
    side, mono = tables.side, tables.mono
    terms = mono.shape[0]
    half = side // 2
    last = (extent[1] - 1.0, extent[0] - 1.0)
    lost = 0
    start = row * side
    for axis in range(2):
        place = work.place[axis]
        for i in range(side):
            place[i] = float(cx - half + i) if axis == 0 else float(cy - half + row)
        for m in range(terms):
            factor, shape = p[axis * terms + m], mono[m, start : start + side]
            for i in range(side):
                place[i] += factor * shape[i]
        low, high = place[0], place[0]
        for i in range(side):
            low, high = min(low, place[i]), max(high, place[i])
        if not (low >= 0.0 and high <= last[axis]):
            for i in range(side):
                if not 0.0 <= place[i] <= last[axis]:
                    lost += work.weight[start + i] != 0.0
                    work.weight[start + i] = 0.0
                    place[i] = min(max(place[i], 0.0), last[axis]) if place[i] == place[i] else 0.0
        floor = work.floor[axis]
        for i in range(side):
            floor[i] = int(place[i])
    return lost


@compiled
def sample(pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats, work: Work) -> int:
    """Current picture at the warped subset, row by row; returns how many pixels left the picture."""
    lost = 0
    current, extent, side, poly = pictures.current, pictures.mask.shape, tables.side, tables.poly
    nodes = poly.shape[0]
    shift = PAD - (nodes // 2 - 1)
    xs, ys, line = work.floor[0], work.floor[1], work.line
    for row in range(side):
        lost += _warp(extent, tables, cx, cy, row, p, work)
        _weigh(work.place[0], xs, poly, line[0:6], line[13])
        _weigh(work.place[1], ys, poly, line[6:12], line[13])
        first = np.int64(0)  # a plain 0 would compile what it is handed to once more
        while first < side:
            last = first + 1
            while last < side and xs[last] - last == xs[first] - first and ys[last] == ys[first]:
                last += 1
            # Whole vectors of 8: what is written beyond the run is overwritten by the next one.
            count = (last - first + 7) // 8 * 8
            if nodes == 6:
                _blend_quintic(current, ys[first] + shift, xs[first] + shift, first, count, line)
            else:
                _blend_cubic(current, ys[first] + shift, xs[first] + shift, first, count, line)
            first = last
        for i in range(side):
            work.g[row * side + i] = line[12, i]
    return lost
