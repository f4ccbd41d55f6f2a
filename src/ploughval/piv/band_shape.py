"""Compiled form of a subset that a shear band crosses: two sides in motion and a band between them.

    u(x) = a + G x + b S((n . x - c) / w)

(docs/theory-correlation.md, Eq. (4)) with S a smooth step from -1/2 to 1/2, n = (cos t, sin t) across the
band, c its distance from the subset's centre and w half its width (an enriched shape function; cf. Rethore,
Hild & Roux 2007 for the finite-element form).
"""

from typing import NamedTuple

import numpy as np

from ploughval.piv.compiled import Floats, Singles, compiled
from ploughval.piv.interpolate import PAD
from ploughval.piv.kernel import STATS
from ploughval.piv.sampling import (
    Pictures,
    Tables,
    Work,
    blend_row,
    keep_inside,
    make_work,
)

TERMS = 11
"""Parameters: a (2), G (4: xx, xy, yx, yy; 1), b (2) px, t rad, c px, w px."""


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
    state: Floats  # correlation, damping
    row: Singles  # weights of a row that is only tried


def make_band_work(side: int, terms: int) -> BandWork:
    """Scratch for subsets of ``side`` px."""
    work = make_work(side, terms)
    square, line = (TERMS, TERMS), TERMS
    return BandWork(
        work, np.zeros((3 + TERMS, work.f.size), np.float32), np.zeros(square), np.zeros(square),
        np.zeros(square), np.zeros((2, TERMS)), np.zeros(line), np.zeros(line), np.zeros(line),
        np.zeros(STATS), np.zeros(2), np.zeros(side + 16, np.float32),
    )  # fmt: skip


@compiled
def step(p: Floats, side: int, scratch: Singles) -> None:
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
def sample_band(
    pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats, band: BandWork, final: bool
) -> int:
    """Current picture at the subset as the band moves it; returns how many pixels left the picture.

    ``final``: these lose their weight; else they are only counted.
    """
    side, half = tables.side, tables.side // 2
    wide = (side + 15) // 16 * 16
    work, scratch = band.work, band.pixels
    place = work.place
    height, width = pictures.current.shape[0] - 2 * PAD, pictures.current.shape[1] - 2 * PAD
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
            own = work.weight[row * wide : row * wide + side]
            weight = own if final else band.row[:side]
            for i in range(side):
                weight[i] = own[i]
            lost += keep_inside(pictures, left, top, place, side, weight)
        blend_row(pictures.current, tables.basis, top, left, place, side, False, work.g[row * wide :])
    return lost


@compiled
def columns(tables: Tables, p: Floats, band: BandWork) -> None:
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
def at_point(p: Floats, dx: float, dy: float, band: BandWork, stats: Floats, out: Floats) -> None:
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
        whole = 0.0
        for k in range(TERMS):
            for m in range(TERMS):
                whole += row[k] * band.inverse[k, m] * row[m]
        stats[2 + axis] = max(whole, 0.0)
