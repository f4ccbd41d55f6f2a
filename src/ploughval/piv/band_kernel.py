"""Compiled matching of subsets that a shear band crosses, by Levenberg-Marquardt in all eleven parameters."""

from typing import NamedTuple

import numpy as np
from numba import njit

from ploughval.axes import Status
from ploughval.piv.algebra import dot, invert, total
from ploughval.piv.band_shape import TERMS, BandWork, at_point, columns, sample_band, step
from ploughval.piv.compiled import KERNEL, Floats, Ints, compiled
from ploughval.piv.kernel import Results, answers, centre, difference, drop
from ploughval.piv.sampling import (
    EDGE,
    LEAST_SHARE,
    OK,
    Pictures,
    Tables,
    Work,
    gather,
)

NOT_CONVERGED, FLAT = int(Status.NOT_CONVERGED), int(Status.FLAT)
PARTS = "6a503cf32b66"
"""Digest of the files this kernel is made of: compiled code is kept by this file alone, so it must change
with them (a test says what it is)."""
WIDTH_PX = (1.0, 30.0)
"""Half-widths that a band may have."""
MOST_GRADIENT = 0.6
"""Gradients that both sides may share."""
ITERATIONS = 40
TRIES = 6
"""Steps that are tried with ever more damping in one iteration."""
LEAST_GAIN = 1e-3
"""Converged when a step lowers the residuals by a smaller share."""
STEP_PX = 2e-3
"""Converged when the motion of no corner and no side changes by more."""


class BandPoints(NamedTuple):
    """A chunk of points.

    Centres of their subsets (N, 2) px, x first; places about these (N, 2) px; starts (N, K, TERMS), NaN:
    none; the motion at each and its gradient (xx, xy, yx, yy), (N, 6).
    """

    centres: Ints
    offsets: Floats
    tries: Floats
    motion: Floats


@compiled
def _normal(band: BandWork, n: int, count: float, ff: float) -> None:
    """Normal matrix, free of gain and offset, and right-hand side."""
    f, r, matrix = band.work.f[:n], band.work.g[:n], band.matrix
    for k in range(TERMS):
        a = band.pixels[3 + k, :n]
        whole, along, other = np.float32(0.0), np.float32(0.0), np.float32(0.0)
        for i in range(n):
            whole += a[i]
            along += a[i] * f[i]
            other += a[i] * r[i]
        band.rhs[k] = other
        band.sums[0, k], band.sums[1, k] = whole, along
        for m in range(k + 1):
            b = band.pixels[3 + m, :n]
            product = np.float32(0.0)
            for i in range(n):
                product += a[i] * b[i]
            matrix[k, m] = product
    for k in range(TERMS):
        for m in range(k + 1):
            value = matrix[k, m] - band.sums[0, k] * band.sums[0, m] / count
            value -= band.sums[1, k] * band.sums[1, m] / ff
            matrix[k, m], matrix[m, k] = value, value


@compiled
def _damp(band: BandWork, damping: float) -> bool:
    """Inverse of the normal matrix with its diagonal raised; False where there is none."""
    for k in range(TERMS):
        for m in range(TERMS):
            band.damped[k, m] = band.matrix[k, m]
        band.damped[k, k] += damping * band.matrix[k, k] + 1e-9 * band.matrix[0, 0]
    return bool(invert(band.damped, band.inverse))


@compiled
def _correlation(
    pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats, band: BandWork, count: float
) -> float:
    """Correlation at p, -2 where pixels leave the picture; the residuals are left in work.g."""
    n = tables.mono.shape[1]
    step(p, tables.side, band.pixels)
    if sample_band(pictures, tables, cx, cy, p, band, False) > 0:
        return -2.0
    norm = np.sqrt(dot(band.work.f, band.work.f, n))
    return float(difference(band.work, n, count, norm))


@compiled
def _bounded(p: Floats, side: int) -> bool:
    """Whether the band crosses the subset and all is finite; the width is kept within its limits."""
    p[10] = min(max(p[10], WIDTH_PX[0]), min(WIDTH_PX[1], 0.75 * side))
    for k in range(TERMS):
        if not abs(p[k]) < (MOST_GRADIENT if 2 <= k < 6 else 1e6):
            return False
    return bool(abs(p[9]) <= 0.75 * side)


@compiled
def _farthest(p: Floats, q: Floats, half: int) -> float:
    """How much the motion differs between two sets of parameters, px."""
    far = max(abs(q[0] - p[0]), abs(q[1] - p[1])) + max(abs(q[6] - p[6]), abs(q[7] - p[7]))
    gradient = 0.0
    for k in range(2, 6):
        gradient = max(gradient, abs(q[k] - p[k]))
    return float(far + half * gradient + 0.1 * abs(q[9] - p[9]))


