"""The material-point run's cells: read back, they give its force and a third of the depth."""

import numpy as np
import pandas as pd
import pytest

from ploughval.scene import load_scene
from ploughval.synth.options import SynthOptions
from virtual.experiment import TOLD, felt_by_blade, make_experiment, state_direction
from virtual.photographs import OPTIONS, VirtualRun

TRAVEL_MM = np.linspace(0.0, 1.0, 101)
FORCE_N_PER_M = 40.0 + 10.0 * np.sin(3.0 * TRAVEL_MM)


def small_run():
    y, x = np.mgrid[:40, :60] * 0.625
    first = np.column_stack([x.ravel(), y.ravel() - 5.0])
    return VirtualRun(
        np.array([0.0, 1.0]), np.stack([first, np.add(first, [0.6, 0.3])]), 5.0, 30.0, 37.5, 6.0
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("virtual") / "test"
    return folder, make_experiment(folder, small_run(), (TRAVEL_MM, FORCE_N_PER_M))


def test_folder_tells_the_sand_with_its_uncertainty(made):
    folder, _ = made
    scene = load_scene(folder)
    assert scene.soil == TOLD
    assert scene.model.direction == "least_force"
    assert scene.blade.width_mm == OPTIONS.width_mm


def test_cells_give_back_the_force_and_a_third_of_the_depth(made):
    folder, felt = made
    scene = load_scene(folder)
    cells = scene.loadcells
    log = pd.read_csv(folder / "loadcells.csv")
    empty = [pd.read_csv(path) for path in sorted((folder / "empty").glob("*.csv"))]
    rest, moving = log["time_s"] < cells.rest_s[1], felt.u_mm > 0.1
    columns = ["moment_upper_Nm", "moment_lower_Nm"]

    def moments(table):
        return (table[columns] - table.loc[rest, columns].mean()).to_numpy()[moving]

    sand = moments(log) - np.mean([moments(run) for run in empty], axis=0)
    force = (sand[:, 0] - sand[:, 1]) / (cells.spacing_mm * 1e-3)
    arm = cells.lower_to_tip_mm - 1e3 * sand[:, 1] / force
    true = np.interp(felt.u_mm[moving], TRAVEL_MM, FORCE_N_PER_M) * scene.blade.width_mm / 1e3
    # what remains is the scatter of the box's friction between runs: three of it
    assert abs(np.mean(force - true)) < 3 * OPTIONS.friction_scatter * OPTIONS.friction_N * np.sqrt(4 / 3)
    # the line of action wanders by a few hundredths of the depth about its third
    assert np.mean(arm) / scene.blade.depth_mm == pytest.approx(1 / 3, abs=0.08)


def test_photographs_and_log_share_their_clock(made):
    folder, felt = made
    times = pd.read_csv(folder / "photos.csv")["time_s"].to_numpy()
    np.testing.assert_allclose(np.interp(times, felt.time_s, felt.u_mm), small_run().u_mm, atol=1e-9)


def test_force_is_for_the_width_that_is_told():
    options = SynthOptions(width_mm=218.0, displacement_mm=1.0)
    felt = felt_by_blade((TRAVEL_MM, FORCE_N_PER_M), options)
    moving = felt.force_N > 0
    expected = 0.218 * np.interp(felt.u_mm[moving], TRAVEL_MM, FORCE_N_PER_M)
    np.testing.assert_allclose(felt.force_N[moving], expected)


def test_another_direction_is_told_alone(made):
    folder, _ = made
    before = load_scene(folder)
    state_direction(folder, "least_softened")
    after = load_scene(folder)
    assert after.model.direction == "least_softened"
    same = {"folder", "source", "model"}
    assert after.model_dump(exclude=same) == before.model_dump(exclude=same)
    state_direction(folder, "least_force")
