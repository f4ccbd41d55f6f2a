"""Compiled matching of subsets that a shear band crosses: two sides in motion and a band between them.

    u(x) = a + G x + b S((n . x - c) / w)

with S a smooth step from -1/2 to 1/2, n = (cos t, sin t) across the band, c its distance from the subset's
centre and w half its width (an enriched shape function; cf. Rethore, Hild & Roux 2007 for the finite-element
form). Levenberg-Marquardt in all eleven parameters.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from ploughval.axes import Status
from ploughval.piv.algebra import dot, invert
from ploughval.piv.kernel import STATS, Results, answers, centre, difference, drop
from ploughval.piv.sampling import (
    KERNEL,
    OK,
    Floats,
    Ints,
    Pictures,
    Singles,
    Tables,
    Work,
    blend_row,
    compiled,
    gather,
    keep_inside,
    make_work,
)

NOT_CONVERGED, FLAT = int(Status.NOT_CONVERGED), int(Status.FLAT)
TERMS = 11
"""Parameters: a (2), G (4: xx, xy, yx, yy; 1), b (2) px, t rad, c px, w px."""
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


class BandWork(NamedTuple):
    """Scratch of one chunk."""

    work: Work
    pixels: Singles  # (3 + TERMS, n): step, its slope, place along the band; a column for each parameter
    matrix: Floats
    inverse: Floats
    damped: Floats
    sums: Floats  # (2, TERMS)
    rhs: Floats
    trial: Floats
    best: Floats
    kept: Floats  # stats of the best start
    state: Floats  # correlation, gain, damping


def make_band_work(side: int, terms: int) -> BandWork:
    """Scratch for subsets of ``side`` px."""
    work = make_work(side, terms)
    square, line = (TERMS, TERMS), TERMS
    return BandWork(
        work, np.zeros((3 + TERMS, work.f.size), np.float32), np.zeros(square), np.zeros(square),
        np.zeros(square), np.zeros((2, TERMS)), np.zeros(line), np.zeros(line), np.zeros(line),
        np.zeros(STATS), np.zeros(3),
    )  # fmt: skip


@compiled
def _step(p: Floats, side: int, scratch: Singles) -> None:
    """Step S, its slope S' / w across the band, and place along it, for every pixel: scratch[0:3]."""
    half, wide = side // 2, (side + 15) // 16 * 16
    nx, ny = np.float32(np.cos(p[8])), np.float32(np.sin(p[8]))
    c, inverse = np.float32(p[9]), np.float32(1.0 / p[10])
    one, zero = np.float32(1.0), np.float32(0.0)
    for row in range(side):
        y = np.float32(row - half)
        s, d, e = scratch[0, row * wide :], scratch[1, row * wide :], scratch[2, row * wide :]
        for i in range(side):
            x = np.float32(i - half)
            t = (x * nx + y * ny - c) * inverse
            t = min(max(t, -one), one)
            q = t * t
            s[i] = t * (np.float32(15.0) - q * (np.float32(10.0) - np.float32(3.0) * q)) * np.float32(0.0625)
            d[i] = max(np.float32(0.9375) * (one - q) * (one - q), zero) * inverse
            e[i] = y * nx - x * ny


@compiled
def _sample(pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats, band: BandWork) -> int:
    """Current picture at the subset as the band moves it; returns how many pixels left the picture."""
    side, half = tables.side, tables.side // 2
    wide = (side + 15) // 16 * 16
    work, scratch = band.work, band.pixels
    place = work.place
    height, width = pictures.mask.shape
    lost = 0
    # Whole px go into the base of a row, so that single precision serves.
    x0, y0 = np.int64(np.floor(p[0])), np.int64(np.floor(p[1]))
    for row in range(side):
        ax, ay = np.float32(p[0] - x0 + p[3] * (row - half)), np.float32(p[1] - y0 + p[5] * (row - half))
        gx, gy, bx, by = np.float32(p[2]), np.float32(p[4]), np.float32(p[6]), np.float32(p[7])
        s = scratch[0, row * wide :]
        xs, ys = place[0], place[1]
        far = np.float32(0.0)
        for i in range(side):
            x = np.float32(i - half)
            xs[i] = ax + gx * x + bx * s[i]
            ys[i] = ay + gy * x + by * s[i]
            far = max(far, max(abs(xs[i]), abs(ys[i])))
        left, top = cx - half + x0, cy - half + row + y0
        if not far < 1e6:
            return side * side
        inside = left - far >= 0.0 and left + side + far <= width - 1.0
        inside = inside and top - far >= 0.0 and top + far <= height - 1.0 and pictures.seen.size == 1
        if not inside:
            lost += keep_inside(pictures, left, top, place, side, work.weight[row * wide : row * wide + side])
        blend_row(pictures.current, tables.basis, top, left, place, side, False, work.g[row * wide :])
    return lost