@compiled
def _try_steps(
    pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats, band: BandWork, count: float
) -> bool:
    """Raise the damping until a step betters the correlation; p is overwritten.

    True: the step was small, or none betters the correlation any more.
    """
    for _ in range(TRIES):
        if not _damp(band, band.state[1]):
            band.state[1] = max(10.0 * band.state[1], 1e-4)
            continue
        for k in range(TERMS):
            step = 0.0
            for m in range(TERMS):
                step += band.inverse[k, m] * band.rhs[m]
            band.trial[k] = p[k] + step
        far = _farthest(p, band.trial, tables.side // 2)
        if not _bounded(band.trial, tables.side):
            band.state[1] *= 8.0
            continue
        new = _correlation(pictures, tables, cx, cy, band.trial, band, count)
        if new > band.state[0] or (far < STEP_PX and new > band.state[0] - 1e-7):
            little = new - band.state[0] < LEAST_GAIN * (1.0 - new)
            band.state[0] = new
            band.state[1] = max(0.2 * band.state[1], 1e-6)
            for k in range(TERMS):
                p[k] = band.trial[k]
            return bool(little or far < STEP_PX)
        band.state[1] *= 6.0
        if far < STEP_PX:
            break
    return True


@compiled
def _fit(
    pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats, stats: Floats, band: BandWork
) -> int:
    """Levenberg-Marquardt from p; p, stats and the inverse are overwritten; returns a status."""
    n, work = tables.mono.shape[1], band.work
    work.level[1] = 0.0
    if not _bounded(p, tables.side):
        return NOT_CONVERGED
    gathered = total(work.weight, n)
    step(p, tables.side, band.pixels)
    sample_band(pictures, tables, cx, cy, p, band, True)  # pixels that leave the picture lose their weight
    drop(work, n)
    count, norm = centre(work, n)
    work.level[0] = work.level[1]
    if count < max(LEAST_SHARE * gathered, 4.0 * TERMS):
        return EDGE
    if not norm > 0.0:
        return FLAT
    ff, status = norm * norm, NOT_CONVERGED
    band.state[0] = _correlation(pictures, tables, cx, cy, p, band, count)
    band.state[1] = 1e-2
    for iteration in range(ITERATIONS):
        columns(tables, p, band)
        _normal(band, n, count, ff)
        stats[5] = iteration + 1.0
        if _try_steps(pictures, tables, cx, cy, p, band, count):
            status = OK
            break
    zncc = _correlation(pictures, tables, cx, cy, p, band, count)
    if zncc < -1.0:
        return NOT_CONVERGED
    columns(tables, p, band)
    _normal(band, n, count, ff)
    if not _damp(band, 1e-6):
        return NOT_CONVERGED
    stats[0], stats[1] = zncc, dot(band.work.g, band.work.g, n) / max(count - 2.0 - TERMS, 1.0)
    stats[4], stats[6] = count, ff / count
    return status


@compiled
def _slopes(work: Work, n: int, slope_noise: float, stats: Floats) -> None:
    """What stats say of the slopes of the pixels gathered, as for plain subsets."""
    count = max(total(work.weight, n), 1.0)
    work.moments[0, 0] = dot(work.slope_x, work.slope_x, n)
    work.moments[2, 0] = dot(work.slope_y, work.slope_y, n)
    answers(work, count, slope_noise, stats)


@compiled
def copy(source: Floats, target: Floats) -> None:
    """Copy a short array; assigning a slice would allocate."""
    for k in range(source.size):
        target[k] = source[k]


@njit(cache=True, **KERNEL)
def match_bands(
    pictures: Pictures,
    tables: Tables,
    points: BandPoints,
    results: Results,
    enough: float,
    slope_noise: float,
    band: BandWork,
) -> None:
    """Match a chunk of subsets that a band crosses, each from several starts; the best correlation counts.

    Parameters
    ----------
    pictures, tables : Pictures, Tables
        As of ``kernel.match_points``; of ``tables`` only side, basis and extent count.
    points : BandPoints
        Where and from what; its ``tries[:, 0]`` and ``motion`` are overwritten.
    results : Results
        Set on return.
    enough : float, grey levels^2
        Residual variance at which no further start is tried.
    slope_noise : float, grey levels^2 px^-2
        What noise adds to the product of smoothed and plain slope, a pixel.
    band : BandWork
        Scratch of this thread.
    """
    n_all = tables.mono.shape[1]
    for n in range(points.centres.shape[0]):
        cx, cy = points.centres[n, 0], points.centres[n, 1]
        stats = results.stats[n]
        code = NOT_CONVERGED
        band.kept[0], band.kept[1] = -1.0, np.inf
        for k in range(points.tries.shape[1]):
            p = points.tries[n, k]
            if np.isnan(p[0]) or band.kept[1] <= enough:
                continue
            status = gather(pictures, tables, cx, cy, band.work)
            if status == OK:
                _slopes(band.work, n_all, slope_noise, stats)
                status = _fit(pictures, tables, cx, cy, p, stats, band)
            if status == OK and stats[0] > band.kept[0]:
                code = OK
                at_point(p, points.offsets[n, 0], points.offsets[n, 1], band, stats, points.motion[n])
                copy(stats, band.kept)
                copy(p, band.best)
            elif code != OK:
                code = status if status != OK else NOT_CONVERGED
        if code == OK:
            copy(band.best, points.tries[n, 0])
            copy(band.kept, stats)
        results.status[n] = code
