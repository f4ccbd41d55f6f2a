"""Friction of empty runs from records whose friction is known."""

from dataclasses import replace

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


TRAVEL = 100.0
MIDDLES = (np.arange(48) + 0.5) / 48 * TRAVEL
PROFILES = {
    "flat": lambda u: 0 * u,
    "ramp": lambda u: 0.2 * (u / TRAVEL - 0.5),
    "wave": lambda u: 0.1 * np.sin(2 * np.pi * u / 25),
}


def made(rng, profile, *, level=0.05, own=0.02, name="run"):
    """A run of friction 1 N m (0.6 at the lower cell) whose level and shape scatter by these shares."""
    along = 1 + level * rng.normal() + PROFILES[profile](MIDDLES) + own * rng.normal(size=48)
    features = np.array([[1.0], [0.6]]) * along + 0.002 * rng.normal(size=(2, 48))
    return EmptyRun(name, features, MIDDLES, np.diag([1e-9, 1e-9]), np.cov(features), 1.0, TRAVEL, True)


def shape_error(run, features):
    """Standard deviation along the travel of what is left of a run, upper cell, its level taken off."""
    return float((run.features - features)[0].std())


@pytest.mark.parametrize("count", [2, 3, 5])
@pytest.mark.parametrize(("profile", "truth", "most"), [("ramp", 0.058, 0.025), ("wave", 0.0707, 0.030)])
def test_friction_is_followed_along_the_travel_where_the_runs_repeat(count, profile, truth, most):
    rng = np.random.default_rng(count)
    along, by_mean, stated = [], [], []
    for _ in range(200):
        *runs, test = (made(rng, profile) for _ in range(count + 1))
        found = friction_of(runs, ONE)
        assert found.features.shape[1] > 1
        assert "against the travel" in found.reason
        along.append(shape_error(test, found.at(MIDDLES)))
        by_mean.append(shape_error(test, found.mean))
        stated.append(found.variation_cov[0, 0])
    # A run's own 0.02 with the others' 0.02 / sqrt(n) smoothed; a ramp of 20 % has 0.2 / sqrt(12).
    error = np.sqrt(np.mean(np.square(along)))
    assert error < most
    assert np.mean(by_mean) == pytest.approx(np.hypot(truth, 0.02), rel=0.03)
    # The left-out error is that of predictions from one run fewer: up to a tenth more with two runs.
    assert 0.97 <= np.sqrt(np.mean(stated)) / error <= 1.12


@pytest.mark.parametrize("count", [2, 3, 5])
@pytest.mark.parametrize("own", [0.02, 0.1])
def test_the_mean_is_kept_where_friction_along_the_travel_does_not_repeat(count, own):
    rng = np.random.default_rng(count)
    stated, error = [], []
    for _ in range(200):
        *runs, test = (made(rng, "flat", own=own) for _ in range(count + 1))
        found = friction_of(runs, ONE)
        assert found.features.shape[1] == 1
        assert found.reason.startswith("the mean: the others predict a run left out to")
        stated.append(found.variation_cov[0, 0])
        error.append(shape_error(test, found.mean) ** 2)
    # 48 parts of 200 runs: a standard deviation scatters by less than 1 %.
    assert np.sqrt(np.mean(stated) / np.mean(error)) == pytest.approx(1.0, abs=0.03)


def test_beyond_the_runs_friction_is_as_at_their_end():
    rng = np.random.default_rng(0)
    found = friction_of([made(rng, "ramp", own=0.0) for _ in range(3)], ONE)
    ends = found.at(np.array([-5.0, MIDDLES[0], MIDDLES[-1], 300.0]))
    np.testing.assert_allclose(ends[:, [0, 3]], found.features[:, [0, -1]])


def test_one_run_keeps_the_mean_and_says_why():
    found = friction_of([made(np.random.default_rng(0), "ramp")], ONE)
    assert found.features.shape == (2, 1)
    assert "one run" in found.reason
    assert (found.runs, found.dof) == (1, np.inf)


def test_gaps_in_a_run_do_not_move_the_profile():
    rng = np.random.default_rng(1)
    whole = [made(rng, "ramp", level=0.0, own=0.0) for _ in range(3)]
    gappy = [replace(run, features=run.features.copy()) for run in whole]
    for run, lost in zip(gappy, (slice(10, 14), slice(0, 3), slice(40, 48)), strict=True):
        run.features[:, lost] = np.nan
    full, holed = friction_of(whole, ONE), friction_of(gappy, ONE)
    assert "against the travel" in holed.reason
    # The end of one run stands still over 8 of 48 parts of a ramp of 0.2: its last part is off by 0.033, a
    # third of that in the mean of three.
    np.testing.assert_allclose(holed.at(MIDDLES), full.at(MIDDLES), atol=0.033 / 3 + 0.004)


def test_a_short_run_does_not_shorten_what_the_others_show():
    rng = np.random.default_rng(2)
    runs = [made(rng, "ramp", level=0.0) for _ in range(3)]
    half = replace(runs[1], u_mm=MIDDLES / 2, features=runs[1].features - 0.05)
    found = friction_of([runs[0], half, runs[2]], ONE)
    assert "against the travel" in found.reason
    assert found.u_mm.max() > 0.8 * TRAVEL
    # What is left is a third run's own 0.02 about the mean of two in at most 48 parts.
    assert shape_error(made(rng, "ramp", level=0.0), found.at(MIDDLES)) < 0.03
    assert found.runs == 3


def test_with_a_single_long_run_the_travel_that_all_share_is_followed():
    rng = np.random.default_rng(2)
    runs = [made(rng, "wave", level=0.0) for _ in range(2)]
    runs[1] = replace(runs[1], u_mm=MIDDLES / 2, features=made(rng, "wave", level=0.0).features)
    assert friction_of(runs, ONE).u_mm.max() <= TRAVEL / 2


def test_runs_without_a_common_travel_keep_the_mean_and_their_variation():
    rng = np.random.default_rng(3)
    runs = [made(rng, "ramp", level=0.0) for _ in range(2)]
    runs[1] = replace(runs[1], u_mm=MIDDLES + 200)
    found = friction_of(runs, ONE)
    assert found.features.shape == (2, 1)
    assert "too little travel" in found.reason
    # A ramp of 0.2 over the travel has a standard deviation of 0.058.
    assert np.sqrt(found.variation_cov[0, 0]) == pytest.approx(np.hypot(0.058, 0.02), rel=0.25)


def test_a_ramp_is_followed_from_logs_too():
    def ramp_log(seed):
        rng = np.random.default_rng(seed)
        t = np.arange(0, 70, 0.01)
        u = np.clip(t - 10, 0, 50)
        level = np.where(t > 10, 1 + 0.02 * rng.normal() + 0.2 * (u / 50 - 0.5), 0.0)
        return log(t, u, np.array([[1.0], [0.6]]) * level + 0.05 + rng.normal(0, 0.002, (2, t.size)))

    runs = [empty_run(ramp_log(seed), flat_zero(), ONE) for seed in range(3)]
    found = friction_of(runs, ONE)
    assert "against the travel" in found.reason
    u = np.linspace(2, 48, 200)
    level = np.mean([run.mean[0] for run in runs])
    # Means over 48 mm of 1 mm; interpolated between pieces, flat over half a piece at the ends.
    np.testing.assert_allclose(found.at(u)[0] - level, 0.2 * (u / 50 - 0.5), atol=0.2 / 48)
