"""The compiled kernel against a plain numpy twin: same formulae, no shared code but the spline."""

import numpy as np
import pytest
from scipy.ndimage import correlate1d, spline_filter

from ploughval.axes import Status
from ploughval.piv.interpolate import (
    PAD,
    SlopeFilter,
    basis_polynomials,
    filtered,
    plain_planes,
    spline_coefficients,
)
from ploughval.piv.subsets import ALL_SEEN, Pair, Recipe, match


def interpolate(coefficients, x, y, spline):
    """B-spline value at (x, y) from mirrored coefficients."""
    table = basis_polynomials(spline)
    ix, iy = np.floor(x).astype(int), np.floor(y).astype(int)
    wx, wy = (table @ (t - i) ** np.arange(spline + 1)[:, None] for t, i in ((x, ix), (y, iy)))
    total = np.zeros_like(x)
    for j in range(spline + 1):
        for i in range(spline + 1):
            nodes = coefficients[iy + j - spline // 2 + PAD, ix + i - spline // 2 + PAD]
            total += wy[j] * wx[i] * nodes
    return total


def slopes_of(image, spline):
    """Slopes of a picture behind a windowed low pass at 0.3 cycles a px."""
    taps = np.sinc(0.6 * np.arange(-6, 7)) * np.hamming(13)
    taps /= taps.sum()
    smooth = correlate1d(correlate1d(image.astype(float), taps, 0, mode="mirror"), taps, 1, mode="mirror")
    c = spline_filter(smooth, spline, mode="mirror")
    table = basis_polynomials(spline)[:-1]
    out = []
    for axis in (1, 0):
        values = correlate1d(c, table[:, 0], 1 - axis, mode="mirror")
        out.append(correlate1d(values, table[:, 1], axis, mode="mirror"))
    return out


def twin(first, current, centre, recipe):
    """Inverse-compositional Gauss-Newton written out for one subset; parameters about its centre, px."""
    half = recipe.half
    offset = np.arange(-half, half + 1.0)
    dx, dy = (a.ravel() for a in np.meshgrid(offset, offset))
    c1 = np.pad(spline_filter(current.astype(float), recipe.spline, mode="mirror"), PAD, mode="reflect")
    rows, columns = (centre[1] + dy).astype(int), (centre[0] + dx).astype(int)
    fx, fy = (s[rows, columns] for s in slopes_of(first, recipe.spline))
    f = first[rows, columns].astype(float)
    f = f - f.mean()
    shape = np.stack([dx**0, dx, dy, dx * dx, dx * dy, dy * dy][: recipe.terms], axis=1)
    jac = np.concatenate([fx[:, None] * shape, fy[:, None] * shape], axis=1)
    p = np.zeros((2, recipe.terms))
    for _ in range(200):
        x, y = centre[0] + dx + shape @ p[0], centre[1] + dy + shape @ p[1]
        g = interpolate(c1, x, y, recipe.spline)
        g = g - g.mean()
        residual = f - np.linalg.norm(f) / np.linalg.norm(g) * g
        step = -np.linalg.lstsq(jac, residual, rcond=None)[0].reshape(2, recipe.terms)
        p = composed(p, step, dx, dy, shape)
        if np.abs(step[:, 0]).max() < 1e-8:
            break
    return p, float(f @ g / np.linalg.norm(f) / np.linalg.norm(g))


def composed(p, step, dx, dy, shape):
    """Parameters of x -> W(x; p) after the inverse of x -> W(x; step), fitted to pixels."""
    sx, sy = dx + shape @ step[0], dy + shape @ step[1]
    moved = np.stack([sx**0, sx, sy, sx * sx, sx * sy, sy * sy][: shape.shape[1]], axis=1)
    both = zip((dx, dy), p, (sx, sy), strict=True)
    return np.stack([np.linalg.lstsq(moved, d + shape @ q - s, rcond=None)[0] for d, q, s in both])


def pair_of(first, current, recipe):
    planes = filtered(plain_planes(first, recipe.spline), recipe.slopes)
    usable = np.ones(first.shape, np.uint8)
    return Pair(planes, usable, spline_coefficients(current, recipe.spline), ALL_SEEN, recipe)


@pytest.mark.parametrize("spline", [3, 5])
@pytest.mark.parametrize(("order", "side"), [(0, 21), (1, 21), (1, 35), (2, 31)])
def test_kernel_agrees_with_its_numpy_twin(sand, spline, order, side):
    gradient = np.array([[0.02, 0.03], [-0.01, 0.015]]) * (order > 0)
    first = sand.picture(noise=2, seed=1)
    current = sand.picture(lambda p: (p - 110) @ gradient.T + [0.4, -0.3], noise=2, seed=2)
    recipe = Recipe(side, order, spline, SlopeFilter.NARROW)
    centres = np.array([[80, 90], [150, 60], [120, 140]])
    guess = np.zeros((3, 2, recipe.terms))
    fit = match(pair_of(first, current, recipe), centres.astype(float), guess)
    assert (fit.status == Status.OK).all()
    for n, centre in enumerate(centres):
        p, zncc = twin(first, current, centre, recipe)
        power = np.array([0, 1, 1, 2, 2, 2])[: recipe.terms]
        mine = fit.params[n] / recipe.half**power
        # The kernel stops when no corner moves by 5e-4 px or a hundredth of the noise, the twin at 1e-8.
        assert mine[:, 0] == pytest.approx(p[:, 0], abs=6e-4 if order < 2 else 2e-3)
        assert mine[:, 1:3] == pytest.approx(p[:, 1:3], abs=1e-4)
        assert fit.zncc[n] == pytest.approx(zncc, abs=2e-5)


def test_second_order_reduces_to_first_on_affine_motion(sand):
    first, current = sand.picture(), sand.picture(lambda p: (p - 110) * [0.02, -0.01])
    fits = []
    for order in (1, 2):
        recipe = Recipe(31, order, 5)
        pair = pair_of(first, current, recipe)
        fits.append(match(pair, np.array([[120.0, 100.0]]), np.zeros((1, 2, recipe.terms))).params[0])
    assert fits[1][:, 0] == pytest.approx(fits[0][:, 0], abs=0.01)
    assert np.abs(fits[1][:, 3:]).max() < 0.02
