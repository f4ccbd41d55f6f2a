"""Corners of straight flanks, exact and noisy."""

import numpy as np
import pytest

from ploughval.compare.force.corner import find_corner
from ploughval.compare.force.curve import Curve

STEP = 0.05


def averaged(corner_u, height, left, right, noise=0.0, seed=0):
    """Means over steps of travel of two lines that meet at a corner, from 20 rows a step."""
    fine = np.arange(0, 20, STEP / 20) + STEP / 40
    force = height + np.where(fine < corner_u, left, right) * (fine - corner_u)
    u, means = (values.reshape(-1, 20).mean(axis=1) for values in (fine, force))
    means = means + np.random.default_rng(seed).normal(0, noise, means.size)
    return Curve(u, means, np.full(u.size, noise), np.zeros(u.size), STEP)


@pytest.mark.parametrize("corner_u", [10.0, 10.01, 10.024, 10.049])
def test_a_corner_between_points_is_exact_without_noise(corner_u):
    curve = averaged(corner_u, 20.0, 0.5, -9.0)
    k = int(np.argmax(curve.force_N))
    corner = find_corner(curve, (k, k), 0, curve.u_mm.size - 1)
    assert corner.u_mm == pytest.approx(corner_u, abs=1e-9)
    assert corner.force_N == pytest.approx(20.0, abs=1e-9)
    assert curve.force_N.max() < 20.0 or corner_u == 10.0


def test_noise_leaves_no_bias_and_the_stated_deviations():
    found = []
    for seed in range(200):
        curve = averaged(10.02, 20.0, 0.5, -9.0, noise=0.03, seed=seed)
        found.append(find_corner(curve, (195, 202), 0, curve.u_mm.size - 1))
    kept = [corner for corner in found if corner is not None]
    assert len(kept) > 190
    z_u = np.array([(c.u_mm - 10.02) / c.u_std_mm for c in kept])
    z_force = np.array([(c.force_N - 20.0) / c.force_std_N for c in kept])
    # 200 draws: a mean of z scatters by 0.07, its deviation by 5 %; choosing the parting point adds some.
    for z in (z_u, z_force):
        assert abs(z.mean()) < 0.3
        assert 0.6 < z.std() < 1.4


def test_at_the_start_the_line_ahead_is_carried_back():
    u = STEP * (np.arange(50) + 0.5)
    curve = Curve(u, 12.0 - 6.0 * u, np.full(50, 0.01), np.zeros(50), STEP)
    corner = find_corner(curve, (0, 0), 0, 49)
    assert corner.u_mm == 0.0
    assert corner.force_N == pytest.approx(12.0, abs=1e-9)


def test_a_straight_line_has_no_corner():
    u = STEP * (np.arange(50) + 0.5)
    assert find_corner(Curve(u, 3 * u, np.zeros(50), np.zeros(50), STEP), (25, 25), 0, 49) is None
