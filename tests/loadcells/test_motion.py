"""Rest and motion in displacements made to measure."""

import numpy as np
import pytest

from ploughval.loadcells.motion import find_motion


@pytest.mark.parametrize("noise_mm", [0.03, 0.1, 0.3])
@pytest.mark.parametrize("seed", range(5))
def test_onset_is_traced_back_where_noise_hides_it(noise_mm, seed):
    t = np.arange(0, 60, 0.01)
    u = np.clip(t - 10.0, 0, 40) + np.random.default_rng(seed).normal(0, noise_mm, t.size)
    motion = find_motion(u)
    assert motion is not None
    # A line through n rows from 3 to 20 deviations s up a ramp of 0.01 mm a row, n = 17 s / 0.01, meets the
    # level at rest within 2.6 s / 0.01 / sqrt(n) rows; four of that.
    rows = noise_mm / 0.01
    assert abs(motion.onset - 1001) <= 4 * 2.6 * rows / np.sqrt(17 * rows) + 1


def test_onset_of_a_blade_that_gathers_speed_is_where_its_motion_is_told():
    t = np.arange(0, 60, 0.01)
    since = np.clip(t - 10.0, 0, None)
    u = np.where(since < 4, since**2 / 8, since - 2) + np.random.default_rng(0).normal(0, 0.01, t.size)
    motion = find_motion(np.minimum(u, 40.0))
    assert motion is not None
    # Three deviations are reached after sqrt(8 x 0.03) = 0.49 s, seven after 0.75 s.
    assert 1000 <= motion.onset <= 1076


@pytest.mark.parametrize("noise_mm", [0.0, 0.002, 0.01])
@pytest.mark.parametrize("sign", [1, -1])
def test_onset_is_found_within_three_noise_widths_of_travel(noise_mm, sign):
    t = np.arange(0, 60, 0.01)
    u = np.clip(t - 10.0, 0, 40) + np.random.default_rng(0).normal(0, noise_mm, t.size)
    motion = find_motion(sign * u)
    # 1 mm/s at 100 Hz moves 0.01 mm a row; the last row within 3 sigma lies at most 6 sigma up the ramp.
    assert motion is not None
    assert abs(motion.onset - 1001) <= 1 + 6 * noise_mm / 0.01
    assert motion.rest_end < 1000
    assert u[motion.steady_start] == pytest.approx(0.8, abs=0.02 + 4 * noise_mm)
    assert u[motion.steady_end - 1] == pytest.approx(39.2, abs=0.02 + 4 * noise_mm)
    assert motion.travel_mm == pytest.approx(sign * 40.0, abs=5 * noise_mm + 1e-9)


def test_noise_alone_is_no_motion():
    assert find_motion(np.random.default_rng(1).normal(0, 0.01, 5000)) is None


def test_a_record_that_starts_moving_has_no_rest():
    motion = find_motion(np.linspace(0, 30, 3000))
    assert motion is not None
    assert (motion.rest_end, motion.onset) == (0, 0)


def test_the_way_back_of_a_run_is_not_steady_travel():
    t = np.arange(0, 100, 0.1)
    motion = find_motion(np.clip(np.where(t < 60, t - 10, 110 - t), 0, 50))
    assert motion is not None
    assert t[motion.steady_end - 1] < 60.0


def test_missing_rows_are_passed_over():
    u = np.clip(np.arange(2000) * 0.01 - 5, 0, None)
    u[100:120] = np.nan
    motion = find_motion(u)
    assert motion is not None
    assert abs(motion.onset - 501) <= 1


@pytest.mark.parametrize("noise_mm", [0.0, 0.002, 0.01])
@pytest.mark.parametrize("after", ["holds", "returns"])
def test_the_end_of_the_forward_travel_is_found(noise_mm, after):
    t = np.arange(0, 80, 0.01)
    u = np.clip(t - 10, 0, 40)
    if after == "returns":
        u = np.where(t > 60, 100 - t, u)
    motion = find_motion(u + np.random.default_rng(1).normal(0, noise_mm, t.size))
    # 0.01 mm a row; the largest of 3000 rows lies up to 4 deviations above the level that 8 are taken off.
    assert motion is not None
    assert abs(motion.stop - 5001) <= 2 + 8 * noise_mm / 0.01


@pytest.mark.parametrize("noise_mm", [0.0, 0.002, 0.01])
def test_a_log_that_ends_in_motion_has_no_end_of_travel(noise_mm):
    t = np.arange(0, 50, 0.001)
    u = np.clip(t - 10, 0, None) + np.random.default_rng(2).normal(0, noise_mm, t.size)
    u[-5:] = np.nan
    motion = find_motion(u)
    assert motion is not None
    assert motion.stop == t.size
