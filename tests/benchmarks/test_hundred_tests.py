"""The made tests: what is stated of sand and cells is true in the long run, and told in the folder."""

import json
import math

import numpy as np
import pandas as pd
import pytest

from hundred_tests import SOIL_STDS, index_of, make_test, recipe_of
from ploughval.scene import load_scene
from ploughval.synth import adapt

COUNT = 300


@pytest.fixture(scope="module")
def recipes():
    return [recipe_of(number) for number in range(COUNT)]


@pytest.mark.parametrize("name", SOIL_STDS)
def test_sand_deviates_from_what_is_told_by_the_stated_normal(recipes, name):
    told = [recipe.options.told_soil for recipe in recipes]
    true = [recipe.options.soil for recipe in recipes]
    z = np.array(
        [
            (getattr(b, name) - getattr(a, name)) / getattr(a, SOIL_STDS[name])
            for a, b in zip(told, true, strict=True)
        ]
    )
    # three standard errors of the mean and of the standard deviation of COUNT standard normals
    assert abs(z.mean()) < 3 / math.sqrt(COUNT)
    assert abs(z.std() - 1) < 3 / math.sqrt(2 * COUNT)


def test_cells_deviate_by_the_stated_normal(recipes):
    z = np.array([(np.array(r.cells.ratio) - 1) / r.cells.std for r in recipes])
    assert abs(z.mean()) < 3 / math.sqrt(z.size)
    assert abs(z.std() - 1) < 3 / math.sqrt(2 * z.size)


def test_soils_cover_their_ranges_and_can_be(recipes):
    told = [recipe.options.told_soil for recipe in recipes]
    for soil in (*told, *(recipe.options.soil for recipe in recipes)):
        assert soil.residual_friction_deg < soil.peak_friction_deg
    peaks = np.array([soil.peak_friction_deg for soil in told])
    lengths = np.array([soil.mobilization_length_mm for soil in told])
    assert 34 <= peaks.min() < 35
    assert 51 < peaks.max() <= 52
    assert 0.5 <= lengths.min() < 0.55
    assert 4.5 < lengths.max() <= 5.0


def test_a_recipe_depends_on_its_number_alone(recipes):
    assert recipe_of(7) == recipes[7]
    assert recipe_of(7).options.soil != recipe_of(8).options.soil


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The fourth test without photographs, made in a folder of its own."""
    recipe = recipe_of(3)
    bare = type(recipe)(recipe.number, adapt(recipe.options, soil={}, photographs=False), recipe.cells)
    out = tmp_path_factory.mktemp("hundred")
    make_test(out / recipe.name, bare)
    return out, bare


def test_settings_tell_the_stated_soil_and_sensitivities(small):
    out, recipe = small
    scene = load_scene(out / recipe.name)
    assert scene.soil == recipe.options.told_soil
    assert scene.loadcells.calibration.upper_Nm_per_unit_std == recipe.cells.std
    assert scene.loadcells.calibration.upper_Nm_per_unit == 1.0


def test_log_is_read_by_cells_of_the_true_sensitivity(small):
    out, recipe = small
    folder = out / recipe.name
    log, truth = pd.read_csv(folder / "loadcells.csv"), pd.read_csv(folder / "truth" / "force.csv")
    rest = (log["time_s"] < recipe.options.rest_s - 0.5).to_numpy()
    moving = (truth["force_N"] > 0).to_numpy()
    readings = log[["moment_upper_Nm", "moment_lower_Nm"]].to_numpy()
    moments = (readings - readings[rest].mean(axis=0)) * recipe.cells.ratio
    force = (moments[:, 0] - moments[:, 1]) / (recipe.options.spacing_mm * 1e-3)
    friction = (force - truth["force_N"])[moving]
    # the box's friction is what remains: level and trend within five spreads of the stated one
    expected = recipe.options.friction_N
    assert abs(friction.mean() - expected) < expected * (5 * recipe.options.friction_scatter + 0.03)
    assert friction.std() < 0.1 * expected + 2 * recipe.options.moment_noise_Nm / 0.15


def test_index_tells_true_and_told_values(small):
    out, recipe = small
    table = index_of(out)
    assert len(table) == 1
    row = table.iloc[0]
    assert row["true_peak_friction_deg"] == recipe.options.soil.peak_friction_deg
    assert row["told_peak_friction_deg"] == recipe.options.told_soil.peak_friction_deg
    assert (
        row["gain_ratio_upper"]
        == json.loads((out / recipe.name / "truth" / "cells.json").read_text())["ratio"][0]
    )
    assert not row["processed"]
