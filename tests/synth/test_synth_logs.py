"""Logs against the closed forms of the two bending moments."""

import numpy as np
import pytest

from ploughval.synth import SynthOptions
from ploughval.synth.logs import bending_moments, empty_truth, feel, log_table

QUIET = {"moment_noise_Nm": 0.0, "zero_offset_Nm": 0.0, "friction_N": 0.0}


def felt(options, seed=1):
    u = np.array([0.0, 10.0, 20.0])
    return feel(u, np.array([12.0, 6.0, 14.0]), np.random.default_rng(seed), options)


def test_moments_give_back_force_and_line_of_action():
    force, arm = np.array([3.0, 20.0]), np.array([9.0, 14.5])
    upper, lower = bending_moments(force, arm, spacing_mm=150.0, lower_to_tip_mm=260.0)
    np.testing.assert_allclose((upper - lower) / 0.150, force, rtol=1e-12)
    np.testing.assert_allclose(260.0 - lower / force * 1e3, arm, rtol=1e-12)


def test_a_quiet_log_holds_the_true_force_and_nothing_at_rest():
    options = SynthOptions(displacement_mm=20.0, **QUIET)
    truth = felt(options)
    table = log_table(truth, np.random.default_rng(2), options)
    force = (table["moment_upper_Nm"] - table["moment_lower_Nm"]) / 0.150
    np.testing.assert_allclose(force, truth.force_N, atol=1e-4)  # moments are written to 1e-5 N m
    rest = table["time_s"] <= options.rest_s
    assert not table.loc[rest, ["moment_upper_Nm", "moment_lower_Nm"]].to_numpy().any()
    at = np.searchsorted(truth.u_mm, 5.0)
    assert truth.force_N[at] == pytest.approx(9.0, abs=1e-9)  # half way from 12 to 6 N
    moving = truth.arm_mm[np.isfinite(truth.arm_mm)]
    assert abs(moving.mean() - 10.0) < 2.0
    assert np.ptp(moving) > 0.01
    assert np.abs(np.diff(moving)).max() < 0.05  # slowly


def test_friction_zeros_and_noise_have_the_stated_sizes():
    options = SynthOptions(displacement_mm=20.0, moment_noise_Nm=0.01, zero_offset_Nm=0.5, friction_N=2.0)
    truth = empty_truth(felt(options))
    forces, zeros = [], []
    for seed in range(40):
        table = log_table(truth, np.random.default_rng(seed), options)
        raw = (table["moment_upper_Nm"] - table["moment_lower_Nm"]).to_numpy() / 0.150
        rest, moving = (table["time_s"] < 9.5).to_numpy(), truth.u_mm > 0
        forces.append(raw[moving].mean() - raw[rest].mean())
        zeros.append(table.loc[rest, "moment_upper_Nm"].mean())
    noise = table.loc[rest, "moment_lower_Nm"].std()
    assert noise == pytest.approx(0.01, rel=0.15)  # 475 readings
    assert np.mean(forces) == pytest.approx(2.0, abs=0.06)  # 40 runs with a spread of 5 %
    assert np.std(forces) == pytest.approx(0.1, rel=0.4)
    assert np.std(zeros) == pytest.approx(0.5, rel=0.4)


def test_times_and_displacement_follow_rest_and_speed():
    options = SynthOptions(displacement_mm=20.0, speed_mm_s=2.0, rest_s=4.0, rate_hz=100.0)
    table = log_table(felt(options), np.random.default_rng(2), options)
    assert np.diff(table["time_s"]) == pytest.approx(0.01)
    at = table["displacement_mm"].to_numpy()
    times = table["time_s"].to_numpy()
    # displacement noise 0.002 mm
    assert at[times < 4.0].max() < 0.01
    assert at[np.searchsorted(times, 9.0)] == pytest.approx(10.0, abs=0.01)
    assert at[-1] == pytest.approx(20.0, abs=0.01)
