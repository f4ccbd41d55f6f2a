"""The force at given times against curves whose values and slopes are known."""

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import FORCE_AT_COLUMNS, FORCE_COLUMNS
from ploughval.loadcells.at_times import force_at

STEP = 0.1


def record(force, *, std=0.2, arm=10.0, size=200):
    t = np.arange(size) * STEP
    f = np.asarray(force(t), float)
    table = pd.DataFrame({name: np.zeros(size) for name in FORCE_COLUMNS})
    return table.assign(
        time_s=t, u_mm=2 * t, force_N=f, force_std_N=std, arm_mm=arm, arm_std_mm=0.5, status="ok"
    )


def ramp(t):
    return 5 + 3 * t


def test_rows_are_returned_exactly_and_in_between_a_straight_line():
    table = record(ramp)
    found = force_at(table, table["time_s"].to_numpy())
    assert tuple(found.columns) == FORCE_AT_COLUMNS
    for name in ("u_mm", "force_N", "force_std_N", "arm_mm", "arm_std_mm"):
        np.testing.assert_array_equal(found[name], table[name])
    between = force_at(table, np.array([7.25, 3.01]))
    np.testing.assert_allclose(between["force_N"], ramp(np.array([7.25, 3.01])), rtol=1e-13)
    np.testing.assert_allclose(between["u_mm"], [14.5, 6.02], rtol=1e-13)
    assert (between["status"] == "ok").all()


@pytest.mark.parametrize("at", [0.0, 10.0, 19.9])
def test_doubt_about_the_time_adds_slope_times_its_standard_uncertainty(at):
    found = force_at(record(ramp), np.array([at]), 0.4)
    # 9 nodes are exact for a straight line; the ends of the record count as if it went on.
    assert found["force_std_N"][0] == pytest.approx(np.hypot(0.2, 3 * 0.4), rel=1e-9)
    assert found["arm_std_mm"][0] == pytest.approx(0.5, rel=1e-12)


def test_a_drop_within_the_doubt_raises_the_uncertainty_before_and_after_it():
    table = record(lambda t: np.where(t < 10, 40.0, 25.0), std=0.0)
    at = np.array([8.0, 9.6, 9.9, 10.1, 10.4, 12.0])
    found = force_at(table, at, 0.4)["force_std_N"].to_numpy()
    # Half a normal doubt at most lies beyond the drop of 15 N: about 15 / sqrt(2) beside it.
    assert found[[0, -1]] == pytest.approx(0.0, abs=0.2)
    assert (found[1:-1] > 3).all()
    assert found.max() < 15


def test_the_top_of_a_peak_is_uncertain_too():
    found = force_at(record(lambda t: -20 * (t - 10) ** 2, std=0.0), np.array([10.0]), 0.3)
    # E[(20 d^2)^2] = 400 x 3 x 0.3^4 for a normal d; chords of 0.1 s lie up to 0.05 N below the parabola.
    assert found["force_std_N"][0] == pytest.approx(20 * np.sqrt(3) * 0.3**2, rel=0.05)


def test_gaps_are_empty_with_their_reason_and_one_missing_row_is_bridged():
    table = record(ramp)
    table.loc[100, ["force_N", "force_std_N", "arm_mm", "arm_std_mm"]] = np.nan
    table.loc[100, "status"] = "dropout"
    late = table["time_s"] > 15
    table.loc[late, "time_s"] += 10  # rows stop at 15.0 and go on at 25.1 s
    gap = table.iloc[[150]].assign(time_s=20.0, status="gap")
    gap[["u_mm", "force_N", "force_std_N", "arm_mm", "arm_std_mm"]] = np.nan
    table = pd.concat([table.iloc[:151], gap, table.iloc[151:]], ignore_index=True)
    found = force_at(table, np.array([10.0, 15.0, 16.0, 19.0, 24.9, 25.1]), 0.01)
    assert found["status"].tolist() == ["ok", "ok", "gap", "gap", "gap", "ok"]
    np.testing.assert_allclose(found["force_N"][[0, 1]], [35.0, 50.0])
    assert found.loc[2:4, ["u_mm", "force_N", "force_std_N", "arm_mm", "arm_std_mm"]].isna().all(axis=None)


def test_a_long_fault_keeps_its_own_reason():
    table = record(ramp)
    table.loc[100:120, ["force_N", "force_std_N", "arm_mm", "arm_std_mm"]] = np.nan
    table.loc[100:120, "status"] = "saturated"
    found = force_at(table, np.array([9.8, 10.9, 12.2]))
    assert found["status"].tolist() == ["ok", "saturated", "ok"]


def test_times_outside_the_log_or_unknown_have_no_force():
    found = force_at(
        record(ramp), np.array([-0.05, 19.95, 50.0, np.nan, 5.0]), np.array([0.1, 0.1, 0.1, 0.1, 0])
    )
    assert found["status"].tolist() == ["outside_log"] * 4 + ["ok"]
    assert found.loc[:3, "force_N"].isna().all()
    assert found["frame"].tolist() == [0, 1, 2, 3, 4]


def test_a_force_too_small_for_an_arm_keeps_its_force():
    table = record(ramp)
    table.loc[:50, ["arm_mm", "arm_std_mm"]] = np.nan
    table.loc[:50, "status"] = "force_too_small_for_arm"
    found = force_at(table, np.array([2.0, 10.0]), 0.1)
    assert found["status"].tolist() == ["force_too_small_for_arm", "ok"]
    assert np.isfinite(found["force_std_N"]).all()
    assert found["arm_mm"].isna().tolist() == [True, False]
