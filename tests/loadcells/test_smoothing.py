"""Smoothing against closed forms of a Gaussian kernel."""

import numpy as np
import pytest

from ploughval.loadcells.smoothing import kernel_std_s, smooth

STEP = 0.01


def clock(seconds=40.0):
    return np.arange(0, seconds, STEP)


def both(values):
    return np.stack([values, -0.5 * values])


def test_a_symmetric_peak_stays_at_its_time():
    t = clock()
    at = 20.0034
    smoothed = smooth(t, both(np.exp(-np.abs(t - at) / 0.3)), 1.0).readings[0]
    weight = smoothed**4
    assert (weight @ t) / weight.sum() == pytest.approx(at, abs=STEP / 100)


@pytest.mark.parametrize("bandwidth_Hz", [0.5, 2.0, 5.0, 10.0, 20.0])
def test_an_oscillation_at_the_bandwidth_keeps_the_root_of_a_half(bandwidth_Hz):
    t = clock()
    wave = np.sin(2 * np.pi * bandwidth_Hz * t)
    middle = slice(1000, 3000)
    kept = (
        smooth(t, both(wave), bandwidth_Hz).readings[:, middle] @ wave[middle] / (wave[middle] @ wave[middle])
    )
    np.testing.assert_allclose(kept, [0.5**0.5, -(0.5**1.5)], rtol=0.01)


@pytest.mark.parametrize("bandwidth_Hz", [0.5, 3.0, 12.0])
def test_the_noise_that_is_left_is_the_share_that_is_stated(bandwidth_Hz):
    noise = np.random.default_rng(0).normal(size=(2, 200_000))
    found = smooth(np.arange(200_000) * STEP, noise, bandwidth_Hz)
    # 0.5 Hz leaves 2000 s / (4 x 0.265 s) = 1900 independent values: their variance scatters by 3 %.
    assert found.readings.var() == pytest.approx(found.noise_share, rel=0.1)


@pytest.mark.parametrize("width_s", [0.5, 1.0, 2.0])
def test_the_loss_of_a_gaussian_peak_is_estimated_within_a_fifth(width_s):
    t, kernel = clock(), kernel_std_s(0.5)
    peak = 8.0 * np.exp(-0.5 * ((t - 20) / width_s) ** 2)
    found = smooth(t, both(peak), 0.5)
    # A Gaussian of width w under a kernel of width s keeps w / sqrt(w^2 + s^2) of its height.
    kept = width_s / np.hypot(width_s, kernel)
    assert found.readings[0, 2000] == pytest.approx(8 * kept, rel=1e-3)
    assert found.lost[0, 2000] == pytest.approx(8 * (1 - kept), rel=0.2)
    assert found.lost[1, 2000] == pytest.approx(-4 * (1 - kept), rel=0.2)


def test_the_loss_of_both_cells_is_common_and_noise_is_not_counted_as_loss():
    t = clock(400.0)
    rng = np.random.default_rng(1)
    noise_cov = np.array([[0.04, 0.01], [0.01, 0.02]])
    noise = np.linalg.cholesky(noise_cov) @ rng.normal(size=(2, t.size))
    moving = np.ones(t.size, bool)
    quiet = smooth(t, noise, 1.0)
    # Of 1.2e-3 left by smoothing a hundredth may stay after the noise's own part is taken off.
    assert np.abs(quiet.lost_cov(moving, noise_cov)).max() < 0.02 * quiet.noise_share * 0.04 * 3
    wave = np.stack([7.0, 4.0])[:, None] * np.sin(2 * np.pi * 0.3 * t)
    found = smooth(t, wave + noise, 1.0).lost_cov(moving, noise_cov)
    lost = 1 - np.exp(-2 * (np.pi * 0.3 * kernel_std_s(1.0)) ** 2)
    truth = 0.5 * lost**2 * np.outer([7.0, 4.0], [7.0, 4.0])
    np.testing.assert_allclose(found, truth, rtol=0.2)
    difference = np.array([1.0, -1.0])
    assert difference @ found @ difference == pytest.approx(0.5 * (3 * lost) ** 2, rel=0.25)


