"""Known errors: what is left of a stated error is the measurement's, and shares are counted right."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binomtest

from known_error.errors import Tables, error_rows, told_off, true_tables, without_uncertainty
from ploughval.axes import FORCE_COLUMNS, LAYER_COLUMNS, SURFACE_COLUMNS
from ploughval.model import simulate
from ploughval.scene import Soil, load_scene
from ploughval.synth import EXAMPLE, adapt, load_truth, make_folder
from study_known_error import kept_rows, power_table, share, summary

TOLD = Soil(
    unit_weight_kN_m3=15.7, peak_friction_deg=42.0, residual_friction_deg=33.0, peak_friction_std_deg=1.0
)
TRAVEL_MM = 22.0
OFFSET_N = 0.25


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A made test told a peak angle 2 degrees too high; its force is measured OFFSET_N too high."""
    folder = tmp_path_factory.mktemp("known") / "test"
    options = adapt(EXAMPLE, soil={}, frames=8, displacement_mm=TRAVEL_MM, photographs=False, told_soil=TOLD)
    make_folder(folder, options)
    record = true_tables(folder, Tables(None, None, None, None)).force.assign(force_std_N=OFFSET_N)
    record.loc[record["status"] == "ok", "force_N"] += OFFSET_N
    (folder / "results").mkdir()
    record[list(FORCE_COLUMNS)].to_csv(folder / "results" / "force.csv", index=False)
    return folder


def mean_force(scene):
    history = simulate(scene, displacement_mm=TRAVEL_MM)
    force = history.force
    return history.horizontal_share * np.trapezoid(force["force_N"], force["u_mm"]) / TRAVEL_MM


def test_error_is_known_from_the_two_soils_and_the_rest_is_the_measurement(folder):
    rows = pd.DataFrame(error_rows(folder)).set_index("metric")
    scene = load_scene(folder, files=False)
    true = load_truth(folder).options.soil
    expected = mean_force(scene) - mean_force(scene.model_copy(update={"soil": true}))
    row = rows.loc["force_mean_N"]
    # the log has a row each 0.02 mm: its mean is the curve's to a thousandth
    assert row["error_true"] == pytest.approx(expected, abs=1e-3 * mean_force(scene))
    assert row["error"] - row["error_true"] == pytest.approx(-OFFSET_N, abs=1e-3 * mean_force(scene))


def test_points_are_put_on_the_true_lines(folder):
    truth = load_truth(folder)
    layers = truth.layers.assign(source="tracks", y_mm=truth.layers["y_mm"] + 0.3)[list(LAYER_COLUMNS)]
    surface = truth.surface[truth.surface["x_mm"] < 200].assign(y_mm=-1.0)[list(SURFACE_COLUMNS)]
    moved = true_tables(folder, Tables(None, None, layers, surface))
    first = moved.layers[moved.layers["frame"] == 0]
    np.testing.assert_allclose(first["y_mm"], first["layer"], atol=1e-9)
    assert (moved.surface.loc[moved.surface["frame"] == 0, "y_mm"] == truth.options.depth_mm).all()
    last = moved.surface["frame"] == moved.surface["frame"].max()
    true_last = truth.surface[(truth.surface["frame"] == 7) & (truth.surface["x_mm"] < 200)]
    np.testing.assert_allclose(moved.surface.loc[last, "y_mm"], true_last["y_mm"])


def test_a_told_value_is_put_off_from_the_true_one(folder):
    scene = load_scene(folder, files=False)
    true = load_truth(folder).options.soil
    off = told_off(scene, true, "peak_friction_deg", "peak_friction_std_deg", 3.0)
    assert off.soil.peak_friction_deg == true.peak_friction_deg + 3.0 * TOLD.peak_friction_std_deg
    assert off.soil.residual_friction_deg == TOLD.residual_friction_deg
    assert told_off(scene, true, "peak_friction_deg", "peak_friction_std_deg", 50.0) is None
    assert without_uncertainty(scene).soil.peak_friction_std_deg == 0.0


def test_summary_finds_the_coverage_that_was_put_in():
    rng = np.random.default_rng(5)
    count, std = 4000, 0.7
    rows = pd.DataFrame(
        {
            "metric": "made",
            "unit": "N",
            "experiment": 1.0,
            "experiment_true": 1.0,
            "error": 0.4 + std * rng.standard_normal(count),
            "error_true": 0.4,
            "experiment_std": std * np.sqrt(0.5),
            "numerical_std": std * np.sqrt(0.5),
            "input_std": 0.2,
            "agrees": pd.Series(np.arange(count) % 10 != 0, dtype=object),
        }
    )
    row = summary(rows).loc["made"]
    # normal shares and moments, to three standard errors of 4000 draws
    assert row["within_1"] == pytest.approx(0.6827, abs=3 * np.sqrt(0.68 * 0.32 / count))
    assert row["within_2"] == pytest.approx(0.9545, abs=3 * np.sqrt(0.95 * 0.05 / count))
    # a quantile there has the standard error sqrt(p (1 - p) / n) over the normal's density, 0.242
    assert row["spread"] == pytest.approx(1.0, abs=3 * np.sqrt(0.16 * 0.84 / count) / 0.242)
    assert row["bias"] == pytest.approx(0.0, abs=3 * 1.2533 / np.sqrt(count))
    assert row["agrees"] == 0.9


@pytest.mark.parametrize(("count", "total"), [(0, 10), (3, 10), (95, 100), (100, 100)])
def test_interval_of_a_share_is_wilsons(count, total):
    expected = binomtest(count, total).proportion_ci(0.95, method="wilson")
    found = share(count, total)
    assert found[0] == count / total
    np.testing.assert_allclose(found[1:], [expected.low, expected.high], atol=2e-5)


def test_power_counts_verdicts_alone():
    rows = pd.DataFrame(
        {
            "parameter": "peak_friction_deg",
            "steps": 2.0,
            "metric": ["a", "a", "a", "b"],
            "folder": ["1", "2", "3", "1"],
            "agrees": pd.Series([True, False, None, False], dtype=object),
        }
    )
    table = power_table(rows).set_index("metric")
    assert table.loc["a", "tests"] == 2
    assert table.loc["a", "differs"] == 0.5
    assert table.loc["b", "differs"] == 1.0


def test_kept_rows_are_found_again(folder, tmp_path):
    made = kept_rows(tmp_path, "error", folder)
    again = kept_rows(tmp_path, "error", folder)
    pd.testing.assert_frame_equal(
        made.drop(columns="agrees"), again.drop(columns="agrees"), check_dtype=False
    )
    assert made["agrees"].dropna().tolist() == again["agrees"].dropna().tolist()
    assert len(list(tmp_path.iterdir())) == 1
