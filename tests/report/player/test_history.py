"""The force keeps its peaks, its gaps and its numbers on the way to the chart."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ploughval.report.player.coding import unpack
from ploughval.report.player.frames import Moment, moments
from ploughval.report.player.history import curve, values_at
from ploughval.report.thinning import CHART_PX, thinned_rows
from ploughval.results import read_results


def rows_of(made):
    """What the script reads: rows of (first, u, values)."""
    numbers, sums, found = unpack(made.text), [0] * (made.columns + 1), []
    for at in range(0, len(numbers), made.columns + 2):
        row = []
        for column, mark in enumerate(numbers[at + 1 : at + made.columns + 2]):
            if mark == 0:
                row.append(np.nan)
                continue
            folded = mark - 1
            sums[column] += -(folded + 1) // 2 if folded % 2 else folded // 2
            row.append(sums[column] * made.steps[1 if column else 0])
        found.append((numbers[at], *row))
    return pd.DataFrame(found, columns=["first", "u_mm", *[f"v{k}" for k in range(made.columns)]])


def saw(count=40_000, seed=4):
    rng = np.random.default_rng(seed)
    u = np.linspace(0.0, 120.0, count)
    force = 10 + np.mod(u, 17.3) / 3 + rng.normal(0, 0.05, count)
    return pd.DataFrame({"u_mm": u, "force_N": force, "force_std_N": 0.2 + u / 1000})


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_every_peak_and_trough_of_the_record_is_in_its_pixel_of_the_chart(seed):
    table = saw(6000, seed)
    u, force = table["u_mm"].to_numpy(), table["force_N"].to_numpy()
    kept = thinned_rows(u, force)
    assert len(kept) <= 2 * CHART_PX + 2
    pixel = np.minimum((u / u.max() * CHART_PX).astype(int), CHART_PX - 1)
    whole = pd.Series(force).groupby(pixel)
    drawn = pd.Series(force[kept]).groupby(pixel[kept])
    assert (drawn.max() == whole.max()).mean() > 0.99  # the last pixel may hold the end as well
    assert drawn.max().max() == force.max()
    assert drawn.min().min() == force.min()


def test_every_listed_peak_is_drawn_within_a_pixel_and_a_thousandth_of_the_range(result_folder):
    results = read_results(result_folder)
    drawn = rows_of(curve(results.force, ("force_N", "force_std_N")))
    width = results.force["u_mm"].max() / CHART_PX
    listed = results.peaks[results.peaks["source"] == "experiment"]
    assert len(listed)
    record = results.force
    for u in listed["u_mm"]:
        near = record[(record["u_mm"] - u).abs() <= width]
        beside = drawn[(drawn["u_mm"] - u).abs() <= 2 * width]
        # Rounding: half of 1e-4 of the greatest force at most.
        room = 1e-4 * record["force_N"].max()
        assert beside["v0"].max() >= near["force_N"].max() - room
        assert beside["v0"].min() <= near["force_N"].min() + room


def test_a_curve_comes_back_to_half_a_step_with_its_gaps():
    table = saw(900)
    table.loc[300:309, "force_N"] = np.nan
    table.loc[500:520, "force_std_N"] = np.nan
    made = curve(table, ("force_N", "force_std_N"))
    drawn, good = rows_of(made), table.dropna(subset=["force_N"])
    assert (made.rows, made.kept) == (900, 890)
    assert drawn["u_mm"].to_numpy() == pytest.approx(good["u_mm"].to_numpy(), abs=0.51 * made.steps[0])
    assert drawn["v0"].to_numpy() == pytest.approx(good["force_N"].to_numpy(), abs=0.51 * made.steps[1])
    assert drawn["v1"].to_numpy() == pytest.approx(
        good["force_std_N"].to_numpy(), abs=0.51 * made.steps[1], nan_ok=True
    )
    assert np.flatnonzero(drawn["first"]).tolist() == [0, 300]


def test_a_history_without_a_known_value_is_an_empty_curve():
    made = curve(pd.DataFrame({"u_mm": [np.nan, 1.0], "force_N": [2.0, np.nan]}), ("force_N",))
    assert (made.kept, made.text) == (0, "")


def test_values_at_a_frame_are_those_of_the_record_there(result_folder):
    results = read_results(result_folder)
    every = moments(results)
    values = values_at(results, every)
    at = {moment.frame: value for moment, value in zip(every, values, strict=True)}
    record = results.force.set_index("u_mm")["force_N"]
    assert at[4].force_N == pytest.approx(record.loc[20.0])  # a row of the log
    assert at[4].force_std_N == pytest.approx(0.3)
    assert at[4].model_N == pytest.approx(
        np.interp(20.0, results.model_force["u_mm"], results.model_force["force_N"])
    )
    assert (at[4].band, at[10].band) == (1, 2)
    assert at[4].model_band == 1


def test_a_frame_of_its_own_force_shows_that(own_folder):
    columns = {"frame": [4], "u_mm": [20.0], "force_N": [77.5], "force_std_N": [0.5]}
    pd.DataFrame(columns).to_csv(own_folder / "force_frames.csv", index=False)
    results = read_results(own_folder)
    values = values_at(results, moments(results))
    assert values[4].force_N == 77.5
    assert values[4].force_std_N == 0.5


def test_beyond_the_record_the_force_is_missing_and_not_the_last_one(own_folder):
    force = pd.read_csv(own_folder / "force.csv")
    force[force["u_mm"] < 30].to_csv(own_folder / "force.csv", index=False)
    results = read_results(own_folder)
    values = values_at(results, moments(results))
    assert np.isfinite(values[5].force_N) or np.isnan(moments(results)[5].u_mm)
    assert np.isnan(values[12].force_N)
    assert np.isfinite(values[12].model_N)


def test_measured_and_predicted_inclinations_are_read_at_one_travel(result_folder):
    results = read_results(result_folder)
    increments = pd.DataFrame(
        {"u_mm": [2.0], "du_mm": [2.0], "beta_deg": [26.0], "beta_std_deg": [0.1], "outcrop_x_mm": [60.0]}
    )
    u = np.linspace(0.0, 6.0, 61)
    model = pd.DataFrame({"u_mm": u, "force_N": 1.0, "beta_deg": 20.0 + u, "outcrop_x_mm": 60.0, "band": 0})
    made = replace(results, increments=increments, model_force=model)
    (now,) = values_at(made, [Moment(1, 4.0, 4.0)])
    # the middle of the increment, u = 3 mm, and not the frame's u = 4 mm; rows stand 0.1 mm apart
    assert now.beta_deg == 26.0
    assert now.model_beta_deg == pytest.approx(23.0, abs=0.051)
    alone = replace(made, increments=None)
    assert values_at(alone, [Moment(1, 4.0, 4.0)])[0].model_beta_deg == pytest.approx(24.0, abs=0.051)
