"""The whole comparison on a stand-in model whose every number is known."""

import json
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest

import ploughval.model
from ploughval.axes import BAND_COLUMNS, FORCE_COLUMNS
from ploughval.compare import compare_test, metrics_mapping
from ploughval.scene import Scene

DEPTH = 30.0
U = np.array([0.0, 1.0, 38.0, 39.0, 70.0])
F = np.array([10.0, 5.0, 18.0, 8.0, 14.0])


@dataclass
class StandIn:
    """A model whose force scales with the unit weight and whose layers and surface stay level."""

    scale: float = 1.0
    lift_mm: float = 0.0
    force_std_N: float = 0.0
    horizontal_share: float = 1.0

    @property
    def force(self):
        return pd.DataFrame(
            {"u_mm": U, "force_N": F * self.scale, "beta_deg": 20.0, "outcrop_x_mm": 82.0, "band": 0}
        )

    @property
    def P0_N(self):
        return 10.0 * self.scale

    @property
    def bands(self):
        rows = [(0, 0.0, 38.0, 20.0, 0.0, 82.0, 0.0, 40.0), (1, 38.0, 70.0, 14.0, 0.0, 157.0, 0.0, 30.0)]
        return pd.DataFrame(rows, columns=list(BAND_COLUMNS))

    def layers(self, heights_mm, u_mm, frames):
        parts = [
            pd.DataFrame(
                {
                    "frame": k,
                    "u_mm": u,
                    "layer": h,
                    "source": "model",
                    "x_mm": [u, 400.0],
                    "y_mm": h + self.lift_mm,
                }
            )
            for k, u in zip(frames, u_mm, strict=True)
            for h in heights_mm
        ]
        return pd.concat(parts, ignore_index=True).assign(std_mm=0.0)

    def surface(self, u_mm):
        return np.array([[u_mm, DEPTH + self.lift_mm], [400.0, DEPTH + self.lift_mm]])


def scene(**soil):
    base = {"unit_weight_kN_m3": 16.0, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0}
    return Scene.model_validate(
        {"test": {"name": "t"}, "blade": {"depth_mm": DEPTH, "width_mm": 218}, "soil": base | soil}
    )


def measured(scale=1.0, lift=0.0, noise_N=0.02, seed=0):
    rng = np.random.default_rng(seed)
    t = np.arange(0, 70, 0.01)
    u = np.clip(t - 8, 0, 60)
    force = np.where(u > 0, scale * np.interp(u, U, F), 0) + rng.normal(0, noise_N, t.size)
    record = pd.DataFrame(np.nan, index=range(t.size), columns=list(FORCE_COLUMNS[:-1]))
    record = record.assign(time_s=t, u_mm=u, force_N=force, force_std_N=0.05, status="ok")
    frames, travel = np.arange(13), np.arange(13) * 5.0
    x = np.arange(0, 390, 2.0)

    def line(k, one, height):
        part = pd.DataFrame({"frame": k, "u_mm": one, "x_mm": x[x >= one], "y_mm": height + lift})
        return part.assign(layer=height, source="tracks", std_mm=0.05)

    pairs = list(zip(frames, travel, strict=True))
    layers = pd.concat([line(k, one, h) for k, one in pairs for h in (5.0, 15.0)], ignore_index=True)
    surface = pd.concat([line(k, one, DEPTH) for k, one in pairs], ignore_index=True)
    bands = pd.DataFrame(
        [(1, 0.0, 36.0, 21.0, 0.4, 84.0, 0.8, 40.0), (2, 36.0, 60.0, 15.0, 0.4, 150.0, 0.8, 25.0)],
        columns=list(BAND_COLUMNS),
    )
    return {
        "force": record,
        "bands": bands,
        "layers": layers,
        "surface": surface[["frame", "u_mm", "x_mm", "y_mm"]],
    }


NOTHING = {"force": None, "bands": None, "layers": None, "surface": None}


def by_name(comparison):
    return {metric.name: metric for metric in comparison.metrics}


