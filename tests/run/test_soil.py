"""Soil parameters fitted to a whole test folder's force."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.force.curve import Curve
from ploughval.errors import ConfigError
from ploughval.run.soil import fit_folder, shared_errors
from ploughval.synth import EXAMPLE, make_folder


def test_the_soil_that_made_the_force_is_found_within_three_standard_uncertainties(tmp_path):
    """Friction of the blade on the box is unknown to 5 % of 1.5 N: the force of 5 to 15 N moves with it."""
    told = EXAMPLE.soil.model_copy(update={"peak_friction_deg": 46.0, "residual_friction_deg": 30.0})
    options = replace(EXAMPLE, photographs=False, told_soil=told, displacement_mm=40.0, seed=3)
    make_folder(tmp_path / "t", options)
    fitted, path = fit_folder(tmp_path / "t")
    assert "no empty-box runs" not in fitted.message
    true = [getattr(EXAMPLE.soil, name) for name in fitted.parameters]
    assert np.all(np.abs(fitted.values - true) < 3 * fitted.std)
    assert np.all(fitted.std[:2] < 1.0)  # degrees: still a measurement
    written = json.loads(path.read_text())["parameters"]
    assert written["peak_friction_deg"]["value"] == pytest.approx(fitted.values[0])
    assert written["peak_friction_deg"]["interval_95"] == pytest.approx(fitted.interval_95[0].tolist())
    curve, profiles, landscape = (
        pd.read_csv(path.parent / f"fit_{name}.csv") for name in ("force", "profiles", "landscape")
    )
    assert len(curve) == fitted.points
    assert set(profiles["parameter"]) == set(fitted.parameters)
    assert landscape["map"].nunique() == 3
    assert landscape["rise"].min() == 0.0


def test_a_force_that_holds_the_friction_of_the_box_is_said_to(tmp_path):
    make_folder(tmp_path / "t", replace(EXAMPLE, photographs=False, empty_runs=0, displacement_mm=20.0))
    _, path = fit_folder(tmp_path / "t", parameters=("peak_friction_deg",))
    assert "no empty-box runs" in json.loads(path.read_text())["message"]


def test_a_scene_without_load_cells_cannot_be_fitted(tmp_path):
    make_folder(tmp_path / "t", replace(EXAMPLE, loadcells=False, frames=2))
    with pytest.raises(ConfigError, match="loadcells"):
        fit_folder(tmp_path / "t")


def test_what_rows_share_is_parted_into_offset_and_gain():
    force = np.linspace(4.0, 15.0, 200)
    shared = np.hypot(0.3, 0.02 * force)  # friction known to 0.3 N, sensitivity to 2 %
    curve = Curve(force, force, np.full(200, 0.1), shared, 0.1)
    parts = shared_errors(curve, SimpleNamespace(contact=SimpleNamespace(std_mm=0.04)))
    assert parts.offset_N == pytest.approx(0.3, rel=1e-6)
    assert parts.gain == pytest.approx(0.02, rel=1e-6)
    assert parts.start_mm == 0.04
    only = shared_errors(replace(curve, shared_std_N=np.full(200, 0.3)), SimpleNamespace(contact=None))
    assert (only.offset_N, only.gain, only.start_mm) == (pytest.approx(0.3), pytest.approx(0.0), 0.0)
