"""From a calibration session and a test in one folder to the force: the rig that both share drops out."""

import numpy as np
import pandas as pd
import pytest

from ploughval.loadcells import measure_force
from ploughval.loadcells.bending import moments
from ploughval.scene import Scene

TRUE_SPACING, TRUE_LOWER = 151.2, 258.5  # told: 150 and 260 mm
GAINS = np.array([250.0, -80.0])  # units of the log a N m
TALK = np.array([[1.0, 0.02], [0.03, 1.0]])  # share of the other cell's moment
NOISE = 0.2  # units


def readings(force_N, arm_mm, zero, rng):
    true = np.stack(moments(np.asarray(force_N, float), np.asarray(arm_mm, float), TRUE_SPACING, TRUE_LOWER))
    return GAINS[:, None] * (TALK @ true) + zero[:, None] + rng.normal(0, NOISE, true.shape)


def write(folder, rng):
    rows = []
    for arm in (0.0, 60.0, 120.0):
        loads = np.array([0.0, 10, 20, 30, 40, 30, 20, 10, 0])
        upper, lower = readings(loads, np.full(9, arm), np.array([40.0, -7.0]), rng)
        rows += list(zip(loads, np.full(9, arm), upper, lower, strict=True))
    pd.DataFrame(rows, columns=["load_N", "arm_mm", "upper", "lower"]).to_csv(
        folder / "cells.csv", index=False
    )
    t = np.arange(0, 30, 0.05)
    u = np.clip(t - 5, 0, None)
    force = np.where(t > 5, 25 + 5 * np.sin(u / 2), 0.0)
    upper, lower = readings(force, np.full(t.size, 10.0), np.array([31.0, 2.0]), rng)
    table = pd.DataFrame(
        {"time_s": t, "displacement_mm": u, "moment_upper_Nm": upper, "moment_lower_Nm": lower}
    )
    table.to_csv(folder / "loadcells.csv", index=False)
    cells = {
        "log": "loadcells.csv",
        "spacing_mm": 150.0,
        "lower_to_tip_mm": 260.0,
        "spacing_std_mm": 1.0,
        "lower_to_tip_std_mm": 1.0,
        "calibration": {"files": ["cells.csv"]},
    }
    scene = {
        "folder": folder,
        "test": {"name": "t"},
        "blade": {"depth_mm": 30, "width_mm": 218},
        "loadcells": cells,
    }
    return Scene.model_validate(scene), force, t > 5


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    scene, force, moving = write(tmp_path_factory.mktemp("rig"), np.random.default_rng(4))
    return measure_force(scene), force, moving


def test_force_and_arm_are_right_although_the_geometry_told_is_wrong_by_a_per_cent(measured):
    result, force, moving = measured
    record = result.record[moving]
    error = record["force_N"].to_numpy() - force[moving]
    # Noise of a sample is 0.2 / 80 N m in the lower cell: 0.018 N with the upper's. A spacing wrong by 0.8 %
    # alone would make the force wrong by 0.2 N, an arm by 8.
    assert abs(error.mean()) < 0.02
    assert error.std() < 0.03
    assert abs(record["arm_mm"].mean() - 10.0) < 0.3


def test_the_budget_says_that_the_spacing_hardly_matters_to_the_force(measured):
    result, _, _ = measured
    budget = result.budget.set_index("source")
    # Told 1 mm of 150: 0.17 N for constants that were given.
    assert abs(budget.loc["spacing", "sensitivity_N"]) < 0.01
    assert result.record["force_std_N"].median() < 0.05
    assert budget["share"].sum() == pytest.approx(1.0)
    assert budget["arm_share"].sum() == pytest.approx(1.0)
    assert budget.loc["scatter about the calibration, lower cell", "std"] == pytest.approx(
        result.calibration.scatter_Nm[1]
    )


def test_cross_talk_is_chosen_and_stated(measured):
    result, _, _ = measured
    assert result.calibration.model.startswith("cross-talk")
    inverse = np.linalg.inv(GAINS[:, None] * TALK)
    told = result.calibration.response.coefficients[:, :2]
    # the told geometry is wrong by a per cent, and the moments with it
    np.testing.assert_allclose(told, inverse, rtol=0.05, atol=0.02 * np.abs(inverse).max())
