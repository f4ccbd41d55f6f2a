"""Friction that was read stands beside the friction that the model was given."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.friction_metrics import friction_metrics
from ploughval.compare.mobilised.curve import CURVE_COLUMNS
from ploughval.compare.softening.table import SOFTENING_COLUMNS, FrictionFindings
from ploughval.scene import Scene

SOIL = {
    "unit_weight_kN_m3": 16.0,
    "peak_friction_deg": 48.0,
    "residual_friction_deg": 33.0,
    "mobilization_length_mm": 1.0,
    "peak_friction_std_deg": 1.5,
}


def case(**soil):
    tables = {"test": {"name": "t"}, "blade": {"depth_mm": 30, "width_mm": 218}, "soil": SOIL | soil}
    return SimpleNamespace(scene=Scene.model_validate(tables))


def findings(**values):
    row = dict.fromkeys(SOFTENING_COLUMNS, np.nan) | {"band": "all", "points": 90} | values
    return FrictionFindings(pd.DataFrame(columns=list(CURVE_COLUMNS)), pd.DataFrame([row]))


def frames():
    table = {"slip_mm": [0.2, 2.0, 3.0, 4.0], "phi_deg": [45.0, 32.0, 33.0, 34.0], "phi_std_deg": 0.6}
    return pd.DataFrame(table).assign(status="ok")


def by_name(found):
    return {metric.name: metric for metric in friction_metrics(case(), frames(), found)}


def test_what_the_curves_tell_is_judged_with_the_uncertainty_of_both_sides():
    found = findings(peak_deg=45.0, peak_std_deg=0.8, length_mm=1.4, length_std_mm=0.1)
    metrics = by_name(found)
    peak = metrics["mobilised_peak_deg"]
    assert (peak.experiment, peak.model, peak.error) == (45.0, 48.0, 3.0)
    assert peak.validation_std == pytest.approx(np.hypot(0.8, 1.5))
    assert peak.agrees is True
    assert peak.dominant_input == "peak_friction_deg"
    length = metrics["mobilised_length_mm"]
    assert length.agrees is False
    assert length.dominant_input == ""
    assert "all bands" in length.note


def test_late_frames_stand_in_for_a_residual_that_the_curves_do_not_tell():
    residual = by_name(findings(peak_deg=45.0, peak_std_deg=0.8))["mobilised_residual_deg"]
    assert (residual.experiment, residual.experiment_std) == (33.0, 0.6)
    assert "3 frames" in residual.note


def test_a_sand_that_was_given_one_friction_has_no_mobilization_length():
    found = findings(peak_deg=33.1, peak_std_deg=0.7, length_mm=15.3, length_std_mm=0.3)
    names = [m.name for m in friction_metrics(case(peak_friction_deg=33.0), frames(), found)]
    assert names == ["mobilised_peak_deg", "mobilised_residual_deg"]


def test_what_nothing_tells_is_no_metric():
    metrics = by_name(findings(residual_deg=32.5, residual_std_deg=0.2))
    assert list(metrics) == ["mobilised_residual_deg"]
    assert metrics["mobilised_residual_deg"].experiment == 32.5
