"""Compiled reading of subsets: values and slopes at pixels of the reference, values at warped places."""

from typing import NamedTuple

import numpy as np

from ploughval.axes import Status
from ploughval.piv.algebra import dot
from ploughval.piv.compiled import Bytes, Floats, Ints, Singles, compiled, inlined
from ploughval.piv.interpolate import PAD

Places = tuple[Singles, Singles]
Cells = tuple[int, int]

OK, MASKED, EDGE = int(Status.OK), int(Status.MASKED), int(Status.EDGE)
LEAST_SHARE = 0.4
"""A subset needs this share of its pixels valid."""
SPARE = 32
"""Elements behind a row that a vector may write."""


class Pictures(NamedTuple):
    """What the kernel reads of two pictures.

    Planes of the reference (H, W) (see ``interpolate.Planes``), its usable pixels, coefficients of the
    current picture (H + 2 PAD, W + 2 PAD), and its usable pixels; (1, 1): all are.
    """

    value: Singles
    slope_x: Singles
    slope_y: Singles
    product: Singles
    mask: Bytes
    current: Singles
    seen: Bytes


class Tables(NamedTuple):
    """What depends on the recipe: side, terms of the shape function for one axis, basis, monomials, pairing.

    ``basis``: (nodes / 2, nodes) of ``centred_polynomials``. ``mono``: (moments, side * wide) monomials, the
    first ``terms`` of them the shape function's. ``pairs``: (terms, terms) monomial of their products.
    """

    side: int
    terms: int
    basis: Singles
    mono: Singles
    pairs: Ints


class Work(NamedTuple):
    """Scratch of one chunk, overwritten for each point; pixels lie in rows of ``wide`` elements."""

    f: Singles
    g: Singles
    weight: Singles
    slope_x: Singles
    slope_y: Singles
    place: (
        Singles  # (4, wide + SPARE), places along a row less its first pixel and the step of 1; their steps
    )
    moments: Floats  # (3, moments)
    sums: Floats  # (2, 2 terms): slopes, slopes times values
    hessian: Floats
    inverse: Floats
    rhs: Floats
    step: Floats
    last: Floats
    slopes: Floats  # sums over the subset: squared slopes, product with the plain ones
    level: Floats  # mean of the current subset as last known, that of the reference


def wide_of(side: int) -> int:
    """Elements of a row of pixels: whole vectors of 16."""
    return (side + 15) // 16 * 16


def make_work(side: int, terms: int) -> Work:
    """Scratch for subsets of ``side`` px and shape functions of ``terms`` coefficients an axis."""
    wide = wide_of(side)
    n = side * wide + SPARE
    return Work(
        f=np.zeros(n, np.float32),
        g=np.zeros(n, np.float32),
        weight=np.zeros(n, np.float32),
        slope_x=np.zeros(n, np.float32),
        slope_y=np.zeros(n, np.float32),
        place=np.zeros((4, wide + SPARE), np.float32),
        moments=np.zeros((3, 15)),
        sums=np.zeros((2, 2 * terms)),
        hessian=np.zeros((2 * terms, 2 * terms)),
        inverse=np.zeros((2 * terms, 2 * terms)),
        rhs=np.zeros(2 * terms),
        step=np.zeros(2 * terms),
        last=np.zeros(2 * terms),
        slopes=np.zeros(2),
        level=np.zeros(2),
    )


