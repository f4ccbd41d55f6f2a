"""The surface: area, the block's motion, the avalanche against the paper's pairwise rule swept to rest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import isotonic_regression

from ploughval.model.surface import area_ahead, avalanche, height_at, move_block, thin


def pairwise_to_rest(surface, repose_deg, sweeps=200_000):
    """Eqs (4) and (5) of the paper to the letter, for falling slopes, swept until every slope is at rest."""
    x, y = surface.T.copy()
    limit = np.tan(np.radians(repose_deg))
    dx = np.diff(x)
    for _ in range(sweeps):
        moved = False
        for i in range(len(dx)):
            excess = (y[i] - y[i + 1]) / dx[i] - limit
            if excess > 1e-9:
                left = dx[i - 1] if i > 0 else 0.0
                right = dx[i + 1] if i + 1 < len(dx) else 0.0
                total = 2 * dx[i] + right + left
                # the node at the top goes down by the width on the other side, so that the area stays
                y[i] -= dx[i] * (right + dx[i]) * excess / total
                y[i + 1] += dx[i] * (left + dx[i]) * excess / total
                moved = True
        if not moved:
            return np.column_stack([x, y])
    raise AssertionError("the pairwise rule did not come to rest")


def noisy(seed, nodes=60, height=4.0):
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.uniform(0.2, 1.8, nodes))
    return np.column_stack([x, 20.0 + rng.normal(0.0, height, nodes)])


def test_pairwise_rule_of_the_paper_comes_to_the_same_rest():
    # a steep front, nodes 0.25 mm apart; the oracle cuts at nodes only: half a spacing of slope is left
    x = np.arange(0.0, 20.001, 0.25)
    surface = np.column_stack([x, np.where(x < 10.0, 8.0, 5.0)])
    literal, direct = pairwise_to_rest(surface, 32.0), avalanche(surface, 32.0)
    assert area_ahead(literal) == pytest.approx(area_ahead(surface), rel=1e-9)
    ours = np.interp(x, *direct.T)
    np.testing.assert_allclose(ours, literal[:, 1], atol=0.5 * 0.25 * np.tan(np.radians(32.0)))
    assert np.abs(ours - surface[:, 1]).max() > 1.0


def test_step_is_cut_through_its_middle():
    # closed form: a step of height h becomes a slope of width h / tan(repose), centred on it
    h, repose = 3.0, 30.0
    width = h / np.tan(np.radians(repose))
    rested = avalanche([(0, 8.0), (10.0 - 1e-9, 8.0), (10.0 + 1e-9, 5.0), (20, 5.0)], repose)
    expected = [(0, 8.0), (10 - width / 2, 8.0), (10 + width / 2, 5.0), (20, 5.0)]
    np.testing.assert_allclose(rested, expected, atol=1e-7)


@pytest.mark.parametrize("seed", range(6))
def test_falling_slopes_are_the_isotonic_regression(seed):
    # the same cut by another algorithm on a fine grid; tolerance: grid width times the slopes of the noise
    surface, repose = noisy(seed, nodes=30), 40.0
    slope = np.tan(np.radians(repose))
    x = np.linspace(*surface[[0, -1], 0], 40_001)
    g = np.interp(x, *surface.T) + slope * x
    falling_only = isotonic_regression(g).x - slope * x
    mirrored = isotonic_regression((falling_only - slope * x)[::-1]).x[::-1] + slope * x
    np.testing.assert_allclose(np.interp(x, *avalanche(surface, repose).T), mirrored, atol=0.02)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), repose=st.floats(5.0, 80.0), scale=st.sampled_from([1e-2, 1.0, 1e3]))
def test_avalanche_keeps_area_and_leaves_no_steep_slope(seed, repose, scale):
    surface = noisy(seed) * scale
    rested = avalanche(surface, repose)
    assert area_ahead(rested) == pytest.approx(area_ahead(surface), rel=1e-10)
    assert np.all(np.diff(rested[:, 0]) > 0)
    slopes = np.abs(np.diff(rested[:, 1]) / np.diff(rested[:, 0]))
    assert slopes.max() <= np.tan(np.radians(repose)) * (1 + 1e-6)
    np.testing.assert_allclose(avalanche(rested, repose)[:, 1].max(), rested[:, 1].max(), rtol=1e-9)


def test_surface_at_rest_is_left_alone():
    surface = np.array([(0.0, 5.0), (3.0, 6.0), (9.0, 4.0), (20.0, 4.0)])
    assert np.array_equal(avalanche(surface, 32.0), surface)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), share=st.floats(0.05, 0.95), du=st.floats(1e-6, 5.0))
def test_block_motion_loses_only_the_triangle_at_the_tip(seed, share, du):
    surface = noisy(seed, height=0.5)
    face, end = surface[0, 0], surface[-1, 0]
    outcrop = face + share * (end - face - 6.0)
    x, y = np.ascontiguousarray(surface.T)
    tan_beta = height_at(x, y, len(x), outcrop) / (outcrop - face)
    du = min(du, 0.9 * (outcrop - face))
    moved = move_block(surface, outcrop, tan_beta, du)
    lost = area_ahead(surface) - area_ahead(moved)
    assert lost == pytest.approx(0.5 * du**2 * tan_beta, abs=1e-10 * area_ahead(surface))
    assert moved[0, 0] == pytest.approx(face + du, abs=1e-12)
    assert np.all(np.diff(moved[:, 0]) > 0)


def test_block_moves_rigidly_left_of_the_outcrop_and_sand_ahead_stays():
    surface = np.array([(0.0, 30.0), (20.0, 31.0), (50.0, 30.0), (80.0, 30.0), (120.0, 29.0), (200.0, 29.0)])
    moved = move_block(surface, 80.0, 30.0 / 80.0, 2.0)
    np.testing.assert_allclose(moved[:3], surface[:3] + np.array([2.0, 0.75]), atol=1e-12)
    np.testing.assert_allclose(moved[-2:], surface[-2:], atol=1e-12)
    # between the outcrop and its moved image the block's columns stand on the sand ahead
    assert np.interp(80.0, *moved.T) == pytest.approx(30.0 + 0.75, abs=1e-12)
    assert np.interp(82.0, *moved.T) == pytest.approx(np.interp(82.0, *surface.T), abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_thinning_keeps_the_area_and_the_shape(seed):
    surface = noisy(seed, nodes=200, height=0.01)
    x, y = surface.T.copy()
    n = thin(x, y, len(x), 0.02)
    thinned = np.column_stack([x[:n], y[:n]])
    assert n < 0.8 * len(surface)
    assert area_ahead(thinned) == pytest.approx(area_ahead(surface), rel=1e-10)
    assert np.abs(np.interp(surface[:, 0], *thinned.T) - surface[:, 1]).max() < 0.08
    np.testing.assert_array_equal(thinned[[0, -1], 0], surface[[0, -1], 0])
