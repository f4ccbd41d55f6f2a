"""From a test folder to force and line of action, against the forces that made the folder."""

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import FORCE_COLUMNS
from ploughval.errors import ConfigError
from ploughval.loadcells import measure_force

NAMES = ["time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm"]
REST = 4.0


def test_noise_free_cells_return_force_and_arm_to_rounding(tmp_path, made_rig, errors):
    rig = made_rig(tmp_path, noise=0.0)
    result = measure_force(rig.scene())
    record, force_error, arm_error = errors(result)
    assert np.abs(force_error).max() < 1e-8
    assert np.abs(arm_error).max() < 1e-7
    assert tuple(result.record.columns) == FORCE_COLUMNS
    assert result.compensated
    assert [fault for fault in result.faults if "still moves" not in fault] == []
    np.testing.assert_allclose(result.zero_Nm, rig.zeros, atol=1e-12)
    np.testing.assert_allclose(record["friction_N"], 3.0, atol=1e-9)
    np.testing.assert_allclose(record["force_raw_N"] - record["friction_N"], record["force_N"], atol=1e-12)
    still = result.record[result.record["time_s"] < 3.9]
    assert (still["friction_N"] == 0).all()
    # Displacement noise of 0.002 mm: five of it at most, and its mean is the zero.
    assert still["u_mm"].abs().max() < 0.011
    assert still["u_mm"].mean() == pytest.approx(0.0, abs=1e-4)


def test_rest_is_found_when_it_is_not_given(tmp_path, made_rig):
    rig = made_rig(tmp_path)
    given, found = measure_force(rig.scene()), measure_force(rig.scene(rest_s=None))
    np.testing.assert_allclose(found.zero_Nm, given.zero_Nm, atol=5 * 0.004 / np.sqrt(150))
    np.testing.assert_allclose(found.noise_std_Nm, 0.004, rtol=0.3)


def test_noise_free_rest_has_no_line_of_action_and_says_so(tmp_path, made_rig):
    record = measure_force(made_rig(tmp_path).scene()).record
    still = record["time_s"] < 3.9
    assert (record["status"][still] == "force_too_small_for_arm").all()
    assert record["arm_mm"][still].isna().all()
    assert (record["status"][record["time_s"] > REST + 0.05] == "ok").all()


def test_the_mean_friction_is_that_of_the_travel(tmp_path, made_rig):
    result = measure_force(made_rig(tmp_path, noise=0.0).scene())
    assert result.friction_mean_N == pytest.approx(3.0, abs=1e-8)
    assert np.isnan(measure_force(made_rig(tmp_path, noise=0.0).scene(empty=[])).friction_mean_N)


def test_no_share_of_the_budget_is_a_negative_zero(tmp_path, made_rig):
    budget = measure_force(made_rig(tmp_path).scene()).budget
    shares = budget[["share", "arm_share"]].to_numpy()
    assert (shares == 0).any()
    assert not np.signbit(shares[shares == 0]).any()


def test_force_only_leaves_the_line_of_action_of_sand_and_friction(tmp_path, made_rig, errors):
    rig = made_rig(tmp_path, noise=0.0)
    record, force_error, _ = errors(measure_force(rig.scene(compensation="force_only")))
    assert np.abs(force_error).max() < 1e-8
    u = record["time_s"].to_numpy() - REST
    F, a = rig.true_force(u), rig.true_arm(u)
    np.testing.assert_allclose(record["arm_mm"], (F * a + 3.0 * 15.0) / (F + 3.0), atol=1e-7)


def test_without_empty_runs_nothing_is_taken_off_and_that_is_said(tmp_path, made_rig, errors):
    result = measure_force(made_rig(tmp_path, noise=0.0).scene(empty=[]))
    record, force_error, _ = errors(result)
    assert not result.compensated
    assert record["friction_N"].isna().all()
    np.testing.assert_allclose(force_error, 3.0, atol=1e-8)
    assert any("no empty-box runs" in fault for fault in result.faults)


