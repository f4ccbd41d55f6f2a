"""Zeros, noise and friction from records with known offsets."""

import numpy as np
import pytest

from ploughval.loadcells.friction import EmptyRun, empty_run, mean_friction
from ploughval.loadcells.zero import zero_of


def test_zeros_and_noise_are_those_put_in():
    rng = np.random.default_rng(0)
    cov = np.array([[4e-6, 2e-6], [2e-6, 9e-6]])
    cells = np.array([[0.3], [-0.1]]) + np.linalg.cholesky(cov) @ rng.normal(size=(2, 20000))
    zero = zero_of(np.arange(20000) * 1e-3, cells)
    np.testing.assert_allclose(zero.mean, [0.3, -0.1], atol=4 * np.sqrt(9e-6 / 20000))
    # Relative scatter of a variance from n samples: sqrt(2 / n) = 1 %; four of those.
    np.testing.assert_allclose(zero.noise_cov, cov, rtol=0.06)
    np.testing.assert_allclose(zero.mean_cov, zero.noise_cov / 20000, rtol=1e-12)
    assert not zero.drifts


def test_correlated_noise_widens_the_zeros_but_white_noise_does_not():
    rng = np.random.default_rng(1)
    slow = np.cumsum(rng.normal(size=(2, 20000)), axis=1) * 1e-4
    zero = zero_of(np.arange(20000.0), slow)
    assert (np.diag(zero.mean_cov) > 20 * np.diag(zero.noise_cov) / 20000).all()


def test_drift_is_noted_and_its_size_is_right():
    rng = np.random.default_rng(2)
    t = np.linspace(0, 10, 5000)
    cells = np.stack([0.002 * t, 0 * t]) + rng.normal(0, 0.003, (2, t.size))
    zero = zero_of(t, cells)
    assert zero.drifts
    assert zero.drift[0] == pytest.approx(0.02, abs=4 * zero.drift_std[0])
    assert abs(zero.drift[1]) < 4 * zero.drift_std[1]


def test_two_rows_are_no_rest():
    assert zero_of(np.arange(2.0), np.ones((2, 2))) is None


def run(level, *, noise=0.002, own_zero=0.05, ripple=0.0, seed=0, rest=10.0):
    rng = np.random.default_rng(seed)
    t = np.arange(0, 60 + rest, 0.01)
    u = np.clip(t - rest, 0, 50)
    friction = np.where(t > rest, 1 + ripple * np.sin(u), 0.0)
    cells = np.asarray(level)[:, None] * friction + own_zero + rng.normal(0, noise, (2, t.size))
    return t, u, cells


def test_friction_of_a_run_is_its_mean_in_motion_less_its_own_zeros():
    flat = zero_of(np.arange(10.0), np.random.default_rng(0).normal(0, 1e-3, (2, 10)))
    found = empty_run(*run([1.0, 0.6]), flat)
    # 4800 moving and 900 resting rows: 0.002 x sqrt(1/4800 + 1/900) = 7e-5; five of those.
    np.testing.assert_allclose(found.mean, [1.0, 0.6], atol=3.5e-4)
    assert found.own_zero
    assert np.sqrt(np.diag(found.variation_cov)).max() < 0.0006


def test_variation_along_the_travel_is_measured_without_the_noise():
    flat = zero_of(np.arange(10.0), np.random.default_rng(0).normal(0, 1e-3, (2, 10)))
    found = empty_run(*run([1.0, 0.6], ripple=0.05, noise=0.02), flat)
    # A sine of amplitude 0.05 over 7.6 periods has a standard deviation of 0.05 / sqrt(2), within 3 %.
    np.testing.assert_allclose(np.sqrt(np.diag(found.variation_cov)), np.array([1, 0.6]) * 0.03536, rtol=0.05)


def test_a_run_without_rest_uses_the_zeros_given():
    t, u, cells = run([1.0, 0.6], own_zero=0.2)
    zero = zero_of(t[:900], cells[:, :900])
    found = empty_run(t[1001:], u[1001:], cells[:, 1001:], zero)
    assert not found.own_zero
    np.testing.assert_allclose(found.mean, [1.0, 0.6], atol=5e-4)


def test_a_run_without_motion_is_no_run():
    t, _, cells = run([1.0, 0.6])
    assert empty_run(t, np.zeros(t.size), cells, zero_of(t, cells)) is None


def bare(mean):
    return EmptyRun(np.asarray(mean), np.zeros((2, 2)), np.diag([1e-4, 1e-4]), 100, True)


@pytest.mark.parametrize("count", [2, 4, 10])
def test_the_covariance_is_that_of_one_further_run_about_the_mean(count):
    rng = np.random.default_rng(count)
    errors, variances = [], []
    for _ in range(3000):
        levels = 1.0 + 0.1 * rng.normal(size=count + 1)
        found = mean_friction([bare([level, 0.6 * level]) for level in levels[:-1]])
        errors.append(levels[-1] - found.mean[0])
        variances.append(found.cov[0, 0])
        assert found.dof == count - 1
    # Both are 0.01 (1 + 1/n); the scatter of 3000 draws is at most sqrt(2 / 3000) = 2.6 %, of both 3.7 %.
    assert np.mean(variances) / np.var(errors) == pytest.approx(1.0, abs=0.15)


def test_a_single_run_falls_back_on_its_own_variation():
    found = mean_friction([bare([1.0, 0.6])])
    np.testing.assert_array_equal(found.cov, np.diag([1e-4, 1e-4]))
