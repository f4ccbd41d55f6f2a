"""Compiled inverse-compositional Gauss-Newton matching of subsets (Baker & Matthews 2004)."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.sampling import (
    EDGE,
    FAST,
    LEAST_SHARE,
    OK,
    Floats,
    Ints,
    Pictures,
    Tables,
    Work,
    compiled,
    gather,
    sample,
)

FLAT, NOT_CONVERGED = int(Status.FLAT), int(Status.NOT_CONVERGED)
LOW_CORRELATION = int(Status.LOW_CORRELATION)
STEP_PX = 3e-4
"""Gauss-Newton has converged when no corner of the subset moves by more than this."""
ITERATIONS = 30
STATS = 10
"""Columns of stats: zncc, residual variance, variance factors in x and y, pixels, iterations, variance of
the grey values, mean square of a slope, its product with the plain slope over that,
mean square of the plain one."""


class Results(NamedTuple):
    """Stats (N, STATS) and status (N,) of a chunk."""

    stats: Floats
    status: NDArray[np.int8]


@compiled
def _total(values: Floats) -> float:
    """Sum of an array."""
    total = 0.0
    for n in range(values.size):
        total += values[n]
    return total


@compiled
def _drop(work: Work) -> None:
    """Clear the slopes of pixels that lost their weight."""
    for n in range(work.weight.size):
        if work.weight[n] == 0.0:
            work.jac[:, n] = 0.0


@compiled
def _centre(values: Floats, weight: Floats) -> tuple[float, float]:
    """Take the weighted mean off, zero where there is no weight; returns the norm."""
    total, count = 0.0, 0.0
    for n in range(values.size):
        total += weight[n] * values[n]
        count += weight[n]
    mean = total / max(count, 1.0)
    square = 0.0
    for n in range(values.size):
        values[n] = weight[n] * (values[n] - mean)
        square += values[n] * values[n]
    return np.sqrt(square), mean


@compiled
def _invert(a: Floats, inverse: Floats) -> bool:
    """Inverse of a symmetric positive definite matrix by Gauss-Jordan; False where it is singular."""
    n = a.shape[0]
    scale = 0.0
    for i in range(n):
        scale = max(scale, a[i, i])
        for j in range(n):
            inverse[i, j] = 1.0 if i == j else 0.0
    for i in range(n):
        pivot = a[i, i]
        if not pivot > 1e-10 * scale:
            return False
        for j in range(n):
            a[i, j] /= pivot
            inverse[i, j] /= pivot
        for k in range(n):
            if k != i:
                factor = a[k, i]
                for j in range(n):
                    a[k, j] -= factor * a[i, j]
                    inverse[k, j] -= factor * inverse[i, j]
    return True


@compiled
def _prepare(work: Work) -> float:
    """Centre the reference subset and invert its Hessian, free of gain and offset; returns the norm, or 0."""
    count, level = 0.0, 0.0
    for n in range(work.weight.size):
        count += work.weight[n]
    norm, mean = _centre(work.f, work.weight)
    level = 1e-6 * (abs(mean) + 1e-30)
    if norm * norm <= count * level * level:
        return 0.0
    size = work.jac.shape[0]
    for k in range(size):
        jk = work.jac[k]
        along, total = 0.0, 0.0
        for n in range(jk.size):
            along += jk[n] * work.f[n]
            total += jk[n]
        work.rhs[k] = along / norm
        work.step[k] = total / np.sqrt(count)
    for k in range(size):
        for m in range(k, size):
            jk, jm = work.jac[k], work.jac[m]
            total = 0.0
            for n in range(jk.size):
                total += jk[n] * jm[n]
            total -= work.rhs[k] * work.rhs[m] + work.step[k] * work.step[m]
            work.hessian[k, m] = total
            work.hessian[m, k] = total
    return norm if _invert(work.hessian, work.inverse) else 0.0


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
def _advance(work: Work, scale: float, ratio: float) -> tuple[float, float]:
    """Residuals and the step they call for; returns the product of both subsets and the residuals' square."""
    dot, square = 0.0, 0.0
    for n in range(work.f.size):
        r = work.f[n] - scale * work.g[n]
        work.r[n] = r
        dot += work.f[n] * work.g[n]
        square += r * r
    for k in range(work.rhs.size):
        jk = work.jac[k]
        total = 0.0
        for n in range(jk.size):
            total += jk[n] * work.r[n]
        work.rhs[k] = -total
    for k in range(work.rhs.size):
        total = 0.0
        for m in range(work.rhs.size):
            total += work.inverse[k, m] * work.rhs[m]
        work.step[k] = total / ratio
    return dot, square


