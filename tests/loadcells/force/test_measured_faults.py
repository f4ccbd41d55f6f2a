"""What is wrong with a log, its signs, units, rest or empty runs is said, and read right where it can be."""

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError
from ploughval.loadcells import measure_force

NAMES = ["time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm"]
REST = 4.0


def test_empty_runs_of_which_none_can_be_used_are_not_called_none(tmp_path, made_rig):
    rig = made_rig(tmp_path, runs=1)
    back = pd.read_csv(tmp_path / "empty/0.csv")
    back["displacement_mm"] *= -1
    back.to_csv(tmp_path / "empty/0.csv", index=False)
    faults = measure_force(rig.scene()).faults
    assert any(
        "none of the empty-box runs can be used: the force is not compensated" in fault for fault in faults
    )


@pytest.mark.parametrize(("factor", "speed"), [(0.1, "0.1"), (1000.0, "1000")])
def test_a_displacement_in_another_unit_is_told_by_the_blades_speed(tmp_path, factor, speed, made_rig):
    rig = made_rig(tmp_path, runs=0)
    table = pd.read_csv(tmp_path / "loadcells.csv")
    table["displacement_mm"] *= factor
    table.to_csv(tmp_path / "loadcells.csv", index=False)
    scene = rig.scene(empty=[])
    scene = scene.model_copy(update={"blade": scene.blade.model_copy(update={"speed_mm_s": 1.0})})
    said = [fault for fault in measure_force(scene).faults if "blade.speed_mm_s" in fault]
    assert len(said) == 1
    assert f"the blade moves at {speed} mm/s in the log, blade.speed_mm_s = 1" in said[0]


def test_a_speed_that_is_the_scenes_within_10_per_cent_is_not_mentioned(tmp_path, made_rig):
    scene = made_rig(tmp_path, runs=0).scene(empty=[])
    scene = scene.model_copy(update={"blade": scene.blade.model_copy(update={"speed_mm_s": 1.05})})
    assert not any("speed_mm_s" in fault for fault in measure_force(scene).faults)


def test_faulty_rows_are_empty_with_their_reason_and_do_not_spread(tmp_path, made_rig, errors):
    rig = made_rig(tmp_path)
    table = rig.table.copy()
    table.loc[600, NAMES[2]] = np.nan
    table.loc[700, NAMES[3]] = -8e6
    table.drop(index=range(800, 840)).to_csv(tmp_path / "loadcells.csv", index=False)
    result = measure_force(rig.scene())
    bad = result.record[~result.record["status"].isin(["ok", "force_too_small_for_arm"])]
    assert bad["status"].tolist() == ["not_finite", "dropout", "gap"]
    assert bad[["force_N", "force_std_N", "arm_mm", "arm_std_mm"]].isna().all(axis=None)
    _, force_error, _ = errors(result)
    assert np.nanmax(np.abs(force_error)) < 6 * 0.004 * np.sqrt(2) / 0.15 + 0.05
    assert len([fault for fault in result.faults if "still moves" not in fault]) == 3


def test_a_broken_empty_run_is_left_out_by_name(tmp_path, made_rig):
    rig = made_rig(tmp_path)
    (tmp_path / "empty/1.csv").write_text("nothing here\n")
    result = measure_force(rig.scene())
    assert result.compensated
    assert any("1.csv" in fault and "left out" in fault for fault in result.lost)


def test_wrong_signs_are_recognised_said_and_read_right(tmp_path, made_rig, errors):
    rig = made_rig(tmp_path, noise=0.0)
    for path in (tmp_path / "loadcells.csv", *(tmp_path / "empty").glob("*.csv")):
        table = pd.read_csv(path)
        table[NAMES[1:]] *= -1
        table.to_csv(path, index=False)
    result = measure_force(rig.scene())
    _, force_error, arm_error = errors(result)
    assert any("displacement falls" in fault for fault in result.faults)
    assert any("both cells have the opposite sign" in fault for fault in result.faults)
    assert np.abs(force_error).max() < 1e-8
    assert np.abs(arm_error).max() < 1e-7


def test_a_rest_window_outside_the_log_is_refused_with_its_times(tmp_path, made_rig):
    with pytest.raises(DataError, match=r"rest_s .* runs from 0 to 23\.98 s"):
        measure_force(made_rig(tmp_path).scene(rest_s=[100.0, 110.0]))


def test_motion_within_the_rest_window_is_named_and_left_out(tmp_path, made_rig):
    rig = made_rig(tmp_path)
    result = measure_force(rig.scene(rest_s=[0.0, 6.0]))
    assert any("the blade moves within rest_s" in fault for fault in result.faults)
    np.testing.assert_allclose(result.zero_Nm, rig.zeros, atol=5 * 0.004 / np.sqrt(200))


def test_a_log_that_starts_in_motion_keeps_its_force_but_says_the_zeros_are_unknown(tmp_path, made_rig):
    rig = made_rig(tmp_path, friction=0.0)
    rig.table[rig.table["time_s"] > REST + 1].to_csv(tmp_path / "loadcells.csv", index=False)
    result = measure_force(rig.scene(rest_s=None, empty=[]))
    assert any("no rest before motion" in fault for fault in result.faults)
    assert result.record["force_N"].notna().all()


def relogged(rig, change):
    """Rewrite the two columns of the test and of its empty runs."""
    for path in (rig.folder / "loadcells.csv", *(rig.folder / "empty").glob("*.csv")):
        table = pd.read_csv(path)
        table[NAMES[2:]] = change(table[NAMES[2:]].to_numpy())
        table.to_csv(path, index=False)


@pytest.mark.parametrize("signs", [(1, 1), (-1, -1), (-1, 1), (1, -1)])
@pytest.mark.parametrize("swapped", [False, True])
def test_cells_swapped_or_turned_give_the_same_force_and_arm(tmp_path, swapped, signs, made_rig, errors):
    rig = made_rig(tmp_path, noise=1e-9, after=1.0)
    relogged(rig, lambda cells: (cells * signs)[:, :: -1 if swapped else 1])
    result = measure_force(rig.scene())
    # Noise of 1e-9 N m keeps the readings from standing still: 1e-8 N, of 30 N at 0.25 m 1e-7 mm.
    _, force_error, arm_error = errors(result)
    assert np.abs(force_error).max() < 1e-6
    assert np.abs(arm_error).max() < 1e-5
    assert len(result.faults) == (swapped or signs != (1, 1))
