"""Faults of values are found where they were put, and loads are not taken for faults."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ploughval.loadcells.logs.value_faults import dropouts, not_finite, saturated, spikes, stuck


def ploughing(rate_hz=50.0, noise=0.01, seed=0, speed_mm_s=1.0, drop_rows=1):
    """A moment as ploughing gives it: rest, a peak that softens to half, rises that end in sudden drops."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 130, 1 / rate_hz)
    u = np.clip(t - 10, 0, None) * speed_mm_s
    first = np.interp(u, [0, 0.5, 3.0], [0, 1.0, 0.47])
    moment = np.where(u < 3, first, 0.47 + 0.5 * ((u - 3) / 20 % 1) ** 1.5)
    if drop_rows > 1:
        moment = np.convolve(moment, np.ones(drop_rows) / drop_rows, mode="same")
    return t, u, 3 * moment + rng.normal(0, noise, t.size)


def table(**options):
    t, u, upper = ploughing(**options)
    lower = 0.4 * ploughing(**options | {"seed": 1})[2]
    return pd.DataFrame({"time_s": t, "displacement_mm": u, "moment_upper": upper, "moment_lower": lower})


@pytest.mark.parametrize("rate_hz", [2.0, 10.0, 50.0, 1000.0])
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("drop_rows", [1, 3])
def test_sudden_drops_of_the_force_are_no_faults(rate_hz, noise, drop_rows, check_table):
    _, faults = check_table(table(rate_hz=rate_hz, noise=noise, drop_rows=drop_rows))
    assert faults == []


@pytest.mark.parametrize("name", ["normal", "laplace", "logistic", "uniform"])
def test_noise_alone_is_no_fault(name):
    for seed in range(20):
        noise = getattr(np.random.default_rng(seed), name)(size=20_000)
        assert not spikes(noise).any()
        assert not dropouts(noise).any()


@pytest.mark.parametrize("rows", range(1, 8))
@pytest.mark.parametrize("height", [1.0, -2.0, 50.0])
@pytest.mark.parametrize("at", [200, 1234, 2900, 6000])
def test_excursions_of_up_to_seven_rows_are_found_alone(rows, height, at):
    values = ploughing()[2]
    values[at : at + rows] += height
    found = dropouts(values)
    values[found] = np.nan
    found |= spikes(values)
    assert np.flatnonzero(found).tolist() == list(range(at, at + rows))


def test_a_spike_on_a_drop_of_the_force_leaves_the_drop():
    _, u, values = ploughing()
    drop = int(np.searchsorted(u, 23.0))
    values[drop + 10 : drop + 13] += 2.0
    assert np.flatnonzero(spikes(values)).tolist() == list(range(drop + 10, drop + 13))


def test_steps_as_coarse_as_an_excursion_tell_nothing():
    values = np.round(ploughing(noise=0.05)[2] / 0.4) * 0.4
    assert not spikes(values).any()
    assert not dropouts(values).any()


def test_a_pulse_that_rises_over_several_rows_is_a_load():
    values = np.random.default_rng(0).normal(0, 1, 2000)
    values[1000:1013] += [10, 40, 80, 150, 280, 400, 520, 500, 330, 180, 90, 40, 10]
    assert not dropouts(values).any()
    assert not spikes(values).any()


def test_spikes_are_left_empty_with_their_status(check_table):
    made = table()
    made.loc[1500:1503, "moment_lower"] += 1.0
    found, faults = check_table(made)
    assert faults == ["moment_lower spikes in rows 1500, 1501, 1502, 1503: left empty"]
    assert found["status"][1500:1504].tolist() == ["spike"] * 4
    assert found["moment_lower"].isna().sum() == 4
    assert found["moment_upper"].notna().all()


def test_a_cell_that_stands_still_as_the_other_moves_is_found(check_table):
    made = table()
    made.loc[2000:2060, "moment_upper"] = made["moment_upper"][2000]
    found, faults = check_table(made)
    assert len(faults) == 1
    assert "moment_upper stands still at" in faults[0]
    assert "in rows 2000, 2001, 2002, 2003, 2004 and 56 more: left empty" in faults[0]
    assert np.flatnonzero(found["status"] == "stuck").tolist() == list(range(2000, 2061))


def test_a_cell_that_stands_still_through_the_whole_log_is_found(check_table):
    made = table()
    made["moment_lower"] = 0.25
    found, faults = check_table(made)
    assert len(faults) == 1
    assert "moment_lower stands still at 0.25 as the other cell moves" in faults[0]
    moving = made["displacement_mm"] > 0.1
    assert (found["status"][moving] == "stuck").all()


def test_cells_that_stand_still_together_are_at_rest():
    _, u, _ = ploughing()
    step = np.where(u > 40, 2.0, np.where(u > 0, 1.0, 0.0))
    assert not stuck(step, 0.5 * step, 500).any()


def test_coarse_steps_are_not_a_cell_that_stands_still():
    values, other = np.round(ploughing()[2], 1), np.round(ploughing(seed=3)[2], 3)
    assert not stuck(values, other, 500).any()


@pytest.mark.parametrize(("low", "high"), [(None, 1.8), (0.9, None), (0.9, 1.8)])
def test_readings_at_either_end_of_the_range_are_saturated(low, high):
    values = 3 * (0.5 + 0.3 * np.sin(np.arange(5000) / 100)) + np.random.default_rng(0).normal(0, 0.01, 5000)
    clipped = np.clip(values, low, high)
    at = (clipped != values).astype(int)
    edges = np.flatnonzero(np.diff(at, prepend=0, append=0)).reshape(-1, 2)
    expected = np.zeros(5000, dtype=bool)
    for start, end in edges:
        expected[start:end] = end - start >= 5
    assert expected.sum() > 500
    np.testing.assert_array_equal(saturated(clipped, 0), expected)


@pytest.mark.parametrize("rate_hz", [10, 50, 500])
@pytest.mark.parametrize("digits", [3, 4, 5])
def test_the_top_of_a_smooth_curve_is_not_saturation(rate_hz, digits):
    t = np.arange(60 * rate_hz) / rate_hz
    for size in np.linspace(0.2, 1.0, 9):
        values = np.round(size * (1 + 0.03 * np.sin(2 * np.pi * t / 48)), digits)
        assert not saturated(values, 10).any()


def test_a_smooth_curve_without_noise_that_is_cut_off_is_saturated():
    values = np.round(1 + 0.03 * np.sin(2 * np.pi * np.arange(3000) / 2400), 5)
    clipped = np.minimum(values, 1.02)
    np.testing.assert_array_equal(saturated(clipped, 10), clipped == 1.02)


def test_numbers_too_large_to_be_readings_are_not_finite():
    values = np.array([1e29, 1e31, -1e300, np.inf, -np.inf, np.nan, 0.0])
    assert not_finite(values).tolist() == [False, True, True, True, True, True, False]


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 299), st.floats(allow_nan=True)), max_size=40), st.integers(0, 5))
def test_any_values_pass_or_are_left_empty_with_a_reason(check_table, changes, seed):
    made = table(rate_hz=2.0, seed=seed)[:300].reset_index(drop=True).iloc[:260]
    for place, value in changes:
        made.loc[place % 260, ["displacement_mm", "moment_upper", "moment_lower"][place % 3]] = value
    found, _ = check_table(made)
    values = found[["displacement_mm", "moment_upper", "moment_lower"]]
    np.testing.assert_array_equal(values.isna().any(axis=1), found["status"] != "ok")
    np.testing.assert_array_equal(values.where(values.notna(), made[values.columns]), made[values.columns])