@compiled
def gather(pictures: Pictures, tables: Tables, cx: int, cy: int, work: Work) -> int:
    """Values, slopes and weights of the subset's pixels; returns EDGE, MASKED or OK."""
    mask, side = pictures.mask, tables.side
    half, wide = side // 2, (side + 15) // 16 * 16
    y0, y1 = max(cy - half, 0), min(cy + half, mask.shape[0] - 1)
    x0, x1 = max(cx - half, 0), min(cx + half, mask.shape[1] - 1)
    work.slopes[:] = 0.0
    if y1 < y0 or x1 < x0 or (y1 - y0 + 1) * (x1 - x0 + 1) < LEAST_SHARE * side * side:
        return EDGE
    if (y1 - y0 + 1) * (x1 - x0 + 1) < side * side:
        work.weight[:], work.f[:] = 0.0, 0.0
        work.slope_x[:], work.slope_y[:] = 0.0, 0.0
    width = x1 - x0 + 1
    used = 0
    for y in range(y0, y1 + 1):
        start = (y - cy + half) * wide + x0 - cx + half
        f, w = work.f[start : start + width], work.weight[start : start + width]
        sx, sy = work.slope_x[start : start + width], work.slope_y[start : start + width]
        value, usable = pictures.value[y, x0 : x1 + 1], mask[y, x0 : x1 + 1]
        fx, fy = pictures.slope_x[y, x0 : x1 + 1], pictures.slope_y[y, x0 : x1 + 1]
        row = 0
        for i in range(width):
            row += usable[i] != 0
        used += row
        if row == width:
            for i in range(width):
                f[i] = value[i]
            for i in range(width):
                sx[i] = fx[i]
            for i in range(width):
                sy[i] = fy[i]
            w[:] = 1.0
        else:
            for i in range(width):
                w[i] = np.float32(usable[i] != 0)
                f[i], sx[i], sy[i] = w[i] * value[i], w[i] * fx[i], w[i] * fy[i]
        work.slopes[0] += dot(sx, sx, width) + dot(sy, sy, width)
        if pictures.product.shape[0] == mask.shape[0]:
            work.slopes[1] += dot(pictures.product[y, x0 : x1 + 1], w, width)
    if pictures.product.shape[0] != mask.shape[0]:
        work.slopes[1] = work.slopes[0]
    return OK if used >= LEAST_SHARE * side * side else MASKED


@inlined
def _blend_quintic(  # type: ignore[no-untyped-def]  # noqa: PLR0913
    c, y, x, xs, ys, kx, ky, basis, out, n
):
    """Interpolate n pixels that read consecutive columns of the same six rows."""
    h = np.float32(0.5)
    kx, ky = np.float32(kx) + h, np.float32(ky) + h
    p0, p1, p2, p3, p4, p5 = basis[0, 0], basis[0, 1], basis[0, 2], basis[0, 3], basis[0, 4], basis[0, 5]
    q0, q1, q2, q3, q4, q5 = basis[1, 0], basis[1, 1], basis[1, 2], basis[1, 3], basis[1, 4], basis[1, 5]
    r0, r1, r2, r3, r4, r5 = basis[2, 0], basis[2, 1], basis[2, 2], basis[2, 3], basis[2, 4], basis[2, 5]
    c0, c1, c2 = c[y, x : x + n + 5], c[y + 1, x : x + n + 5], c[y + 2, x : x + n + 5]
    c3, c4, c5 = c[y + 3, x : x + n + 5], c[y + 4, x : x + n + 5], c[y + 5, x : x + n + 5]
    for j in range(n):
        u = xs[j] - kx
        v = u * u
        e, o = p0 + v * (p2 + v * p4), u * (p1 + v * (p3 + v * p5))
        a0, a5 = e + o, e - o
        e, o = q0 + v * (q2 + v * q4), u * (q1 + v * (q3 + v * q5))
        a1, a4 = e + o, e - o
        e, o = r0 + v * (r2 + v * r4), u * (r1 + v * (r3 + v * r5))
        a2, a3 = e + o, e - o
        u = ys[j] - ky
        v = u * u
        e, o = p0 + v * (p2 + v * p4), u * (p1 + v * (p3 + v * p5))
        t = (e + o) * (
            a0 * c0[j] + a1 * c0[j + 1] + a2 * c0[j + 2] + a3 * c0[j + 3] + a4 * c0[j + 4] + a5 * c0[j + 5]
        )
        t += (e - o) * (
            a0 * c5[j] + a1 * c5[j + 1] + a2 * c5[j + 2] + a3 * c5[j + 3] + a4 * c5[j + 4] + a5 * c5[j + 5]
        )
        e, o = q0 + v * (q2 + v * q4), u * (q1 + v * (q3 + v * q5))
        t += (e + o) * (
            a0 * c1[j] + a1 * c1[j + 1] + a2 * c1[j + 2] + a3 * c1[j + 3] + a4 * c1[j + 4] + a5 * c1[j + 5]
        )
        t += (e - o) * (
            a0 * c4[j] + a1 * c4[j + 1] + a2 * c4[j + 2] + a3 * c4[j + 3] + a4 * c4[j + 4] + a5 * c4[j + 5]
        )
        e, o = r0 + v * (r2 + v * r4), u * (r1 + v * (r3 + v * r5))
        t += (e + o) * (
            a0 * c2[j] + a1 * c2[j + 1] + a2 * c2[j + 2] + a3 * c2[j + 3] + a4 * c2[j + 4] + a5 * c2[j + 5]
        )
        t += (e - o) * (
            a0 * c3[j] + a1 * c3[j + 1] + a2 * c3[j + 2] + a3 * c3[j + 3] + a4 * c3[j + 4] + a5 * c3[j + 5]
        )
        out[j] = t


