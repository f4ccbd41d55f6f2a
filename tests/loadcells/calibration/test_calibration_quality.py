"""Quality figures against cells whose faults are made: a loop, a zero that moves, runs that differ."""

import numpy as np
import pytest

from ploughval.loadcells.calibration.choice import choose_model
from ploughval.loadcells.calibration.fit import Session
from ploughval.loadcells.calibration.fitted import response_of
from ploughval.loadcells.calibration.quality import LIMIT_SHARE, quality_table

UP_DOWN = np.array([0, 10, 20, 30, 40, 50, 40, 30, 20, 10, 0], float)
DIRECTION = np.array(["up"] * 6 + ["down"] * 5)
GAIN = np.array([[0.02], [0.025]])


def figures(added_Nm, *, runs=1, arms=None, coefficients=None, step=0.0):
    """Quality of cells whose readings show moments with something added (2, runs * 11)."""
    load = np.tile(UP_DOWN, runs)
    arm = np.repeat(np.zeros(runs) if arms is None else arms, UP_DOWN.size)
    moments = np.stack([load * (410 - arm), load * (260 - arm)]) / 1000
    coefficients = np.diag(GAIN[:, 0]) if coefficients is None else coefficients
    readings = np.linalg.solve(coefficients, moments + added_Nm)
    run = np.repeat(np.arange(runs), UP_DOWN.size)
    session = Session(readings, moments, run, np.zeros((0, 2, load.size)), np.full(2, step))
    choice = choose_model(session)
    none = np.zeros_like(moments)
    fitted = response_of(session, choice, (none, none))
    table = quality_table(session, fitted, np.tile(DIRECTION, runs), spacing_mm=150.0, lower_to_tip_mm=260.0)
    return table.set_index(["quantity", "cell"]), fitted


def test_a_loop_is_the_hysteresis_and_no_return_to_zero():
    """The way down 0.2 % of full scale above the way up at the middle loads."""
    loop = np.where(DIRECTION == "down", 1.0, 0.0) * (UP_DOWN > 0) * np.array([[0.041], [0.026]])
    table, _ = figures(loop)
    # The constants follow the loop by a part of itself: 0.2 % of 0.2 %.
    assert table.loc[("hysteresis", "upper"), "value"] == pytest.approx(0.041, rel=0.01)
    assert table.loc[("hysteresis", "lower"), "percent_of_full_scale"] == pytest.approx(0.2, rel=0.01)
    assert table.loc[("return to zero", "upper"), "value"] == pytest.approx(0.0, abs=1e-9)


def test_a_zero_that_moves_is_the_return_to_zero():
    moved = np.zeros((2, 11))
    moved[:, -1] = [0.02, -0.03]
    table, _ = figures(moved)
    assert table.loc[("return to zero", "upper"), "value"] == pytest.approx(0.02, rel=0.01)
    assert table.loc[("return to zero", "lower"), "value"] == pytest.approx(0.03, rel=0.01)


def test_repeatability_is_the_scatter_between_runs_that_repeat():
    rng = np.random.default_rng(1)
    table, _ = figures(0.01 * rng.normal(size=(2, 11 * 40)), runs=40)
    # The zero of a run is fitted to its 11 rows; 360 degrees of freedom scatter by 3.7 %.
    expected = 0.01 * np.sqrt(1 - 1 / 11)
    assert table.loc[("repeatability", "upper"), "value"] == pytest.approx(expected, rel=0.11)


def test_reproducibility_is_the_spread_of_the_sensitivities():
    factors = np.array([-0.01, 0.0, 0.01])
    load = np.tile(UP_DOWN, 3)
    moments = np.stack([load * 410, load * 260]) / 1000
    table, fitted = figures(moments * np.repeat(factors, 11), runs=3)
    # One per cent of standard deviation; read over the common constant, second order 1 % of that.
    assert table.loc[("reproducibility", "upper"), "percent_of_full_scale"] == pytest.approx(1.0, rel=0.02)
    assert np.sqrt(fitted.spread.relative_variance) == pytest.approx(0.01, rel=0.02)
    std = np.sqrt([fitted.response.cov[k, k, k, k] for k in (0, 1)]) / GAIN[:, 0]
    assert (std > 0.01).all()


def test_a_cell_that_bends_has_that_linearity_error():
    """A bend of 1 % of full scale at mid-range: the straight line leaves most of it at the ends."""
    share = UP_DOWN / 50
    bend = 4 * 0.01 * share * (1 - share) * np.array([[20.5], [13.0]])
    table, fitted = figures(bend)
    assert fitted.choice.fit.model.name == "second order"
    line = np.polyfit((UP_DOWN * 0.41 + bend[0]) / 0.02, UP_DOWN * 0.41, 1)
    left = UP_DOWN * 0.41 - np.polyval(line, (UP_DOWN * 0.41 + bend[0]) / 0.02)
    expected = np.abs(left[:6]).max()
    # Both unloaded and both middle rows share levels, the way up alone counts.
    assert table.loc[("linearity", "upper"), "value"] == pytest.approx(expected, rel=0.01)


def test_cross_talk_is_the_part_that_comes_from_the_other_cell():
    table, _ = figures(
        np.zeros((2, 22)),
        runs=2,
        arms=np.array([0.0, 150.0]),
        coefficients=np.array([[0.02, 0.0005], [0, 0.025]]),
    )
    lower_reading = 13.0 / 0.025
    assert table.loc[("cross-talk", "upper"), "value"] == pytest.approx(0.0005 * lower_reading, rel=1e-3)
    assert table.loc[("cross-talk", "lower"), "value"] == pytest.approx(0.0, abs=1e-6)


def test_the_resolution_is_a_step_of_the_readings():
    table, _ = figures(np.zeros((2, 11)), step=0.5)
    assert table.loc[("resolution", "upper"), "value"] == pytest.approx(0.01, rel=1e-3)


def test_at_the_lower_limit_the_expanded_uncertainty_is_its_share():
    rng = np.random.default_rng(2)
    table, fitted = figures(0.01 * rng.normal(size=(2, 440)), runs=40)
    limit = table.loc[("lower limit", "force"), "value"]
    # Many rows: hardly more than scatter counts, and Student's factor is 1.97.
    scatter = np.sqrt((fitted.choice.fit.scatter_Nm**2).sum()) * 1000 / 150
    assert limit == pytest.approx(1.966 * scatter / LIMIT_SHARE, rel=0.02)


def test_what_a_session_does_not_tell_is_empty_with_a_reason():
    table, _ = figures(np.zeros((2, 11)))
    for quantity in ("repeatability", "reproducibility", "cross-talk"):
        row = table.loc[(quantity, "upper")]
        assert np.isnan(row["value"])
        assert row["note"]
