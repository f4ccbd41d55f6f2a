"""Noise of the camera as a run measures it on its first two photographs."""

import numpy as np
import pytest

from ploughval.run.walk.noise import noise_arrays, noise_mask, noise_record

SHAPE = (300, 400)


def pictures(rng, gain, floor):
    light = rng.uniform(60, 200, SHAPE)
    shots = [light + rng.normal(size=SHAPE) * np.sqrt(gain * light + floor) for _ in range(2)]
    return [np.clip(np.rint(shot), 0, 255).astype(np.uint8) for shot in shots]


def test_noise_and_its_line_come_back_from_what_is_kept():
    first, second = pictures(np.random.default_rng(3), 0.04, 1.0)
    kept = noise_arrays(first, second, np.ones(SHAPE, bool))
    record = noise_record(kept["noise"], kept["noise_line"])
    # 120 000 pixels: 0.2 % of a standard deviation over all; rounding adds 1 / 12 to the variance.
    truth = np.sqrt(0.04 * record["mean_grey"] + 1.0 + 1 / 12)
    assert record["std_at_mean_grey"] == pytest.approx(truth, rel=0.02)
    assert record["gain"] == pytest.approx(0.04, abs=4 * record["gain_std"])
    assert record["misfit"] < 3


def test_pictures_that_do_not_tell_leave_no_record():
    first, _ = pictures(np.random.default_rng(3), 0.04, 1.0)
    assert noise_arrays(first, first, np.ones(SHAPE, bool)) is None
    assert noise_arrays(first, first[:, ::-1], np.zeros(SHAPE, bool)) is None
    assert noise_record(np.empty((0, 4)), np.full(5, np.nan)) is None


def test_sand_below_the_blade_is_used_where_there_is_enough_of_it():
    low, sand = np.zeros(SHAPE, bool), np.ones(SHAPE, bool)
    low[-20:] = True
    assert noise_mask(low, sand) is sand
    low[-200:] = True
    assert noise_mask(low, sand) is low