@inlined
def _blend_cubic(  # type: ignore[no-untyped-def]  # noqa: PLR0913
    c, y, x, xs, ys, kx, ky, basis, out, n
):
    """The same with the four rows of a cubic spline."""
    h = np.float32(0.5)
    kx, ky = np.float32(kx) + h, np.float32(ky) + h
    p0, p1, p2, p3 = basis[0, 0], basis[0, 1], basis[0, 2], basis[0, 3]
    q0, q1, q2, q3 = basis[1, 0], basis[1, 1], basis[1, 2], basis[1, 3]
    c0, c1 = c[y, x : x + n + 3], c[y + 1, x : x + n + 3]
    c2, c3 = c[y + 2, x : x + n + 3], c[y + 3, x : x + n + 3]
    for j in range(n):
        u = xs[j] - kx
        v = u * u
        e, o = p0 + v * p2, u * (p1 + v * p3)
        a0, a3 = e + o, e - o
        e, o = q0 + v * q2, u * (q1 + v * q3)
        a1, a2 = e + o, e - o
        u = ys[j] - ky
        v = u * u
        e, o = p0 + v * p2, u * (p1 + v * p3)
        t = (e + o) * (a0 * c0[j] + a1 * c0[j + 1] + a2 * c0[j + 2] + a3 * c0[j + 3])
        t += (e - o) * (a0 * c3[j] + a1 * c3[j + 1] + a2 * c3[j + 2] + a3 * c3[j + 3])
        e, o = q0 + v * q2, u * (q1 + v * q3)
        t += (e + o) * (a0 * c1[j] + a1 * c1[j + 1] + a2 * c1[j + 2] + a3 * c1[j + 3])
        t += (e - o) * (a0 * c2[j] + a1 * c2[j + 1] + a2 * c2[j + 2] + a3 * c2[j + 3])
        out[j] = t


@compiled
def _quintic_32(c: Singles, y: int, x: int, place: Places, k: Cells, basis: Singles, out: Singles) -> None:
    _blend_quintic(c, y, x, place[0], place[1], k[0], k[1], basis, out, 32)


@compiled
def _quintic_16(c: Singles, y: int, x: int, place: Places, k: Cells, basis: Singles, out: Singles) -> None:
    _blend_quintic(c, y, x, place[0], place[1], k[0], k[1], basis, out, 16)


@compiled
def _cubic_32(c: Singles, y: int, x: int, place: Places, k: Cells, basis: Singles, out: Singles) -> None:
    _blend_cubic(c, y, x, place[0], place[1], k[0], k[1], basis, out, 32)


@compiled
def _cubic_16(c: Singles, y: int, x: int, place: Places, k: Cells, basis: Singles, out: Singles) -> None:
    _blend_cubic(c, y, x, place[0], place[1], k[0], k[1], basis, out, 16)


