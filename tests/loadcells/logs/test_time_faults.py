"""Faults of times: whatever happened to the order of rows or to the clock, the record comes back."""

import sys

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ploughval.loadcells.logs.time_faults import gap_places

NAMES = ["time_s", "displacement_mm", "moment_upper", "moment_lower"]


def record(rows=4000, seed=0, times=None):
    """10 s of rest, then 1 mm/s for 30 s at 100 Hz: smooth moments with noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(rows) * 0.01 if times is None else times
    u = np.clip(t - 10, 0, None)
    upper = 5 + 2 * np.sin(u / 3) * (u > 0) + rng.normal(0, 0.01, t.size)
    lower = 3 + np.cos(u / 4) * (u > 0) + rng.normal(0, 0.01, t.size)
    return pd.DataFrame(np.column_stack([t, u, upper, lower]), columns=NAMES)


def check_same(found, table, atol=0.0):
    assert len(found) == len(table)
    np.testing.assert_allclose(found["time_s"], table["time_s"], rtol=0, atol=atol)
    np.testing.assert_array_equal(found[NAMES[1:]], table[NAMES[1:]])


@pytest.mark.parametrize("seed", range(3))
def test_shuffled_rows_are_sorted_back(seed, check_table):
    table = record()
    order = np.random.default_rng(seed).permutation(len(table))
    found, faults = check_table(table.iloc[order].reset_index(drop=True))
    check_same(found, table)
    assert len(faults) == 1
    assert "out of order: sorted by time" in faults[0]


@pytest.mark.parametrize("size", [5, 25, 100, 1000])
def test_blocks_written_in_the_wrong_order_are_sorted_back(size, check_table):
    table = record()
    order = np.arange(len(table)).reshape(-1, size)
    order[[1, 2]] = order[[2, 1]]
    found, faults = check_table(table.iloc[order.ravel()].reset_index(drop=True))
    check_same(found, table)
    assert len(faults) == 1
    assert "out of order" in faults[0]


@pytest.mark.parametrize("size", [1, 30, 800])
def test_a_block_written_twice_is_dropped_once(size, check_table):
    table = record()
    order = [*range(1500 + size), *range(1500, 4000)]
    found, faults = check_table(table.iloc[order].reset_index(drop=True))
    check_same(found, table)
    assert any("with the time of the row before: dropped" in fault for fault in faults)
    assert not any("clock" in fault for fault in faults)


@pytest.mark.parametrize("back", [0.5, 12.5, 1000.0])
@pytest.mark.parametrize("places", [[2000], [1200, 2500, 3100]])
def test_a_clock_put_back_is_found_at_its_row(back, places, check_table):
    table = record()
    jumped = table.copy()
    for place in places:
        jumped.loc[place:, "time_s"] -= back
    found, faults = check_table(jumped)
    check_same(found, table, atol=1e-9)
    assert [
        f"jumps back by {back + 0:g} s at row {place}:" in f for f, place in zip(faults, places, strict=True)
    ]
    assert len(faults) == len(places)


def test_a_clock_that_starts_anew_goes_on(check_table):
    table = record()
    jumped = table.copy()
    jumped.loc[2500:, "time_s"] -= 25.0
    found, faults = check_table(jumped)
    check_same(found, table, atol=1e-9)
    assert "the clock jumps back by 25 s at row 2500: later times moved on by that" in faults


@pytest.mark.parametrize("rows", [[1500], [1500, 1501, 1502], [3999]])
@pytest.mark.parametrize("leap", [1e6, 77.7])
def test_times_that_leap_ahead_lose_their_rows_alone(rows, leap, check_table):
    table = record()
    table.loc[rows, "time_s"] += leap
    found, faults = check_table(table)
    if rows == [3999]:
        # The last row of all may be late: it is kept, after a gap.
        assert "1 gap in time before row 3999" in faults[0]
        return
    check_same(found, table.drop(index=rows))
    assert len(faults) == 1
    assert "time leaps away and back" in faults[0]


def test_a_time_that_falls_back_alone_loses_its_row(check_table):
    table = record()
    table.loc[1500, "time_s"] = 0.0037
    found, faults = check_table(table)
    check_same(found, table.drop(index=1500))
    assert faults == ["time leaps away and back in row 1500: dropped"]


def test_a_late_row_of_an_irregular_log_is_sorted_not_dropped(check_table):
    rng = np.random.default_rng(7)
    table = record(times=np.cumsum(rng.choice([0.01, 0.02, 0.03], 2000)))
    order = np.arange(2000)
    for k in range(50, 1950, 50):
        order[[k, k + 1]] = order[[k + 1, k]]
    found, faults = check_table(table.iloc[order].reset_index(drop=True))
    check_same(found, table)
    assert len(faults) == 1
    assert "out of order" in faults[0]


def test_a_first_row_with_a_time_of_another_age_is_dropped(check_table):
    table = record()
    table.loc[0, "time_s"] = 1e6
    found, _ = check_table(table)
    check_same(found, table.drop(index=0))


def test_a_gap_in_which_the_blade_went_on_keeps_the_clock(check_table):
    table = record()
    found, faults = check_table(table.drop(index=range(2000, 2500)).reset_index(drop=True))
    assert len(faults) == 1
    assert "1 gap in time before row 2000, the longest 5.01 s" in faults[0]
    assert found["time_s"].iloc[-1] == 39.99


def test_a_log_that_changes_its_rate_has_no_gaps(check_table):
    slow, fast = np.arange(0, 10.0, 1.0), 10 + np.arange(3000) * 0.01
    table = record(times=np.concatenate([slow, fast, fast[-1] + np.arange(1, 20)]))
    found, faults = check_table(table)
    check_same(found, table)
    assert faults == []


def test_a_lone_row_between_two_gaps_is_between_two_gaps(check_table):
    keep = [*range(2000), 2300, *range(2600, 4000)]
    found, faults = check_table(record().iloc[keep].reset_index(drop=True))
    assert "2 gaps in time before rows 2000, 2001" in faults[0]
    assert np.flatnonzero(found["status"] == "gap").tolist() == [2000, 2002]


def test_irregular_sampling_has_no_gaps_and_a_gap_in_it_is_found():
    rng = np.random.default_rng(4)
    steps = rng.choice([0.1, 0.2, 0.3, 0.5], 5000, p=[0.7, 0.22, 0.07, 0.01])
    assert gap_places(np.cumsum(steps)).size == 0
    steps[3000] = 4.0
    assert gap_places(np.cumsum(steps)).tolist() == [3000]


def test_a_clock_coarser_than_the_rows_is_told_what_to_do(check_table):
    table = record()
    table["time_s"] = np.floor(table["time_s"])
    _, faults = check_table(table)
    assert "count them instead, with rate_hz" in faults[0]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 6))
def test_any_mixture_of_faults_ends_in_increasing_times_of_rows_that_were_there(check_table, seed, count):
    rng = np.random.default_rng(seed)
    table = record(1200, seed % 7)
    for _ in range(count):
        kind, at, size = rng.integers(6), int(rng.integers(1, 1100)), int(rng.integers(1, 80))
        if kind == 0:
            table.loc[at:, "time_s"] += rng.normal(0, 30)
        elif kind == 1:
            table.loc[at : at + size, "time_s"] = rng.normal(0, 1e5)
        elif kind == 2:
            table = pd.concat([table.iloc[: at + size], table.iloc[at:]], ignore_index=True)
        elif kind == 3:
            table = table.drop(index=table.index[at : at + size]).reset_index(drop=True)
        elif kind == 4:
            table.loc[at : at + size] = table.loc[at : at + size].to_numpy()[::-1]
        else:
            table.loc[at, "time_s"] = rng.choice([np.nan, np.inf, -np.inf, 1e300])
    found, faults = check_table(table)
    assert (np.diff(found["time_s"]) > 0).all()
    gaps = found["status"] == "gap"
    there = {tuple(row) for row in table[NAMES[1:]].to_numpy()}
    kept = found[~gaps & found[NAMES[1:]].notna().all(axis=1)]
    assert {tuple(row) for row in kept[NAMES[1:]].to_numpy()} <= there
    assert faults or len(found) == len(table)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["shuffled", "pairs", "jumps", "blocks"])
def test_the_cost_of_a_spoiled_clock_is_not_that_of_all_pairs_of_rows(kind, check_table):
    """Ten times the rows with at most 30 times the calls (blocks in any order: 21), not a hundred times."""

    def calls(rows):
        table = record(rows)
        t = table["time_s"].to_numpy(copy=True)
        rng = np.random.default_rng(0)
        if kind == "jumps":
            t -= 5.0 * (np.arange(rows) // 500)
        elif kind == "pairs":
            some = np.arange(0, rows - 1, 25)
            t[some], t[some + 1] = t[some + 1], t[some].copy()
        elif kind == "blocks":
            t = t.reshape(-1, 250)[rng.permutation(rows // 250)].ravel()
        else:
            rng.shuffle(t)
        table["time_s"] = t
        counted = 0

        def count(*_):
            nonlocal counted
            counted += 1

        before = sys.getprofile()
        sys.setprofile(count)
        try:
            check_table(table)
        finally:
            sys.setprofile(before)
        return counted

    assert calls(200_000) < 30 * calls(20_000)
