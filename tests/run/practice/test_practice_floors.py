"""Noise floors: scatter that was put in is found, motion is not taken for noise, and gaps are named."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from ploughval.run.practice.floors import floor_rows
from ploughval.run.practice.rest import off_line, rest_of, spread
from ploughval.run.practice.rows import Source

from .conftest import BANDS, U_MM, increments_of, tracks_of


def rows_of(scene, found):
    return {row.item: row for row in floor_rows(scene, found)}


def bands(increments=None):
    return SimpleNamespace(bands=BANDS, increments=increments_of(0.2) if increments is None else increments)


def test_scatter_of_resting_points_is_found_within_three_of_its_own_stds(make_scene, make_found):
    scene = make_scene()
    found = make_found(scene, tracks=tracks_of(U_MM, (0.004, 0.008), 0.006), bands=bands())
    rows = rows_of(scene, found)
    for item, true in (("Displacement along the travel", 0.004), ("Displacement upwards", 0.008)):
        row = rows[item]
        assert row.source == Source.MEASURED
        assert abs(row.value - true) < 3 * row.std
        assert row.std < 0.2 * true
        assert row.predicted == pytest.approx(0.006)
    mean = rows["Mean motion of sand at rest, along the travel"]
    assert abs(mean.value) < 3 * mean.std < 0.002


def test_moving_sand_does_not_count_as_noise(make_scene, make_found):
    scene = make_scene()
    found = make_found(scene, tracks=tracks_of(U_MM, (0.0, 0.0), 0.005), bands=bands())
    assert rows_of(scene, found)["Displacement along the travel"].value == pytest.approx(0.0, abs=1e-12)


def test_photographs_before_motion_show_all_sand_at_rest(make_scene, make_found):
    scene, u = make_scene(), np.array([0.0, 0.001, 0.002, 2.0, 4.0])
    found = make_found(scene, u, tracks=tracks_of(u, (0.004, 0.004), 0.004), bands=None)
    row = rows_of(scene, found)["Displacement along the travel"]
    assert "in 2 photographs before motion" in row.note
    assert abs(row.value - 0.004) < 3 * row.std


def test_without_sand_at_rest_the_prediction_stands_with_a_reason(make_scene, make_found):
    scene = make_scene()
    tracks = tracks_of(U_MM, (0.004, 0.004), 0.005)
    found = make_found(scene, tracks=tracks.isel(point=np.flatnonzero(tracks["y0_mm"].to_numpy() > 20)))
    row = rows_of(scene, found)["Displacement along the travel"]
    assert row.source == Source.PREDICTED
    assert np.isnan(row.value)
    assert row.predicted == pytest.approx(0.005)
    assert "rest" in row.note


def test_gradient_noise_of_independent_points_agrees_with_its_prediction_within_15_percent(
    make_scene, make_found
):
    scene = make_scene()
    found = make_found(scene, tracks=tracks_of(U_MM, (0.005, 0.005), 0.005), bands=bands())
    rows = rows_of(scene, found)
    for item in ("Component of a displacement gradient", "Maximum shear strain"):
        assert rows[item].value == pytest.approx(rows[item].predicted, rel=0.15)


def test_layers_and_surface_scatter_about_straight_lines(make_scene, make_found):
    rng, scene = np.random.default_rng(2), make_scene()
    x = np.arange(0.0, 240.0, 1.0)
    layer = pd.DataFrame(
        {"frame": 0, "layer": 10.0, "source": "dye", "x_mm": x, "y_mm": 10 + 0.01 * x, "std_mm": 0.05}
    )
    layer["y_mm"] += rng.normal(0, 0.05, x.size)
    surface = pd.DataFrame({"frame": 0, "u_mm": 0.0, "x_mm": x, "y_mm": 30 - 0.02 * x, "std_mm": 0.2})
    surface["y_mm"] += rng.normal(0, 0.1, x.size)
    rows = rows_of(scene, make_found(scene, layers=layer, surface=surface, bands=bands()))
    dyed, top = rows["Height of a dyed layer"], rows["Height of the surface"]
    assert abs(dyed.value - 0.05) < 3 * dyed.std
    assert (dyed.predicted, top.predicted) == (pytest.approx(0.05), pytest.approx(0.2))
    assert abs(top.value - 0.1) < 3 * top.std


def test_blade_scatters_about_the_log_whatever_the_scale_error(make_scene, make_found):
    rng, scene, u = np.random.default_rng(3), make_scene(), np.linspace(0, 60, 60)
    blade = np.column_stack([1.003 * u + 0.2 + rng.normal(0, 0.03, 60), np.full(60, 0.04)])
    found = make_found(scene, u, window=SimpleNamespace(blade=blade))
    row = rows_of(scene, found)["Place of the blade"]
    assert abs(row.value - 0.03) < 3 * row.std
    assert row.predicted == pytest.approx(0.04)


def test_blade_is_not_held_against_itself(make_scene, make_found):
    scene = make_scene()
    blade = np.column_stack([U_MM, np.full(12, 0.04)])
    found = make_found(scene, window=SimpleNamespace(blade=blade), source="blade in the photographs")
    row = rows_of(scene, found)["Place of the blade"]
    assert (row.source, row.predicted) == (Source.PREDICTED, pytest.approx(0.04))


def test_scatter_of_increments_is_that_of_the_inclination_about_its_drift(make_scene, make_found):
    scene = make_scene()
    increments = increments_of(0.2, count=400)
    rows = rows_of(scene, make_found(scene, bands=bands(increments)))
    beta = rows["Inclination of a band, one increment"]
    assert abs(beta.value - 0.2) < 3 * beta.std
    assert beta.predicted == pytest.approx(0.3)


def test_too_few_increments_leave_the_prediction(make_scene, make_found):
    scene = make_scene()
    rows = rows_of(scene, make_found(scene, bands=bands(increments_of(0.2, count=5))))
    assert rows["Inclination of a band, one increment"].source == Source.PREDICTED


def force(rows=200, onset=5.0):
    rng = np.random.default_rng(6)
    time = np.arange(rows) * 0.05
    moving = time >= onset
    record = pd.DataFrame(
        {
            "time_s": time,
            "u_mm": np.where(moving, time - onset, 0.0) + rng.normal(0, 0.002, rows),
            "force_N": 10.0 * moving + rng.normal(0, 0.03, rows),
        }
    )
    mean = SimpleNamespace(force_N=10.0, force_std_N=0.15, arm_mm=10.0, arm_std_mm=float("nan"))
    return SimpleNamespace(record=record, onset_s=onset, noise_std_N=0.031, mean_load=mean)


def test_force_at_rest_scatters_by_its_noise_and_a_missing_arm_is_not_told(make_scene, make_found):
    scene = make_scene()
    rows = rows_of(scene, make_found(scene, force=force()))
    sample = rows["Force, one sample"]
    assert abs(sample.value - 0.03) < 3 * sample.std
    assert sample.predicted == pytest.approx(0.031)
    assert abs(rows["Displacement of the log, one sample"].value - 0.002) < 0.0006
    arm = rows["Line of action, one sample"]
    assert (arm.source, np.isnan(arm.predicted)) == (Source.UNTOLD, True)


def test_a_log_that_begins_in_motion_leaves_the_stated_noise(make_scene, make_found):
    scene = make_scene()
    row = rows_of(scene, make_found(scene, force=force(onset=-1.0)))["Force, one sample"]
    assert (row.source, row.predicted) == (Source.PREDICTED, pytest.approx(0.031))


def test_a_test_without_displacement_has_no_rest(make_scene, make_found):
    scene = make_scene()
    assert rest_of(scene, make_found(scene, np.full(12, np.nan))) is None


def test_lost_photographs_are_not_looked_at(make_scene, make_found):
    scene = make_scene()
    found = make_found(scene, bands=bands(), lost_frames={0: "lost", 3: "lost"})
    rest = rest_of(scene, found)
    assert rest.first == 1
    assert 3 not in rest.frames


def test_spread_and_line_are_robust_to_one_stray():
    x = np.arange(50.0)
    y = 3 + 0.5 * x
    y[10] += 100.0
    assert np.abs(np.delete(off_line(x, y), 10)).max() < 1e-9
    normal = np.random.default_rng(0).normal(0, 2.0, 4000)
    assert spread(normal) == pytest.approx(2.0, rel=0.06)
    assert np.isnan(spread(np.array([1.0, 2.0])))
