"""Soil parameters fitted to a whole test folder's force."""

import json
from dataclasses import replace

import numpy as np
import pytest

from ploughval.errors import ConfigError
from ploughval.run.soil import fit_folder
from ploughval.synth import EXAMPLE, make_folder


def test_the_soil_that_made_the_force_is_found_within_three_standard_uncertainties(tmp_path):
    """Friction of the blade on the box is unknown to 5 % of 1.5 N: the force of 5 to 15 N moves with it."""
    told = EXAMPLE.soil.model_copy(update={"peak_friction_deg": 46.0, "residual_friction_deg": 30.0})
    options = replace(EXAMPLE, photographs=False, told_soil=told, displacement_mm=40.0, seed=3)
    make_folder(tmp_path / "t", options)
    fitted, path = fit_folder(tmp_path / "t")
    true = [getattr(EXAMPLE.soil, name) for name in fitted.parameters]
    assert np.all(np.abs(fitted.values - true) < 3 * fitted.std)
    assert np.all(fitted.std[:2] < 1.0)  # degrees: still a measurement
    written = json.loads(path.read_text())["parameters"]
    assert written["peak_friction_deg"]["value"] == pytest.approx(fitted.values[0])


def test_a_scene_without_load_cells_cannot_be_fitted(tmp_path):
    make_folder(tmp_path / "t", replace(EXAMPLE, loadcells=False, frames=2))
    with pytest.raises(ConfigError, match="loadcells"):
        fit_folder(tmp_path / "t")