def test_calibration_constants_scale_the_log(tmp_path, made_rig, errors):
    rig = made_rig(tmp_path, noise=0.0)
    for path in (tmp_path / "loadcells.csv", *(tmp_path / "empty").glob("*.csv")):
        table = pd.read_csv(path)
        table[NAMES[2]] *= 250.0
        table[NAMES[3]] *= -80.0
        table.to_csv(path, index=False)
    calibration = {"upper_Nm_per_unit": 1 / 250.0, "lower_Nm_per_unit": -1 / 80.0}
    _, force_error, arm_error = errors(measure_force(rig.scene(calibration=calibration)))
    assert np.abs(force_error).max() < 1e-8
    assert np.abs(arm_error).max() < 1e-7
    with pytest.raises(ConfigError, match="upper_Nm_per_unit"):
        measure_force(rig.scene(calibration={"upper_Nm_per_unit": 0.0}))


def test_cells_a_millimetre_apart_state_how_little_they_know(tmp_path, made_rig, errors):
    rig = made_rig(tmp_path, spacing=1.0, scatter=0.1, runs=5)
    record, force_error, _ = errors(measure_force(rig.scene()))
    std = record["force_std_N"].to_numpy()
    # 0.004 N m x sqrt(2) / 0.001 m = 5.7 N of noise a sample: 998 rows of it.
    assert std.min() > 5.6
    assert (np.abs(force_error) <= 1.96 * std).mean() == pytest.approx(0.95, abs=0.03)
    assert np.sqrt(np.mean(force_error**2)) < 1.5 * std.mean()


def test_a_force_that_crosses_zero_has_no_arm_there_and_never_a_huge_one(tmp_path, made_rig, errors):
    def crossing(u):
        return 12 + 18 * np.cos(u / 1.5)

    rig = made_rig(tmp_path, force=crossing)
    record, force_error, arm_error = errors(measure_force(rig.scene()), crossing)
    u = record["time_s"].to_numpy() - REST
    near = np.abs(crossing(u)) < 0.1
    assert near.sum() > 3
    assert record["arm_mm"][near].isna().all()
    assert (record["status"][near] == "force_too_small_for_arm").all()
    assert (record["status"][np.abs(crossing(u)) > 1] == "ok").all()
    # At five deviations of the force the arm's own is at most a fifth of the cells' reach of 334 mm; noise
    # alone of five of those, where a force of four deviations is read as five.
    assert np.nanmax(np.abs(arm_error)) < 5 * 334 / 5
    assert np.abs(force_error).max() < 6 * 0.004 * np.sqrt(2) / 0.15 + 0.02


SPREAD = (0.5, 0.6, 0.003)


SEEDS = 120


@pytest.fixture(scope="module")
def draws(tmp_path_factory, made_rig, errors):
    """z of force and arm at four stages, and of their mean, for many rigs that differ in everything."""
    folder = tmp_path_factory.mktemp("rig")
    rows = []
    for seed in range(SEEDS):
        rig = made_rig(folder, seed, scatter=0.1, spread=SPREAD, noise=0.006)
        result = measure_force(rig.scene())
        record, force_error, arm_error = errors(result)
        z = force_error / record["force_std_N"].to_numpy()
        z_arm = arm_error / record["arm_std_mm"].to_numpy()
        rows.append((np.mean(np.abs(z) <= 1.96), np.mean(np.abs(z_arm) <= 1.96)))
    return np.array(rows)


def test_the_95_per_cent_interval_of_the_force_covers_92_to_98_per_cent(draws):
    # Rows of a rig share zeros, friction, spacing and gains (systematic); rigs are independent draws.
    assert 0.92 <= draws[:, 0].mean() <= 0.98


def test_the_95_per_cent_interval_of_the_arm_covers_92_to_98_per_cent(draws):
    assert 0.92 <= draws[:, 1].mean() <= 0.98


def test_friction_is_taken_off_as_smoothed_as_the_readings_are(tmp_path, made_rig):
    rig = made_rig(tmp_path, noise=1e-6, friction=10.0)
    record = measure_force(rig.scene(bandwidth_Hz=1.0)).record
    still = record["time_s"] < REST - 1.0
    about = (record["time_s"] > REST - 0.5) & (record["time_s"] < REST + 0.5)
    assert record["force_N"][still].abs().max() < 0.01
    # The sand's force leaps from 0 to 30 N and is smeared: never below 0, as a step would be.
    assert record["force_N"][about].min() > -0.05