def test_a_step_is_uncertain_where_it_is_and_not_elsewhere():
    t = clock()
    step = np.where(t > 20, 30.0, 0.0)
    rng = np.random.default_rng(3)
    noise = rng.normal(0, 0.01, (2, t.size))
    moving = t > 5
    found = smooth(t, both(step) + noise, 1.0)
    cov, weight = found.lost_cov(moving, np.eye(2) * 1e-4), found.lost_weight(moving, np.eye(2) * 1e-4)
    assert weight[moving].mean() == pytest.approx(1.0)
    assert not weight[~moving].any()
    std = np.sqrt(cov[0, 0] * weight)
    error = np.abs(found.readings[0] - step)
    # One row beside a step of 30 half of it is lost, of which a second pass tells a part: 30 / 2 x 0.1 to 1.
    near = (np.abs(t - 20.3) < 0.02) | (np.abs(t - 19.7) < 0.02)
    assert (std[near] > 0.1 * error[near]).all()
    far = moving & (np.abs(t - 20) > 1)
    # Far from it: no more than the noise that smoothing leaves, 0.01 x sqrt(0.021) = 0.0015, five times.
    assert std[far].max() < 5 * 0.01 * np.sqrt(found.noise_share)


def test_irregular_sampling_and_missing_values_neither_shift_nor_bias():
    rng = np.random.default_rng(2)
    t = clock() + rng.uniform(-0.4, 0.4, 4000) * STEP
    line = 3.0 + 2.0 * t
    readings = both(line)
    gone = rng.random(t.size) < 0.2
    gone[1500:1520] = True
    readings[0, gone] = np.nan
    found = smooth(t, readings, 2.0)
    assert np.isnan(found.readings[0, gone]).all()
    assert np.isfinite(found.readings[1]).all()
    far = slice(100, 3900)
    error = found.readings[0, far] - line[far]
    # A row counts at the nearest of regular times, 0.9 of a step away at most, on a slope of 2. A fifth of
    # the rows missing moves the middle of the weight of 23 by kernel x sqrt(0.25 / 23): four of those.
    # At the edge of a gap the kernel has one side only, whose middle is kernel x sqrt(2 / pi) away.
    kernel = kernel_std_s(2.0)
    gap = np.abs(t[far] - t[1510]) < 4 * kernel + 0.1
    assert np.nanmax(np.abs(error[~gap])) < 2 * (0.9 * STEP + 4 * kernel * np.sqrt(0.25 / 23))
    assert np.nanmean(error[~gap]) == pytest.approx(0.0, abs=2 * STEP * 0.05)
    assert np.nanmax(np.abs(error[gap])) < 2 * (kernel * np.sqrt(2 / np.pi) + STEP)


def test_a_constant_is_kept_at_the_ends_and_beside_gaps():
    t = np.concatenate([clock(5.0), 60 + clock(5.0)])
    readings = np.full((2, t.size), 7.3)
    readings[0, 200:300] = np.nan
    found = smooth(t, readings, 1.0)
    np.testing.assert_allclose(found.readings[np.isfinite(readings)], 7.3, rtol=1e-12)
    np.testing.assert_allclose(found.lost[np.isfinite(readings)], 0.0, atol=1e-12)


def test_a_pause_costs_no_memory():
    t = np.concatenate([clock(5.0), 1e7 + clock(5.0)])
    assert np.isfinite(smooth(t, both(np.sin(t)), 1.0).readings).all()


def test_a_cell_that_never_reads_stays_empty():
    readings = both(np.sin(clock()))
    readings[1] = np.nan
    found = smooth(clock(), readings, 1.0)
    assert np.isfinite(found.readings[0]).all()
    assert np.isnan(found.readings[1]).all()


def test_a_bandwidth_beyond_the_sampling_leaves_the_readings_as_they_are():
    readings = both(np.sin(clock()))
    found = smooth(clock(), readings, 50.0)
    np.testing.assert_array_equal(found.readings, readings)
    assert found.noise_share == 1.0
    assert not found.lost.any()


def test_a_loss_that_is_only_noise_has_the_stated_standard_deviation():
    rng = np.random.default_rng(8)
    noise = np.array([[4e-6, 1e-6], [1e-6, 9e-6]])
    time = np.arange(60_000) * 0.01
    found = smooth(time, np.linalg.cholesky(noise) @ rng.normal(size=(2, time.size)), 2.0)
    gradient = np.array([6.0, -7.0])
    # 60 000 rows over a kernel of 6.6 rows are some 3 000 independent ones: 1.3 % of a standard deviation.
    assert (gradient @ found.lost).std() == pytest.approx(found.lost_std(gradient, noise), rel=0.06)


def test_a_bandwidth_far_below_that_of_the_record_gives_its_mean_and_costs_no_memory():
    readings = both(np.sin(clock()))
    found = smooth(clock(), readings, 1e-9)
    np.testing.assert_allclose(found.readings - readings.mean(axis=1, keepdims=True), 0.0, atol=1e-12)
    assert found.noise_share == pytest.approx(1 / (2 * clock().size - 1))