@compiled
def _match(
    pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats, stats: Floats, limit: float, work: Work
) -> int:
    """Gauss-Newton from p with the weights and slopes in work; p and stats are overwritten."""
    side, terms = tables.side, tables.mono.shape[0]
    u0, v0 = p[0], p[terms]
    norm = _prepare(work)
    wanted = _total(work.weight)
    # Slopes may be smoothed: their product with the plain ones is what the residual answers to.
    ratio = min(max(work.slopes[1] / max(work.slopes[0], 1e-300), 0.5), 2.5)
    pixels = 2.0 * max(_total(work.weight), 1.0)
    stats[7], stats[8], stats[9] = work.slopes[0] / pixels, ratio, work.slopes[2] / pixels
    status = NOT_CONVERGED
    for iteration in range(ITERATIONS):
        if norm == 0.0:
            return FLAT
        if sample(pictures, tables, cx, cy, p, work) > 0:
            if _total(work.weight) < LEAST_SHARE * wanted:
                return EDGE
            _drop(work)
            norm = _prepare(work)
            if norm == 0.0:
                return FLAT
        gnorm, _ = _centre(work.g, work.weight)
        scale = norm / gnorm if gnorm > 1e-12 * norm else 0.0
        dot, square = _advance(work, scale, ratio)
        count = _total(work.weight)
        stats[0] = dot / (norm * gnorm) if scale > 0.0 else 0.0
        stats[1] = square / max(count - 2.0 - 2.0 * terms, 1.0)
        stats[2], stats[3] = work.inverse[0, 0], work.inverse[terms, terms]
        stats[4], stats[5], stats[6] = count, iteration + 1.0, norm * norm / count
        far = _compose(p, work.step, terms, side // 2)
        if not (abs(p[0] - u0) <= limit and abs(p[terms] - v0) <= limit):
            return NOT_CONVERGED
        if far < STEP_PX:
            status = OK
            break
    return status


@compiled
def _window(side: int, reach: int, work: Work) -> None:
    """Leave weight only to pixels at most ``reach`` from the centre."""
    half = side // 2
    for n in range(work.weight.size):
        if abs(n // side - half) > reach or abs(n % side - half) > reach:
            work.weight[n] = 0.0
    _drop(work)


@compiled
def _box(values: Floats, out: Floats, side: int, reach: int) -> None:
    """Mean over the neighbourhood of every pixel; negative values are pixels that are not there."""
    for n in range(values.size):
        row, column = n // side, n % side
        total, count = 0.0, 0.0
        for j in range(max(row - reach, 0), min(row + reach, side - 1) + 1):
            for i in range(max(column - reach, 0), min(column + reach, side - 1) + 1):
                if values[j * side + i] >= 0.0:
                    total += values[j * side + i]
                    count += 1.0
        out[n] = total / count if count > 0.0 else -1.0


@compiled
def _residual_map(side: int, reach: int, work: Work) -> None:
    """Squared residuals of the subset, with level and gain of a window about its centre, smoothed."""
    half = side // 2
    f0, g0, ff, gg, count = 0.0, 0.0, 0.0, 0.0, 0.0
    for twice in range(2):
        for n in range(work.weight.size):
            if abs(n // side - half) > reach or abs(n % side - half) > reach or work.weight[n] == 0.0:
                continue
            if twice == 0:
                f0, g0, count = f0 + work.f[n], g0 + work.g[n], count + 1.0
            else:
                ff, gg = ff + (work.f[n] - f0) ** 2, gg + (work.g[n] - g0) ** 2
        if twice == 0:
            f0, g0 = f0 / max(count, 1.0), g0 / max(count, 1.0)
    gain = np.sqrt(ff / gg) if gg > 0.0 else 0.0
    for n in range(work.weight.size):
        r = work.f[n] - f0 - gain * (work.g[n] - g0)
        work.smooth[0, n] = r * r if work.weight[n] > 0.0 else -1.0
    _box(work.smooth[0], work.smooth[1], side, 2)


@compiled
def _select(side: int, allowed: Floats, work: Work) -> int:
    """Leave weight only to pixels whose residuals are small; LOW_CORRELATION where too few."""
    whole = max(_total(work.weight), 1.0)
    most = allowed[0] + allowed[1] * work.slopes[1] / (2.0 * whole)
    _residual_map(side, int(allowed[2]), work)
    for n in range(work.weight.size):
        if not 0.0 <= work.smooth[1, n] <= most:
            work.weight[n] = 0.0
    centre = work.smooth[1, side * side // 2]
    if _total(work.weight) < allowed[3] * side * side or not 0.0 <= centre <= most:
        return LOW_CORRELATION
    _drop(work)
    return OK


@njit(cache=True, nogil=True, fastmath=FAST)
def match_points(
    pictures: Pictures,
    tables: Tables,
    centres: Ints,
    tries: Floats,
    results: Results,
    allowed: Floats,
    work: Work,
) -> None:
    """Match a chunk of subsets, whole or only the part of each that moves with its centre.

    A whole subset starts from its only candidate. Else a small window about the centre chooses among the
    candidates; then pixels whose squared residuals, averaged over 5 x 5, are below ``allowed[0] +
    allowed[1] * mean square slope`` are matched, twice over: one side of a shear band.

    Parameters
    ----------
    pictures : Pictures
        Both pictures and the usable pixels.
    tables : Tables
        What depends on the recipe alone.
    centres : (N, 2) int64, px
        Centres of the subsets, x first.
    tries : (N, K, 2 terms) float64, px
        Candidates, NaN: none; places are in half sides of the subset. The result is left in ``[:, 0]``.
    results : Results
        Set on return.
    allowed : (1,) or (4,) float64
        Whole subsets: farthest that the centre may leave its guess, px. Parts: residual variance, px^2 of
        mismatch, reach of the small window in px, least share of the pixels.
    work : Work
        Scratch of this thread.
    """
    parts = allowed.size > 1
    count = tries.shape[1]
    limit = allowed[2] if parts else allowed[0]
    for n in range(centres.shape[0]):
        cx, cy = centres[n, 0], centres[n, 1]
        stats, best, top, code = results.stats[n], 0, 0.0, OK
        for attempt in range(count + 2 if parts else 1):
            growing = attempt >= count
            if growing and top <= 0.0:
                code = LOW_CORRELATION
                break
            p = tries[n, best if growing else attempt]
            if np.isnan(p[0]):
                continue
            code = gather(pictures, tables, cx, cy, work)
            if code == OK and growing:
                sample(pictures, tables, cx, cy, p, work)
                code = _select(tables.side, allowed, work)
            elif code == OK and parts:
                _window(tables.side, int(allowed[2]), work)
            if code == OK:
                code = _match(pictures, tables, cx, cy, p, stats, limit, work)
            if growing and code != OK:
                break
            if not growing and stats[0] > top:
                best, top = attempt, stats[0]
        for k in range(tries.shape[2]):
            tries[n, 0, k] = tries[n, best, k]
        results.status[n] = code
