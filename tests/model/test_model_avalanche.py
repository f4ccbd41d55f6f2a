"""What docs/theory-model-avalanche.md proves of the paper's pairwise rule, on grids."""

import numpy as np
import pytest
from numba import njit
from scipy.optimize import isotonic_regression

from ploughval.model.surface import area_ahead, avalanche


@njit
def swept(g, weight, order, tolerance):
    """Eq. (4) applied to the pairs in an order, again and again, until none falls; and the sweeps."""
    sweeps = 0
    while True:
        worst = 0.0
        for i in order:
            fall = g[i] - g[i + 1]
            if fall > 0.0:
                mean = (weight[i] * g[i] + weight[i + 1] * g[i + 1]) / (weight[i] + weight[i + 1])
                g[i] = g[i + 1] = mean
                worst = max(worst, fall)
        sweeps += 1
        if worst <= tolerance:
            return sweeps


def grid(seed, nodes=40):
    """Places, heights and the widths that nodes stand for."""
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.uniform(0.5, 1.5, nodes))
    y = 20.0 + np.cumsum(rng.normal(0.0, 0.8, nodes))
    edges = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
    return x, y, np.diff(edges)


@pytest.mark.parametrize("seed", range(4))
def test_pairwise_rule_ends_at_the_isotonic_regression_in_whatever_order(seed):
    x, y, weight = grid(seed)
    g = y + 0.6 * x
    expected = isotonic_regression(g, weights=weight).x
    rng = np.random.default_rng(seed)
    pairs = np.arange(len(x) - 1)
    for order in (pairs, pairs[::-1].copy(), rng.permutation(pairs)):
        rested = g.copy()
        swept(rested, weight, order, 1e-12)
        np.testing.assert_allclose(rested, expected, atol=1e-9)
        assert weight @ rested == pytest.approx(weight @ g, rel=1e-12)


def test_every_step_of_the_pairwise_rule_lowers_the_summed_area_and_stays_above_its_convex_minorant():
    x, y, weight = grid(7)
    g = y + 0.6 * x
    least = np.cumsum(weight * isotonic_regression(g, weights=weight).x)
    before = np.cumsum(weight * g)
    order = np.random.default_rng(7).permutation(np.arange(len(x) - 1))
    for _ in range(20):
        swept(g, weight, order[:5], np.inf)
        order = np.roll(order, -5)
        after = np.cumsum(weight * g)
        assert np.all(after <= before + 1e-9)
        assert np.all(after >= least - 1e-9)
        before = after


def test_error_of_a_grid_vanishes_with_its_spacing():
    surface = np.array([(0.0, 8.0), (6.0, 9.0), (7.0, 4.0), (9.0, 5.0), (10.0, 2.0), (20.0, 2.0)])
    repose = np.tan(np.radians(32.0))
    errors = []
    for nodes in (51, 201, 801):
        x = np.linspace(0.0, 20.0, nodes)
        weight = np.full(nodes, x[1])
        weight[[0, -1]] *= 0.5
        rested = isotonic_regression(np.interp(x, *surface.T) + repose * x, weights=weight).x - repose * x
        errors.append(np.abs(rested - np.interp(x, *avalanche(surface, 32.0).T)).max())
    assert errors[1] < 0.35 * errors[0]
    assert errors[2] < 0.35 * errors[1]


def test_sweeps_grow_with_the_square_of_the_segments_as_an_iteration_for_a_straight_line():
    # Eq. (8): a step in the middle; its slope at rest covers as many segments as it has height over slope
    counts = []
    for segments in (20.0, 40.0, 80.0):
        nodes = int(6 * segments)
        g = np.where(np.arange(nodes) < nodes // 2, segments, 0.0) + np.arange(nodes)
        counts.append(swept(g, np.ones(nodes), np.arange(nodes - 1), 1e-6) / segments**2)
    np.testing.assert_allclose(counts, np.log(1e6) / np.pi**2, rtol=0.1)


@njit
def both_ways(y, limit, order):
    """The rule on rising and falling segments of width 1, again and again."""
    moved = True
    while moved:
        moved = False
        for i in order:
            excess = abs(y[i] - y[i + 1]) - limit
            if excess > 1e-9:
                way = 0.5 if y[i] > y[i + 1] else -0.5
                y[i] -= way * excess
                y[i + 1] += way * excess
                moved = True


def test_rest_of_a_hill_too_steep_on_both_sides_depends_on_the_order_of_the_segments():
    x = np.arange(-20.0, 21.0)
    spike = np.maximum(12.0 - 4.0 * np.abs(x), 0.0)
    order = np.arange(len(x) - 1)
    first, second = spike.copy(), spike.copy()
    both_ways(first, 0.6, order)
    both_ways(second, 0.6, order[::-1].copy())
    np.testing.assert_allclose(first, second[::-1], atol=1e-6)
    assert np.abs(first - second).max() > 0.05


def test_hill_too_steep_on_both_sides_keeps_its_area_and_comes_to_rest_beside_its_middle():
    spike = np.array([(0.0, 5.0), (8.5, 5.0), (10.0, 11.0), (11.5, 5.0), (20.0, 5.0)])
    rested = avalanche(spike, 32.0)
    assert area_ahead(rested) == pytest.approx(area_ahead(spike), rel=1e-12)
    assert rested[np.argmax(rested[:, 1]), 0] == pytest.approx(10.0 + 0.48, abs=0.01)
    slopes = np.diff(rested[:, 1]) / np.diff(rested[:, 0])
    assert np.abs(slopes).max() == pytest.approx(np.tan(np.radians(32.0)), rel=1e-9)