@compiled
def blend_row(
    current: Singles, basis: Singles, y: int, x: int, place: Singles, side: int, straight: bool, out: Singles
) -> None:
    """Values of one row of pixels, run by run: pixels of a run read consecutive columns of the same rows.

    Pixel i stands at column ``x + i + place[0, i]`` and row ``y + place[1, i]`` of the picture; ``straight``:
    the places are linear in i.
    """
    xs, ys = place[0], place[1]
    nodes = basis.shape[1]
    shift = PAD - (nodes // 2 - 1)
    first = np.int64(0)  # a plain 0 would compile what it is handed to once more
    while first < side:
        kx, ky = np.int64(np.floor(xs[first])), np.int64(np.floor(ys[first]))
        last = first + 1
        if straight and np.floor(xs[side - 1]) == kx and np.floor(ys[side - 1]) == ky:
            last = np.int64(side)
        while last < side and np.floor(xs[last]) == kx and np.floor(ys[last]) == ky:
            last += 1
        at, row = first, y + ky + shift
        while at < last:
            column = x + kx + at + shift
            if last - at > 16:
                if nodes == 6:
                    _quintic_32(current, row, column, (xs[at:], ys[at:]), (kx, ky), basis, out[at:])
                else:
                    _cubic_32(current, row, column, (xs[at:], ys[at:]), (kx, ky), basis, out[at:])
                at += 32
            else:
                if nodes == 6:
                    _quintic_16(current, row, column, (xs[at:], ys[at:]), (kx, ky), basis, out[at:])
                else:
                    _cubic_16(current, row, column, (xs[at:], ys[at:]), (kx, ky), basis, out[at:])
                at += 16
        first = last


@compiled
def keep_inside(pictures: Pictures, x: int, y: int, place: Singles, side: int, weight: Singles) -> int:
    """Clamp a row's places to the picture; pixels that leave it, or are not seen, lose their weight."""
    height, width = pictures.current.shape[0] - 2 * PAD, pictures.current.shape[1] - 2 * PAD
    holes = pictures.seen.size > 1
    lost = 0
    for i in range(side):
        px, py = x + i + place[0, i], y + place[1, i]
        inside = 0.0 <= px <= width - 1.0 and 0.0 <= py <= height - 1.0
        if inside and holes:
            inside = pictures.seen[int(py + 0.5), int(px + 0.5)] != 0
        if not inside:
            lost += weight[i] != 0.0
            weight[i] = 0.0
        place[0, i] = min(max(px, 0.0), width - 1.0) - (x + i) if px == px else -(x + i)
        place[1, i] = min(max(py, 0.0), height - 1.0) - y if py == py else -y
    return lost


@compiled
def _well_inside(pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats) -> bool:
    """Whether no pixel of the warped subset can leave the picture: its bounding box is inside."""
    height, width = pictures.current.shape[0] - 2 * PAD, pictures.current.shape[1] - 2 * PAD
    terms, half = tables.terms, tables.side // 2
    if pictures.seen.size > 1:
        return False
    for axis in range(2):
        reach = float(half)
        for m in range(1, terms):
            reach += abs(p[axis * terms + m])
        centre = (cx if axis == 0 else cy) + p[axis * terms]
        if not (centre - reach >= 0.0 and centre + reach <= (width if axis == 0 else height) - 1.0):
            return False
    return True


@compiled
def sample(pictures: Pictures, tables: Tables, cx: int, cy: int, p: Floats, work: Work) -> int:
    """Current picture at the warped subset, row by row; returns how many pixels left the picture."""
    side, terms, mono = tables.side, tables.terms, tables.mono
    half, wide = side // 2, (side + 15) // 16 * 16
    place = work.place
    inside = _well_inside(pictures, tables, cx, cy, p)
    lost = 0
    along = work.place[2:]
    for axis in range(2):
        # Steps along a row, alike for all rows but for the product term of second order.
        steps, xi = along[axis, :wide], mono[1 if terms > 1 else 0, :wide]
        slope = np.float32(p[axis * terms + 1] if terms > 1 else 0.0)
        for i in range(wide):
            steps[i] = slope * (xi[i] - xi[0])
    for row in range(side):
        start = row * wide
        x, y = float(cx - half), float(cy - half + row)
        for m in range(terms):
            x += p[m] * mono[m, start]
            y += p[terms + m] * mono[m, start]
        if not (abs(x) < 1e8 and abs(y) < 1e8):
            x, y = 0.0, 0.0
        x0, y0 = np.int64(np.floor(x)), np.int64(np.floor(y))
        fx, fy = np.float32(x - x0), np.float32(y - y0)
        xs, ys, ax, ay = place[0, :wide], place[1, :wide], along[0, :wide], along[1, :wide]
        for i in range(wide):
            xs[i] = fx + ax[i]
        for i in range(wide):
            ys[i] = fy + ay[i]
        for m in range(3, min(terms, 5)):
            a, b = np.float32(p[m]), np.float32(p[terms + m])
            line = mono[m, start : start + wide]
            first = line[0]
            for i in range(wide):
                xs[i] += a * (line[i] - first)
            for i in range(wide):
                ys[i] += b * (line[i] - first)
        if not inside:
            lost += keep_inside(pictures, x0, y0, place, side, work.weight[start : start + side])
        blend_row(pictures.current, tables.basis, y0, x0, place, side, terms <= 3 and inside, work.g[start:])
    return lost
