"""Pauses of the blade within its travel."""

import numpy as np
import pytest

from ploughval.loadcells.motion import find_motion
from ploughval.loadcells.pauses import rise_standing, standing
from ploughval.loadcells.run_log import RunLog

T = np.arange(0, 70, 0.02)


def paused(begin, length):
    """Displacement, mm, of 1 mm/s from 10 s to 50 s but for a pause."""
    return np.clip(T - 10, 0, begin - 10) + np.clip(T - begin - length, 0, 50 - begin)


def found(u, noise_mm, seed=0):
    seen = u + np.random.default_rng(seed).normal(0, noise_mm, u.size)
    motion = find_motion(seen)
    assert motion is not None
    return standing(seen, motion, noise_mm)


@pytest.mark.parametrize("noise_mm", [0.0, 0.002, 0.02])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_rows_of_a_pause_are_found_and_few_others(noise_mm, sign):
    rows = found(sign * paused(30.0, 5.0), noise_mm)
    within = (T > 30.0) & (T < 35.0)
    assert rows[within].all()
    # A stretch is a hundredth of 45 s, at most a quarter of it in motion at either end: a row or two more.
    assert rows[~within].sum() <= 2 * (0.45 / 4 / 0.02 + 2)


@pytest.mark.parametrize("noise_mm", [0.0, 0.002, 0.1])
def test_a_steady_travel_has_no_pause(noise_mm):
    assert not found(np.clip(T - 10, 0, 40), noise_mm).any()


def test_the_speed_is_that_of_the_travel_without_its_pauses():
    u = paused(30.0, 5.0)
    log = RunLog("log.csv", T, u, np.zeros((2, T.size)), find_motion(u))
    assert log.speed_mm_s == pytest.approx(1.0, rel=0.01)  # the ends of the pause's rows are in motion


def test_sticking_for_a_few_rows_is_no_pause():
    assert not found(np.floor(np.clip(T - 10, 0, 40) / 0.1) * 0.1, 0.001).any()


def test_a_travel_that_noise_hides_has_no_pause():
    assert not found(paused(30.0, 5.0), 1.0).any()


STILL = T > 30.0


def test_a_force_that_goes_on_rising_at_rest_is_told_with_its_place_and_size():
    force = 10.0 + 0.2 * T + np.random.default_rng(1).normal(0, 0.05, T.size)
    start, rise = rise_standing(force, STILL)
    assert start == np.argmax(STILL)
    assert rise == pytest.approx(0.2 * 40.0 * 19 / 20, abs=0.1)  # means of twentieths, noise 0.05 / sqrt(100)


@pytest.mark.parametrize(
    "after",
    [lambda t: 18.0 * np.exp(-t), lambda t: np.where(t < 20, 18.0, 0.0), lambda t: 18.0 + 0.02 * t],
    ids=["relaxes", "is unloaded", "drifts by a twentieth"],
)
def test_a_force_that_relaxes_is_unloaded_or_drifts_at_rest_is_not(after):
    force = np.where(STILL, after(T - 30.0), 10.0 + 0.2 * T)
    assert rise_standing(force + np.random.default_rng(2).normal(0, 0.05, T.size), STILL) is None


def test_noise_at_rest_is_no_rise():
    force = np.random.default_rng(3).normal(0, 1.0, T.size)
    assert rise_standing(force, STILL) is None