@compiled
def _columns(tables: Tables, p: Floats, band: BandWork) -> None:
    """What the current picture changes by with each parameter: scratch[3:14], slopes carried along."""
    side, half = tables.side, tables.side // 2
    wide = (side + 15) // 16 * 16
    work, scratch = band.work, band.pixels
    nx, ny = np.float32(np.cos(p[8])), np.float32(np.sin(p[8]))
    bx, by, c, inverse = np.float32(p[6]), np.float32(p[7]), np.float32(p[9]), np.float32(1.0 / p[10])
    one, least = np.float32(1.0), np.float32(0.3)
    for row in range(side):
        y, start = np.float32(row - half), row * wide
        for i in range(side):
            k = start + i
            x, s, d, e = np.float32(i - half), scratch[0, k], scratch[1, k], scratch[2, k]
            # Slopes of the current picture where the pixel went: (1 + grad u)^-T times the reference's.
            ux, uy = one + np.float32(p[2]) + bx * nx * d, np.float32(p[3]) + bx * ny * d
            vx, vy = np.float32(p[4]) + by * nx * d, one + np.float32(p[5]) + by * ny * d
            det = max(ux * vy - uy * vx, least)
            sx, sy = work.slope_x[k], work.slope_y[k]
            gx, gy = (vy * sx - vx * sy) / det, (ux * sy - uy * sx) / det
            across = bx * gx + by * gy
            scratch[3, k], scratch[4, k] = gx, gy
            scratch[5, k], scratch[6, k] = gx * x, gx * y
            scratch[7, k], scratch[8, k] = gy * x, gy * y
            scratch[9, k], scratch[10, k] = gx * s, gy * s
            scratch[11, k] = across * d * e
            scratch[12, k] = -across * d
            scratch[13, k] = -across * d * (x * nx + y * ny - c) * inverse


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
) -> tuple[float, float]:
    """Correlation at p (-2: pixels leave the picture) and the gain; the residuals are left in work.g."""
    n = tables.mono.shape[1]
    _step(p, tables.side, band.pixels)
    if _sample(pictures, tables, cx, cy, p, band) > 0:
        return -2.0, 0.0
    norm = np.sqrt(dot(band.work.f, band.work.f, n))
    zncc, scale = difference(band.work, n, count, norm)
    return float(zncc), float(scale)


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
    """Raise the damping until a step betters the correlation; p is overwritten. True: converged."""
    for _ in range(TRIES):
        if not _damp(band, band.state[2]):
            band.state[2] = max(10.0 * band.state[2], 1e-4)
            continue
        for k in range(TERMS):
            total = 0.0
            for m in range(TERMS):
                total += band.inverse[k, m] * band.rhs[m]
            band.trial[k] = p[k] + total
        far = _farthest(p, band.trial, tables.side // 2)
        if not _bounded(band.trial, tables.side):
            band.state[2] *= 8.0
            continue
        new, gain = _correlation(pictures, tables, cx, cy, band.trial, band, count)
        if new > band.state[0] or (far < STEP_PX and new > band.state[0] - 1e-7):
            little = new - band.state[0] < LEAST_GAIN * (1.0 - new)
            band.state[0], band.state[1] = new, gain
            band.state[2] = max(0.2 * band.state[2], 1e-6)
            for k in range(TERMS):
                p[k] = band.trial[k]
            return bool(little or far < STEP_PX)
        band.state[2] *= 6.0
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
    _step(p, tables.side, band.pixels)
    _sample(pictures, tables, cx, cy, p, band)  # pixels that leave the picture lose their weight
    drop(work, n)
    count, norm = centre(work, n)
    work.level[0] = work.level[1]
    if not norm > 0.0 or count < 4.0 * TERMS:
        return FLAT
    ff, status = norm * norm, NOT_CONVERGED
    band.state[0], band.state[1] = _correlation(pictures, tables, cx, cy, p, band, count)
    band.state[2] = 1e-2
    for iteration in range(ITERATIONS):
        _columns(tables, p, band)
        _normal(band, n, count, ff)
        stats[5] = iteration + 1.0
        if _try_steps(pictures, tables, cx, cy, p, band, count):
            status = OK
            break
    zncc, _ = _correlation(pictures, tables, cx, cy, p, band, count)
    if zncc < -1.0:
        return NOT_CONVERGED
    _columns(tables, p, band)
    _normal(band, n, count, ff)
    if not _damp(band, 1e-6):
        return NOT_CONVERGED
    stats[0], stats[1] = zncc, dot(band.work.g, band.work.g, n) / max(count - 2.0 - TERMS, 1.0)
    stats[4], stats[6] = count, ff / count
    return status


@compiled
def copy(source: Floats, target: Floats) -> None:
    """Copy a short array; assigning a slice would allocate."""
    for k in range(source.size):
        target[k] = source[k]


@compiled
def _at_point(p: Floats, dx: float, dy: float, band: BandWork, stats: Floats, out: Floats) -> None:
    """Motion (2) and its gradient (4) at a point of the subset, and what its variance is over the noise's."""
    nx, ny = np.cos(p[8]), np.sin(p[8])
    t = min(max((dx * nx + dy * ny - p[9]) / p[10], -1.0), 1.0)
    s = t * (15.0 - t * t * (10.0 - 3.0 * t * t)) / 16.0
    d = 15.0 / 16.0 * (1.0 - t * t) ** 2 / p[10]
    row = band.trial
    for axis in range(2):
        b = p[6 + axis]
        out[axis] = p[axis] + p[2 + 2 * axis] * dx + p[3 + 2 * axis] * dy + b * s
        out[2 + 2 * axis], out[3 + 2 * axis] = p[2 + 2 * axis] + b * nx * d, p[3 + 2 * axis] + b * ny * d
        row[:] = 0.0
        row[axis], row[2 + 2 * axis], row[3 + 2 * axis], row[6 + axis] = 1.0, dx, dy, s
        row[8], row[9], row[10] = b * d * (dy * nx - dx * ny), -b * d, -b * d * t
        total = 0.0
        for k in range(TERMS):
            for m in range(TERMS):
                total += row[k] * band.inverse[k, m] * row[m]
        stats[2 + axis] = max(total, 0.0)


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
                ratio = min(max(band.work.slopes[1] / max(band.work.slopes[0], 1e-300), 0.25), 2.5)
                stats[7], stats[8] = band.work.slopes[0], ratio
                status = _fit(pictures, tables, cx, cy, p, stats, band)
            if status == OK and stats[0] > band.kept[0]:
                code = OK
                stats[7] /= 2.0 * max(stats[4], 1.0)
                stats[9] = stats[7] * ratio
                band.work.moments[0, 0] = dot(band.work.slope_x, band.work.slope_x, n_all)
                band.work.moments[2, 0] = dot(band.work.slope_y, band.work.slope_y, n_all)
                answers(band.work, stats[4], slope_noise, stats)
                _at_point(p, points.offsets[n, 0], points.offsets[n, 1], band, stats, points.motion[n])
                copy(stats, band.kept)
                copy(p, band.best)
            elif code != OK:
                code = status
        if code == OK:
            copy(band.best, points.tries[n, 0])
            copy(band.kept, stats)
        results.status[n] = code