def test_a_model_that_is_the_experiment_agrees_everywhere():
    found = by_name(compare_test(scene(), StandIn(force_std_N=0.01), **measured()))
    for name in (
        "force_mean_N",
        "work_mJ",
        "first_peak_N",
        "first_switch_u_mm",
        "first_switch_N",
        "force_rms_P0",
    ):
        assert found[name].agrees is True, name
    assert found["first_switch_u_mm"].experiment == pytest.approx(38.0, abs=0.15)
    # rms of what is left: noise of means of 2 rows, 0.02 / sqrt(2), over P0 = 10, and the averaged corners.
    assert found["force_rms_P0"].error == pytest.approx(0.0014, abs=0.0015)
    assert found["layers_rms_mm"].error == pytest.approx(0.0, abs=1e-12)
    assert found["peaks_count"].experiment == found["peaks_count"].model == 2


def test_a_record_that_begins_late_is_compared_over_what_both_show():
    """The first 10 mm cut off: the same sand still agrees, and the model's first peak does not count."""
    tables = NOTHING | {"force": measured()["force"].query("u_mm > 10").reset_index(drop=True)}
    found = by_name(compare_test(scene(), StandIn(force_std_N=0.01), **tables))
    mean = found["force_mean_N"]
    whole = np.linspace(10, 60, 5001)
    assert mean.model == pytest.approx(np.interp(whole, U, F).mean(), abs=0.01)
    assert mean.agrees
    assert found["work_mJ"].error == pytest.approx(0.0, abs=0.3)
    assert (found["peaks_count"].experiment, found["peaks_count"].model) == (1, 1)
    assert found["switches_per_depth"].error == pytest.approx(0.0, abs=1e-9)
    assert "from 10" in mean.note


def test_a_force_that_is_no_load_has_no_share_of_it():
    tables = NOTHING | {"force": measured(scale=-1.0)["force"]}
    found = by_name(compare_test(scene(), StandIn(force_std_N=0.01), **tables))
    assert found["area_validation_P0"].error > 1.0
    assert "area_validation_percent" not in found


def test_a_force_ten_per_cent_off_is_refused_and_measured():
    found = by_name(compare_test(scene(), StandIn(), **measured(scale=1.1)))
    grid = np.linspace(0, 60, 60001)
    mean = np.interp(grid, U, F).mean()
    assert found["force_mean_N"].error == pytest.approx(-0.1 * mean, rel=0.02)
    assert found["force_mean_N"].agrees is False
    rms = np.sqrt(np.mean((0.1 * np.interp(grid, U, F)) ** 2)) / 10
    assert found["force_rms_P0"].error == pytest.approx(rms, rel=0.02)
    assert found["area_validation_P0"].error == pytest.approx(0.1 * mean / 10, rel=0.03)


def test_a_stated_soil_uncertainty_widens_the_model_by_its_sensitivity(monkeypatch):
    def simulate(changed, *, displacement_mm):
        return StandIn(scale=changed.soil.unit_weight_kN_m3 / 16.0)

    monkeypatch.setattr(ploughval.model, "simulate", simulate)
    found = by_name(
        compare_test(scene(unit_weight_std_kN_m3=0.8), StandIn(force_std_N=1e-9), **measured(scale=1.08))
    )
    # Force is proportional to the unit weight: 5 % of it is 5 % of every force; 8 % off is within twice that.
    for name in ("force_mean_N", "first_peak_N", "first_switch_N"):
        # 64 draws, one in each of as many equally probable intervals: good to 2 % (see the table of draws).
        assert found[name].input_std == pytest.approx(0.05 * found[name].model, rel=0.02)
        assert found[name].dominant_input == "unit_weight_kN_m3"
        assert found[name].agrees is True
    assert found["first_switch_u_mm"].model_std == pytest.approx(1e-3 * 38.0, rel=1e-6)


def test_layers_and_surface_lifted_by_a_tenth_are_that_far_off():
    found = compare_test(
        scene(), StandIn(), **{**NOTHING, **{k: measured(lift=0.1)[k] for k in ("layers", "surface")}}
    )
    metrics = by_name(found)
    for name in ("layers_rms_mm", "layers_median_mm", "layers_p95_mm", "surface_rms_mm"):
        assert metrics[name].error == pytest.approx(0.1, rel=1e-9)
    # 0.1 mm against 0.05 mm of measurement: within twice, with the model's share (0.001 x 30 mm).
    assert metrics["layers_rms_mm"].validation_std == pytest.approx(np.hypot(0.05, 0.03))
    assert metrics["layers_rms_mm"].agrees is True
    assert metrics["surface_rms_mm"].agrees is None
    assert len(found.layer_distances) == 26


