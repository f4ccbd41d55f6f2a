"""Fits recover what made the record, within the uncertainty that they state."""

import json

import numpy as np
import pytest

from ploughval.errors import ConfigError, DataError
from ploughval.model import fit_soil, force_history
from ploughval.scene import Scene


def scene_of(peak, residual, length, wall=0.0):
    soil = {
        "unit_weight_kN_m3": 15.7,
        "peak_friction_deg": peak,
        "residual_friction_deg": residual,
        "mobilization_length_mm": length,
        "wall_friction_deg": wall,
    }
    blade = {"depth_mm": 30.0, "width_mm": 218.0}
    return Scene.model_validate({"test": {"name": "fit"}, "blade": blade, "soil": soil})


def record(scene, travel, noise, seed):
    history = force_history(scene, displacement_mm=travel, tolerance=1e-4)
    u = np.linspace(0.0, travel, 250)
    force = np.interp(u, history.u_mm, history.force_N)
    std = noise * force.mean()
    return u, force + np.random.default_rng(seed).normal(0.0, std, u.size), std


@pytest.mark.parametrize(("truth", "noise"), [((50.0, 32.0, 1.0), 0.01), ((42.0, 33.0, 2.0), 0.03)])
def test_known_soil_is_recovered_within_the_stated_uncertainty(truth, noise):
    u, force, std = record(scene_of(*truth), 60.0, noise, seed=2)
    fit = fit_soil(u, force, std, scene_of(45.0, 30.0, 5.0))
    # three standard uncertainties each; and tight enough to be of use
    assert np.all(np.abs(fit.values - truth) < 3.0 * fit.std)
    assert np.all(fit.std < [0.3, 0.3, 0.3])
    assert 0.7 < fit.chi2_reduced < 1.3
    assert fit.residual_rms_N == pytest.approx(std, rel=0.15)
    (exact,) = fit.remarks  # nothing but what the scene calls certain
    assert exact.startswith("unit_weight_kN_m3, wall_friction_deg and depth_mm are taken as exact")
    assert np.all(fit.interval_95[:, 0] < fit.interval_68[:, 0])
    assert np.all(fit.interval_68[:, 1] < fit.interval_95[:, 1])


def test_parameters_not_asked_for_keep_the_scenes_values():
    u, force, std = record(scene_of(44.0, 33.0, 1.0), 50.0, 0.01, seed=5)
    fit = fit_soil(u, force, std, scene_of(40.0, 33.0, 1.0), parameters=("peak_friction_deg",))
    assert fit.values.shape == (1,)
    assert abs(fit.values[0] - 44.0) < 3.0 * fit.std[0] + 1e-3
    assert "peak_friction_deg" in str(fit)
    assert json.loads(json.dumps(fit.to_json()))["parameters"]["peak_friction_deg"]["value"] == fit.values[0]


@pytest.mark.parametrize("lean", [15.0, -20.0])
def test_load_cells_before_a_blade_that_leans_feel_the_horizontal_part(lean):
    upright = scene_of(44.0, 33.0, 1.0, wall=5.0)
    scene = upright.model_copy(update={"blade": upright.blade.model_copy(update={"inclination_deg": lean})})
    u, inclined, _ = record(scene, 50.0, 0.0, seed=5)
    force = np.cos(np.radians(5.0 + lean)) * inclined
    fit = fit_soil(u, force, 0.01 * force.mean(), scene, parameters=("peak_friction_deg",))
    assert fit.values[0] == pytest.approx(44.0, abs=0.02)  # no noise: what is left is the march's tolerance


def test_record_without_softening_says_what_it_cannot_tell():
    # u is beyond the mobilization length at the first reading, and no peak is left: the length cannot be seen
    u, force, std = record(scene_of(35.0, 35.0, 1.0), 30.0, 0.01, seed=1)
    fit = fit_soil(u, force, std, scene_of(40.0, 30.0, 1.0))
    assert abs(fit.values[0] - 35.0) < 0.5
    length = fit.parameters.index("mobilization_length_mm")
    assert "mobilization_length_mm is not determined" in fit.message
    assert np.isinf(fit.std[length])
    assert np.isinf(fit.interval_95[length]).all()


def test_records_that_cannot_be_used_are_refused():
    scene = scene_of(50.0, 32.0, 1.0)
    with pytest.raises(DataError, match="rows"):
        fit_soil([0.0, 1.0, np.nan], [1.0, np.nan, 1.0], 0.1, scene)
    with pytest.raises(ConfigError, match="cohesion"):
        fit_soil(np.arange(9.0), np.arange(9.0), 0.1, scene, parameters=("cohesion",))
