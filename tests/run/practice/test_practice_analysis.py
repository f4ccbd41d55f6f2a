"""Rows of correlation and strain: gauges by their formulas, benchmarks as the committed tables have them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import Status
from ploughval.piv.strain import gauge_px
from ploughval.run.practice.analysis import BENCHMARKS, correlation_rows, strain_rows
from ploughval.run.practice.rows import Source

from .conftest import SCALE, U_MM, tracks_of

REPORTS = Path(__file__).parents[3] / "reports" / "speed-error"


def correlations(scene, found):
    return {row.item: row for row in correlation_rows(scene, found)}


@pytest.mark.parametrize(
    ("subset", "step", "points", "virtual"),
    [(31, None, 4, 3 * 15 + 31), (31, 10.0, 5, 4 * 10 + 31), (21, 30.0, 4, 3 * 30 + 21)],
)
def test_virtual_strain_gauge_follows_its_formula(make_scene, make_found, subset, step, points, virtual):
    scene = make_scene(piv={"subset_px": subset, **({} if step is None else {"spacing_px": step})})
    rows = {row.item: row for row in strain_rows(scene, make_found(scene))}
    assert rows["Virtual strain gauge"].value == virtual
    assert f"({points} points - 1)" in rows["Virtual strain gauge"].note
    assert rows["Gauge"].value == max(1.5 * subset, 3 * (step or 0.0)) == gauge_px(subset, step or 0.0)
    assert f"{rows['Gauge'].value * SCALE:.3g} mm" in rows["Gauge"].note


def test_what_is_correlated_and_how_is_that_of_the_settings(make_scene, make_found):
    scene = make_scene(piv={"subset_px": 24, "order": 2, "spline": 3, "zncc_min": 0.6, "spacing_px": 9.0})
    rows = correlations(scene, make_found(scene))
    assert (rows["Subset"].value, rows["Step"].value) == (25.0, 9.0)  # sides are odd
    assert rows["Step"].source == Source.SETTING
    assert "second order" in rows["Shape function"].text
    assert rows["Interpolant"].text == "cubic B-spline"
    assert rows["Least correlation"].value == 0.6


def test_points_followed_and_why_others_were_not(make_scene, make_found):
    tracks = tracks_of(U_MM, (0.0, 0.0), 0.01)
    status = tracks["status"].to_numpy().copy()
    status[-1, : status.shape[1] // 4] = Status.SHEARED
    tracks["status"] = (("frame", "point"), status)
    rows = correlations(make_scene(), make_found(tracks=tracks))
    share = 100 * (1 - (status.shape[1] // 4) / status.shape[1])
    assert rows["Followed to the end"].value == pytest.approx(share)
    assert "sheared" in rows["Followed to the end"].note
    assert rows["Median correlation at the end"].value == pytest.approx(0.97)


def test_bias_of_other_settings_is_not_invented(make_scene, make_found):
    scene = make_scene(piv={"subset_px": 21})
    row = correlations(scene, make_found(scene))["Bias of interpolation, at most"]
    assert row.source == Source.UNTOLD
    assert np.isnan(row.value)


def test_a_test_without_tracks_has_no_rows_of_correlation(make_scene, make_found):
    scene = make_scene(piv={"track": False})
    assert correlation_rows(scene, make_found(scene)) == strain_rows(scene, make_found(scene)) == []


def test_stated_bias_is_that_of_the_committed_benchmark_within_a_fifth():
    table = pd.read_csv(REPORTS / "piv.csv")
    shifts = table[table["case"].str.match(r"shift [\d.]+ noise")]
    for noise, stated in ((0, "bias_px"), (3, "bias_noise_px")):
        worst = shifts.loc[shifts["case"].str.endswith(f"noise {noise}"), "bias_px"].abs().max()
        assert getattr(BENCHMARKS[31, 1, 5], stated) == pytest.approx(worst, rel=0.2)


def test_stated_resolution_is_that_of_the_committed_benchmark_within_a_tenth():
    table = pd.read_csv(REPORTS / "piv-settings.csv")
    star = table[(table["case"] == "star") & (table["shape"] == "adaptive") & (table["step_px"] == 16)]
    for (subset, order, spline), known in BENCHMARKS.items():
        rows = star[(star["subset"] == subset) & (star["order"] == order) & (star["spline"] == spline)]
        assert known.period_px == pytest.approx(rows["star_period_px"].iloc[0], rel=0.1)