def test_bands_are_set_against_each_other_one_to_one():
    found = compare_test(scene(), StandIn(), **measured())
    metrics = by_name(found)
    assert metrics["bands_count"].error == 0
    assert metrics["first_band_beta_deg"].error == pytest.approx(-1.0)
    assert metrics["first_outcrop_x_mm"].error == pytest.approx(-2.0)
    assert metrics["first_outcrop_x_mm"].agrees is False
    # Frames 5 mm of travel apart: the sand between two bands places a start to a tenth of that.
    assert metrics["second_band_u_mm"].experiment_std == pytest.approx(0.5)
    assert metrics["second_band_u_mm"].agrees is False
    assert metrics["band_frequency_ratio"].model == pytest.approx(36 / 38)
    assert metrics["bands_matched_count"].experiment == 2
    assert found.band_pairs["band_model"].tolist() == [0, 1]


def test_what_was_not_measured_is_absent_and_nothing_becomes_zero():
    empty = compare_test(scene(), StandIn(), **NOTHING)
    assert empty.metrics == ()
    assert (empty.mobilised, empty.peaks, empty.band_pairs, empty.layer_distances) == (None,) * 4
    force_only = by_name(compare_test(scene(), StandIn(), **{**NOTHING, "force": measured()["force"]}))
    assert not [name for name in force_only if name.startswith(("layers", "bands", "surface"))]


def test_a_peak_that_one_side_lacks_is_none_with_a_note():
    tables = measured()
    tables["force"] = tables["force"].assign(force_N=np.where(tables["force"]["u_mm"] > 0, 9.0, 0.0))
    metric = by_name(compare_test(scene(), StandIn(), **tables))["first_switch_u_mm"]
    assert np.isnan(metric.experiment)
    assert metric.model == 38.0
    assert metric.agrees is None
    assert "none in the experiment" in metric.note


def test_metrics_become_plain_json_with_null_for_unknown():
    comparison = compare_test(scene(), StandIn(), **measured())
    mapping = metrics_mapping(comparison)
    text = json.dumps(mapping, allow_nan=False)
    assert json.loads(text)["force_rms_P0"]["experiment"] is None
    keys = (
        "unit experiment experiment_std model model_std error validation_std agrees note "
        "input_std numerical_std dominant_input"
    )
    assert list(mapping["force_mean_N"]) == keys.split()
    assert mapping["force_mean_N"]["unit"] == "N"
    assert mapping["work_mJ"]["unit"] == "mJ"


def test_friction_is_not_read_before_a_blade_that_leans():
    # atan(F / (W + F tan phi_w)) - beta would miss the inclination's part of the blade's push
    upright = scene(wall_friction_deg=5.0)
    leaning = upright.model_copy(update={"blade": upright.blade.model_copy(update={"inclination_deg": 10.0})})
    assert compare_test(upright, StandIn(), **measured()).mobilised is not None
    found = compare_test(leaning, StandIn(), **measured())
    assert (found.mobilised, found.mobilised_curve, found.softening) == (None, None, None)
    for name, given in (("peak", 50.0), ("residual", 32.0)):
        metric = by_name(found)[f"mobilised_{name}_deg"]
        assert np.isnan(metric.experiment)
        assert metric.model == given
        assert "leans by 10 degrees" in metric.note


def test_a_record_that_begins_where_the_model_has_ended_is_not_judged_and_the_notes_say_why():
    tables = measured()
    tables["force"] = tables["force"].assign(u_mm=tables["force"]["u_mm"] + 200.0)
    found = by_name(compare_test(scene(), StandIn(), **(NOTHING | {"force": tables["force"]})))
    assert all(metric.agrees is None and metric.note for metric in found.values())
    assert "no travel" in found["force_rms_P0"].note


def test_a_record_of_one_row_is_not_judged_and_the_note_says_why():
    force = measured()["force"].iloc[2000:2001]
    (only,) = compare_test(scene(), StandIn(), **(NOTHING | {"force": force})).metrics
    assert only.name == "force_mean_N"
    assert only.agrees is None
    assert "too few rows" in only.note
