"""The compiled kernel against a plain numpy twin: same formulae, no shared code but the spline."""

import numpy as np
import pytest
from scipy.ndimage import spline_filter

from ploughval.axes import Status
from ploughval.piv.interpolate import PAD, basis_polynomials, node_taps, spline_coefficients
from ploughval.piv.subsets import Pair, Recipe, match


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


def twin(first, current, centre, recipe):
    """Inverse-compositional affine Gauss-Newton written out for one subset; parameters about its centre."""
    half = recipe.half
    offset = np.arange(-half, half + 1.0)
    dx, dy = (a.ravel() for a in np.meshgrid(offset, offset))
    c0 = np.pad(spline_filter(first.astype(float), recipe.spline, mode="mirror"), PAD, mode="reflect")
    c1 = np.pad(spline_filter(current.astype(float), recipe.spline, mode="mirror"), PAD, mode="reflect")
    value, smooth, slope, _ = node_taps(recipe.spline, recipe.smooth_px)
    reach = len(value) // 2

    def taps(down, along):
        rows = [centre[1] + int(v) + PAD for v in dy]
        columns = [centre[0] + int(v) + PAD for v in dx]
        windows = [
            c0[r - reach : r + reach + 1, c - reach : c + reach + 1]
            for r, c in zip(rows, columns, strict=True)
        ]
        return np.array([down @ w @ along for w in windows])

    f, fx, fy = taps(value, value), taps(smooth, slope), taps(slope, smooth)
    f = f - f.mean()
    jac = np.stack([fx, fx * dx, fx * dy, fy, fy * dx, fy * dy], axis=1)
    p = np.zeros(6)
    for _ in range(200):
        x, y = centre[0] + dx + p[:3] @ [dx**0, dx, dy], centre[1] + dy + p[3:] @ [dx**0, dx, dy]
        g = interpolate(c1, x, y, recipe.spline)
        g = g - g.mean()
        residual = f - np.linalg.norm(f) / np.linalg.norm(g) * g
        step = -np.linalg.lstsq(jac, residual, rcond=None)[0]
        warp = np.array([[1 + p[1], p[2], p[0]], [p[4], 1 + p[5], p[3]], [0, 0, 1]])
        back = np.array([[1 + step[1], step[2], step[0]], [step[4], 1 + step[5], step[3]], [0, 0, 1]])
        new = warp @ np.linalg.inv(back)
        p = np.array([new[0, 2], new[0, 0] - 1, new[0, 1], new[1, 2], new[1, 0], new[1, 1] - 1])
        if np.abs(step * [1, half, half, 1, half, half]).max() < 1e-7:
            break
    return p, float(f @ g / np.linalg.norm(f) / np.linalg.norm(g))


@pytest.mark.parametrize("spline", [3, 5])
def test_kernel_agrees_with_its_numpy_twin(sand, spline):
    gradient = np.array([[0.02, 0.03], [-0.01, 0.015]])
    first = sand.picture(noise=2, seed=1)
    current = sand.picture(lambda p: (p - 110) @ gradient.T + [0.4, -0.3], noise=2, seed=2)
    recipe = Recipe(21, 1, spline)
    centres = np.array([[80, 90], [150, 60], [120, 140]])
    usable = np.ones(sand.shape, np.uint8)
    pair = Pair(spline_coefficients(first, spline), spline_coefficients(current, spline), usable, recipe)
    fit = match(pair, centres.astype(float), np.zeros((3, 2, 3)))
    assert (fit.status == Status.OK).all()
    for n, centre in enumerate(centres):
        p, zncc = twin(first, current, centre, recipe)
        mine = fit.params[n] / [1, recipe.half, recipe.half]
        # The kernel stops at steps of 3e-4 px at the corner, the twin at 1e-7.
        assert mine[:, 0] == pytest.approx(p[[0, 3]], abs=4e-4)
        assert mine[:, 1:] == pytest.approx(p[[[1, 2], [4, 5]]], abs=4e-5)
        assert fit.zncc[n] == pytest.approx(zncc, abs=1e-5)


def test_second_order_reduces_to_first_on_affine_motion(sand):
    first, current = sand.picture(), sand.picture(lambda p: (p - 110) * [0.02, -0.01])
    fits = []
    for order in (1, 2):
        recipe = Recipe(31, order, 5)
        usable = np.ones(sand.shape, np.uint8)
        pair = Pair(spline_coefficients(first, 5), spline_coefficients(current, 5), usable, recipe)
        fits.append(match(pair, np.array([[120.0, 100.0]]), np.zeros((1, 2, recipe.terms))).params[0])
    assert fits[1][:, 0] == pytest.approx(fits[0][:, 0], abs=0.01)
    assert np.abs(fits[1][:, 3:]).max() < 0.02
