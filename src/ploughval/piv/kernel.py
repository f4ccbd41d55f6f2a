"""Compiled inverse-compositional Gauss-Newton matching of subsets (Baker & Matthews 2004).

docs/theory-correlation.md, Eqs (1) to (3).
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.algebra import dot, invert, total
from ploughval.piv.compiled import KERNEL, Floats, Ints, Singles, compiled
from ploughval.piv.sampling import (
    EDGE,
    LEAST_SHARE,
    MASKED,
    OK,
    Pictures,
    Tables,
    Work,
    gather,
    sample,
)

FLAT, NOT_CONVERGED = int(Status.FLAT), int(Status.NOT_CONVERGED)
PARTS = "29cf287c0060"
"""Digest of the files this kernel is made of: compiled code is kept by this file alone, so it must change
with them (a test says what it is)."""
LEAST_PART = 0.15
"""A subset that is cut needs this share of its pixels."""
STEP_PX = 5e-4
"""Gauss-Newton has converged when no corner of the subset moves by more than this."""
STEP_SHARE = 0.01
"""Or by more than this share of the standard deviation that the residuals give the centre."""
LEAST_SLOPE = 1e-4
"""Share of the squared slopes that gain and offset must leave."""
ITERATIONS = 30
STATS = 13
"""Columns of stats: zncc, residual variance, variance factors in x and y, pixels, iterations, variance of the
grey values, mean square of a slope, its product with the plain slope over that (freed from noise), that
product (not freed), what residuals answer to in x and y over the squared slopes (freed), and which
description was matched (:class:`subsets.Description`)."""


class Results(NamedTuple):
    """Stats (N, STATS) and status (N,) of a chunk."""

    stats: Floats
    status: NDArray[np.int8]


@compiled
def centre(work: Work, n: int) -> tuple[float, float]:
    """Take the mean off the reference; returns the number of pixels and the norm."""
    f, w = work.f[:n], work.weight[:n]
    base = f[n // 2]
    for i in range(n):
        f[i] = w[i] * (f[i] - base)
    count = total(w, n)
    mean = np.float32(total(f, n) / max(count, 1.0))
    for i in range(n):
        f[i] -= w[i] * mean
    work.level[1] += float(base) + float(mean)
    return count, np.sqrt(dot(f, f, n))


@compiled
def drop(work: Work, n: int) -> None:
    """Clear the slopes of pixels that lost their weight."""
    for i in range(n):
        work.slope_x[i] *= work.weight[i]
        work.slope_y[i] *= work.weight[i]


@compiled
def _moments(tables: Tables, work: Work, n: int) -> None:
    """Sums of products of slopes times monomials, and of slopes times monomials and values."""
    sx, sy, f = work.slope_x[:n], work.slope_y[:n], work.f[:n]
    for m in range(tables.mono.shape[0]):
        shape = tables.mono[m, :n]
        xx, xy, yy = np.float32(0.0), np.float32(0.0), np.float32(0.0)
        for i in range(n):
            a = shape[i] * sx[i]
            xx += a * sx[i]
            xy += a * sy[i]
            yy += shape[i] * sy[i] * sy[i]
        work.moments[0, m], work.moments[1, m], work.moments[2, m] = xx, xy, yy
    for m in range(tables.terms):
        shape = tables.mono[m, :n]
        x, y, xf, yf = np.float32(0.0), np.float32(0.0), np.float32(0.0), np.float32(0.0)
        for i in range(n):
            a, b = shape[i] * sx[i], shape[i] * sy[i]
            x += a
            y += b
            xf += a * f[i]
            yf += b * f[i]
        work.sums[0, m], work.sums[0, tables.terms + m] = x, y
        work.sums[1, m], work.sums[1, tables.terms + m] = xf, yf


@compiled
def _prepare(tables: Tables, work: Work) -> tuple[float, float]:
    """Centre the reference and invert its Hessian, free of gain and offset; returns pixels and norm, or 0."""
    n, terms = tables.mono.shape[1], tables.terms
    count, norm = centre(work, n)
    level = 1e-6 * (abs(work.level[1]) + 1e-30)
    if norm * norm <= count * level * level:
        return count, 0.0
    _moments(tables, work, n)
    size = 2 * terms
    for k in range(size):
        for m in range(k, size):
            kind = (k >= terms) + (m >= terms)
            whole = work.moments[kind, tables.pairs[k % terms, m % terms]]
            value = whole - work.sums[1, k] * work.sums[1, m] / (norm * norm)
            value -= work.sums[0, k] * work.sums[0, m] / count
            work.hessian[k, m] = value
            work.hessian[m, k] = value
            # Even light has slopes, but none that gain and offset do not explain: rounding is left.
            if k == m and not value > LEAST_SLOPE * whole:
                return count, 0.0
    return count, norm if invert(work.hessian, work.inverse) else 0.0


@compiled
def _compose(p: Floats, step: Floats, terms: int, half: int) -> float:
    """Update p <- p o step^-1, second order in the place and first in the step; returns the farthest move."""
    far = 0.0
    for axis in range(2):
        o = axis * terms
        if terms == 1:
            p[o] -= step[o]
            continue
        # Displacement gradient along the step: du/dx dx + du/dy dy, cut at the order of the shape function.
        d, e = step[:terms], step[terms:]
        ux, uy = p[o + 1] / half, p[o + 2] / half
        if terms == 3:
            for m in range(3):
                p[o + m] -= step[o + m] + ux * d[m] + uy * e[m]
            continue
        xx, xy, yy = 2.0 * p[o + 3] / half, p[o + 4] / half, 2.0 * p[o + 5] / half
        p[o] -= step[o] + ux * d[0] + uy * e[0]
        p[o + 1] -= step[o + 1] + ux * d[1] + uy * e[1] + xx * d[0] + xy * e[0]
        p[o + 2] -= step[o + 2] + ux * d[2] + uy * e[2] + xy * d[0] + yy * e[0]
        p[o + 3] -= step[o + 3] + ux * d[3] + uy * e[3] + xx * d[1] + xy * e[1]
        p[o + 4] -= step[o + 4] + ux * d[4] + uy * e[4] + xx * d[2] + xy * (d[1] + e[2]) + yy * e[1]
        p[o + 5] -= step[o + 5] + ux * d[5] + uy * e[5] + xy * d[2] + yy * e[2]
    for axis in range(2):
        total = 0.0
        for m in range(terms):
            total += abs(step[axis * terms + m])
        far = max(far, total)
    return far


@compiled
def difference(work: Work, n: int, count: float, norm: float) -> float:
    """Turn g into the residuals of docs/theory-correlation.md, Eq. (1); returns the correlation."""
    f, g, w = work.f[:n], work.g[:n], work.weight[:n]
    base = np.float32(work.level[0])
    for i in range(n):
        g[i] = w[i] * (g[i] - base)
    mean = np.float32(total(g, n) / max(count, 1.0))
    square, along = np.float32(0.0), np.float32(0.0)
    for i in range(n):
        g[i] -= w[i] * mean
        square += g[i] * g[i]
        along += f[i] * g[i]
    work.level[0] += float(mean)
    flat = 1e-6 * (abs(work.level[0]) + 1e-30)
    if not float(square) > count * flat * flat:
        for i in range(n):
            g[i] = f[i]
        return 0.0
    scale = np.float32(norm / np.sqrt(square))
    for i in range(n):
        g[i] = f[i] - scale * g[i]
    return min(float(along) * float(scale) / (norm * norm), 1.0)


@compiled
def _advance(tables: Tables, work: Work, ratio: float) -> None:
    """The step that the residuals call for (docs/theory-correlation.md, Eq. (2))."""
    n, terms = tables.mono.shape[1], tables.terms
    sx, sy, r = work.slope_x[:n], work.slope_y[:n], work.g[:n]
    for m in range(terms):
        shape = tables.mono[m, :n]
        x, y = np.float32(0.0), np.float32(0.0)
        for i in range(n):
            a = shape[i] * r[i]
            x += a * sx[i]
            y += a * sy[i]
        work.rhs[m], work.rhs[terms + m] = -x, -y
    for k in range(work.rhs.size):
        whole = 0.0
        for m in range(work.rhs.size):
            whole += work.inverse[k, m] * work.rhs[m]
        work.step[k] = whole / ratio


@compiled
def _turned(step: Floats, last: Floats) -> float:
    """Factor on the steps to come: less than 1 where a step turns back by more than half the last one.

    Noise of the current picture bends what the residuals answer to; plain steps then go to and fro.
    """
    along, square = 0.0, 0.0
    for m in range(step.size):
        along += step[m] * last[m]
        square += last[m] * last[m]
    return 0.6 if along < -0.5 * square else 1.0


@compiled
def answers(work: Work, count: float, slope_noise: float, stats: Floats) -> None:
    """What stats say of the slopes, from their sums and moments.

    Slopes are filtered: their product with the plain ones, less that of the noise in both, is what the
    residuals answer to (docs/theory-correlation.md, Eq. (3)); over both axes it scales the steps.
    """
    squares = max(work.slopes[0], 1e-300)
    raw = work.slopes[1] / squares
    stats[7] = work.slopes[0] / (2.0 * max(count, 1.0))
    stats[8] = min(max(raw - slope_noise * count / squares, 0.25), 4.0)
    stats[9] = work.slopes[1] / (2.0 * max(count, 1.0))
    for axis in range(2):
        stats[10 + axis] = raw - 0.5 * slope_noise * count / max(work.moments[2 * axis, 0], 1e-300)


@compiled
def match_subset(
    pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats, stats: Floats, limits: Floats, work: Work
) -> int:
    """Gauss-Newton from p on the pixels gathered in work; p and stats are overwritten; returns a status."""
    terms, half = tables.terms, tables.side // 2
    u0, v0 = p[0], p[terms]
    work.level[1] = 0.0
    wanted, norm = _prepare(tables, work)
    work.level[0] = work.level[1]
    count = wanted
    limit, n = limits[0], tables.mono.shape[1]
    if norm == 0.0:
        return FLAT
    answers(work, count, limits[1], stats)
    ratio = stats[8]
    work.last[:] = 0.0
    damping = 1.0
    for iteration in range(ITERATIONS):
        if sample(pictures, tables, cx, cy, p, work) > 0:
            drop(work, n)
            count, norm = _prepare(tables, work)
            if count < LEAST_SHARE * wanted:
                return EDGE
            if norm == 0.0:
                return FLAT
        zncc = difference(work, n, count, norm)
        _advance(tables, work, ratio)
        stats[0] = zncc
        stats[1] = dot(work.g, work.g, n) / max(count - 2.0 - 2.0 * terms, 1.0)
        stats[2], stats[3] = work.inverse[0, 0], work.inverse[terms, terms]
        stats[4], stats[5], stats[6] = count, iteration + 1.0, norm * norm / count
        damping *= _turned(work.step, work.last)
        for m in range(2 * terms):
            work.last[m] = work.step[m]
            work.step[m] *= damping
        far = _compose(p, work.step, terms, half)
        if not (abs(p[0] - u0) <= limit and abs(p[terms] - v0) <= limit):
            return NOT_CONVERGED
        noise = np.sqrt(stats[1] * (stats[2] + stats[3]))
        if far < damping * max(STEP_PX, STEP_SHARE * noise):
            return OK
    return NOT_CONVERGED


@compiled
def _cut(tables: Tables, cut: Floats, work: Work) -> int:
    """Leave weight to the pixels beyond a line only."""
    side, half = tables.side, tables.side // 2
    wide = (side + 15) // 16 * 16
    before, after, n = 0.0, 0.0, side * wide
    for row in range(side):
        for i in range(side):
            k = row * wide + i
            before += work.weight[k]
            if not (i - half) * cut[0] + (row - half) * cut[1] > cut[2]:
                work.weight[k] = np.float32(0.0)
                work.f[k] = np.float32(0.0)
            after += work.weight[k]
    drop(work, n)
    # The product with plain slopes is not gathered anew: it keeps its ratio.
    squares = dot(work.slope_x, work.slope_x, n) + dot(work.slope_y, work.slope_y, n)
    work.slopes[1] *= squares / max(work.slopes[0], 1e-300)
    work.slopes[0] = squares
    return OK if after >= LEAST_PART * before else MASKED


@njit(cache=True, **KERNEL)
def match_points(
    pictures: Pictures,
    tables: Tables,
    centres: Ints,
    params: Floats,
    results: Results,
    limits: Floats,
    cuts: Floats,
    work: Work,
) -> None:
    """Match a chunk of subsets, each from its own parameters.

    Parameters
    ----------
    pictures : Pictures
        Both pictures and the usable pixels.
    tables : Tables
        What depends on the recipe alone.
    centres : (N, 2) int64, px
        Centres of the subsets, x first.
    params : (N, 2 terms) float64, px
        Start, and the result on return; places are in half sides of the subset.
    results : Results
        Set on return.
    limits : (2,) float64
        Farthest that the centre may leave its start, px; share of the noise in the product of smoothed and
        plain slope, grey levels^2 px^-2 a pixel.
    cuts : (N, 3) or (0, 3) float64
        Only pixels with ``x cuts[0] + y cuts[1] > cuts[2]`` about the centre are used, px; none: all are.
    work : Work
        Scratch of this thread.
    """
    for n in range(centres.shape[0]):
        cx, cy = centres[n, 0], centres[n, 1]
        code = gather(pictures, tables, cx, cy, work)
        if code == OK and cuts.shape[0] > 0:
            code = _cut(tables, cuts[n], work)
        if code == OK:
            code = match_subset(pictures, tables, cx, cy, params[n], results.stats[n], limits, work)
        results.status[n] = code


@njit(cache=True, **KERNEL)
def read_points(
    pictures: Pictures, tables: Tables, centres: Ints, params: Floats, out: Singles, work: Work
) -> None:
    """Read subsets as they are matched, for whoever looks at their residuals.

    ``out`` (N, 4, side * wide): residuals free of gain and offset, slopes in x and y, weights.
    """
    n = tables.mono.shape[1]
    for k in range(centres.shape[0]):
        cx, cy = centres[k, 0], centres[k, 1]
        out[k] = 0.0
        if gather(pictures, tables, cx, cy, work) != OK:
            continue
        work.level[1] = 0.0
        sample(pictures, tables, cx, cy, params[k], work)
        drop(work, n)
        count, norm = centre(work, n)
        work.level[0] = work.level[1]
        difference(work, n, count, norm)
        for i in range(n):
            out[k, 0, i] = work.g[i]
            out[k, 1, i], out[k, 2, i], out[k, 3, i] = work.slope_x[i], work.slope_y[i], work.weight[i]
