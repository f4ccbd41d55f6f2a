"""Every fault of a log is found where it was put, and nowhere else."""

import numpy as np
import pandas as pd
import pytest

from ploughval.loadcells.logs.value_faults import dropouts, saturated


def record(rows=4000, seed=0):
    """10 s of rest, then 1 mm/s for 30 s at 100 Hz: smooth moments with noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(rows) * 0.01
    u = np.clip(t - 10, 0, None)
    upper = 5 + 2 * np.sin(u / 3) * (u > 0) + rng.normal(0, 0.01, rows)
    lower = 3 + np.cos(u / 4) * (u > 0) + rng.normal(0, 0.01, rows)
    return pd.DataFrame({"time_s": t, "displacement_mm": u, "moment_upper": upper, "moment_lower": lower})


def test_a_clean_record_passes_unchanged(check_table):
    table = record()
    checked, faults = check_table(table)
    assert faults == []
    pd.testing.assert_frame_equal(checked[table.columns], table)
    assert (checked["status"] == "ok").all()


def test_non_finite_values_are_named_and_left_empty(check_table):
    table = record()
    table.loc[[5, 900], "moment_lower"] = [np.inf, np.nan]
    checked, faults = check_table(table)
    assert faults == ["moment_lower is not finite in rows 5, 900: left empty"]
    assert np.flatnonzero(checked["moment_lower"].isna()).tolist() == [5, 900]
    assert checked["status"][[5, 900]].tolist() == ["not_finite"] * 2
    assert checked["moment_upper"].notna().all()


def test_rows_without_a_time_are_dropped(check_table):
    table = record()
    table.loc[7, "time_s"] = np.nan
    checked, faults = check_table(table)
    assert len(checked) == len(table) - 1
    assert "row 7 without a time" in faults[0]


def test_rows_out_of_order_are_sorted_back(check_table):
    table = record()
    mixed = table.iloc[[*range(1000), 1001, 1000, *range(1002, 4000)]].reset_index(drop=True)
    checked, faults = check_table(mixed)
    assert "row 1001 out of order" in faults[0]
    pd.testing.assert_frame_equal(checked[table.columns], table)


def test_the_first_of_doubled_times_is_kept(check_table):
    table = record()
    doubled = pd.concat([table.iloc[:51], table.iloc[50:]], ignore_index=True)
    checked, faults = check_table(doubled)
    assert "row 51 " in faults[0]
    pd.testing.assert_frame_equal(checked[table.columns], table)


def test_a_clock_put_back_goes_on_one_step_later(check_table):
    table = record()
    jumped = table.copy()
    jumped.loc[2000:, "time_s"] -= 12.5
    checked, faults = check_table(jumped)
    assert "jumps back by 12.5 s at row 2000" in faults[0]
    np.testing.assert_allclose(checked["time_s"], table["time_s"], atol=1e-9)


def test_a_clock_put_on_while_the_blade_moves_is_taken_out(check_table):
    table = record()
    jumped = table.copy()
    jumped.loc[2000:, "time_s"] += 3.0
    checked, faults = check_table(jumped)
    assert "jumps on by 3 s at row 2000" in faults[0]
    np.testing.assert_allclose(checked["time_s"], table["time_s"], atol=1e-9)


def test_a_gap_keeps_its_time_and_gets_one_empty_row(check_table):
    table = record().drop(index=range(2000, 2200)).reset_index(drop=True)
    checked, faults = check_table(table)
    assert "1 gap in time before row 2000, the longest 2.01 s" in faults[0]
    gap = checked[checked["status"] == "gap"]
    assert len(gap) == 1
    assert gap["time_s"].item() == pytest.approx(0.5 * (19.99 + 22.00))
    assert gap["moment_upper"].isna().all()
    assert len(checked) == len(table) + 1


def test_a_single_time_that_leaps_loses_its_row(check_table):
    table = record()
    table.loc[300, "time_s"] = 1e6
    checked, faults = check_table(table)
    assert "leaps away and back in row 300" in faults[0]
    assert len(checked) == 3999


@pytest.mark.parametrize("rows", [[1200], [1200, 1201], [0], [3999]])
def test_dropouts_of_one_or_two_rows_are_found_alone(rows):
    values = record()["moment_upper"].to_numpy().copy()
    values[rows] = -838.0
    assert np.flatnonzero(dropouts(values)).tolist() == rows


def test_a_step_that_stays_is_no_dropout():
    values = record()["moment_upper"].to_numpy().copy()
    values[2500:] += 50
    assert not dropouts(values).any()


def test_clipped_moments_are_saturated(check_table):
    table = record()
    true = table["moment_upper"].to_numpy().copy()
    table["moment_upper"] = np.minimum(true, 6.9)
    checked, faults = check_table(table)
    clipped = np.flatnonzero(true >= 6.9)
    runs = np.split(clipped, np.flatnonzero(np.diff(clipped) > 1) + 1)
    long = np.concatenate([run for run in runs if len(run) >= 5])
    assert np.flatnonzero(checked["status"] == "saturated").tolist() == long.tolist()
    assert "stands at its extreme 6.9" in faults[0]


def test_coarse_steps_and_noise_free_rest_are_not_saturation():
    values = record()["moment_upper"].to_numpy()
    assert not saturated(np.round(values, 1), 1001).any()
    smooth = np.concatenate([np.zeros(1000), np.sin(np.linspace(0, 3, 3000))])
    assert not saturated(smooth, 1001).any()
