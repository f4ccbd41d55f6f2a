"""Friction of empty runs from records whose friction is known."""

import numpy as np
import pytest

from ploughval.loadcells.friction import EmptyRun, empty_run, friction_of
from ploughval.loadcells.motion import find_motion
from ploughval.loadcells.response import CellResponse
from ploughval.loadcells.run_log import RunLog
from ploughval.loadcells.zero import zero_of

ONE = CellResponse.constant(np.ones(2), np.zeros(2))


def run(level, *, noise=0.002, own_zero=0.05, ripple=0.0, seed=0, rest=10.0):
    rng = np.random.default_rng(seed)
    t = np.arange(0, 60 + rest, 0.01)
    u = np.clip(t - rest, 0, 50)
    friction = np.where(t > rest, 1 + ripple * np.sin(u), 0.0)
    cells = np.asarray(level)[:, None] * friction + own_zero + rng.normal(0, noise, (2, t.size))
    return t, u, cells


def log(t, u, cells):
    return RunLog("run.csv", t, u, cells, find_motion(u))


def flat_zero():
    return zero_of(np.arange(10.0), np.random.default_rng(0).normal(0, 1e-3, (2, 10)))


def test_friction_of_a_run_is_its_mean_in_motion_less_its_own_zeros():
    found = empty_run(log(*run([1.0, 0.6])), flat_zero(), ONE)
    # 4800 moving and 900 resting rows: 0.002 x sqrt(1/4800 + 1/900) = 7e-5; five of those.
    np.testing.assert_allclose(found.mean, [1.0, 0.6], atol=3.5e-4)
    assert found.own_zero
    assert np.sqrt(np.diag(found.fast_cov)).max() < 0.0006
    assert np.sqrt(np.diag(found.slow_cov)).max() < 0.0006


def test_variation_along_the_travel_is_measured_without_the_noise():
    found = empty_run(log(*run([1.0, 0.6], ripple=0.05, noise=0.02)), flat_zero(), ONE)
    # A sine of amplitude 0.05 over 7.6 periods has a standard deviation of 0.05 / sqrt(2), within 3 %. Parts
    # of 1/48 of 48 mm average 1 mm of it and leave sin(1/2) / (1/2) = 0.959 of the amplitude between them.
    along = found.fast_cov + np.cov(ONE.coefficients @ found.features)
    # Noise of 0.02 in 48 means of 100 rows adds 0.002: 0.15 % of 0.035, 0.4 % of 0.021.
    np.testing.assert_allclose(np.sqrt(np.diag(along)), np.array([1, 0.6]) * 0.03536, rtol=0.05)


def test_a_run_without_rest_uses_the_zeros_given():
    t, u, cells = run([1.0, 0.6], own_zero=0.2)
    zero = zero_of(t[:900], cells[:, :900])
    found = empty_run(log(t[1001:], u[1001:], cells[:, 1001:]), zero, ONE)
    assert not found.own_zero
    np.testing.assert_allclose(found.mean, [1.0, 0.6], atol=5e-4)


def test_a_run_without_motion_is_no_run():
    t, _, cells = run([1.0, 0.6])
    assert empty_run(log(t, np.zeros(t.size), cells), zero_of(t, cells), ONE) is None


def bare(mean):
    """A run that is known by its level alone."""
    spread = np.diag([1e-4, 1e-4])
    return EmptyRun("run", np.asarray(mean)[:, None], np.zeros(1), np.zeros((2, 2)), spread, 1.0, 50.0, True)


@pytest.mark.parametrize("count", [2, 4, 10])
def test_the_covariance_is_that_of_one_further_run_about_the_mean(count):
    rng = np.random.default_rng(count)
    errors, variances = [], []
    for _ in range(3000):
        levels = 1.0 + 0.1 * rng.normal(size=count + 1)
        found = friction_of([bare([level, 0.6 * level]) for level in levels[:-1]], ONE)
        errors.append(levels[-1] - found.mean[0, 0])
        variances.append(found.cov[0, 0])
        assert found.dof == count - 1
    # Both are 0.01 (1 + 1/n); the scatter of 3000 draws is at most sqrt(2 / 3000) = 2.6 %, of both 3.7 %.
    assert np.mean(variances) / np.var(errors) == pytest.approx(1.0, abs=0.15)


def test_a_single_run_falls_back_on_its_own_variation():
    found = friction_of([bare([1.0, 0.6])], ONE)
    np.testing.assert_array_equal(found.cov, np.diag([1e-4, 1e-4]))
