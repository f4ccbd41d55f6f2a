"""Known constants come back from made calibrations, whatever the model, the runs and their zeros."""

import numpy as np
import pytest

from ploughval.loadcells.calibration.fit import Session, fit_model
from ploughval.loadcells.calibration.models import MODELS, condition_number, levels

STRAIGHT, CURVED, CROSSED, BOTH = MODELS
LOADS = np.array([0, 10, 20, 30, 40, 50, 40, 30, 20, 10, 0], float)


def moments_of(load, arm):
    return np.stack([load * (410 - arm), load * (260 - arm)]) / 1000


def session(readings_of, *, arms=(0.0, 60.0, 120.0), rng=None, noise_Nm=0.0, errors=None):
    """Readings, less the zeros of their run, of the moments that loads at these arms make."""
    load, arm = np.tile(LOADS, len(arms)), np.repeat(arms, LOADS.size)
    run = np.repeat(np.arange(len(arms)), LOADS.size)
    moments = moments_of(load, arm)
    seen = moments if rng is None else moments + noise_Nm * rng.normal(size=moments.shape)
    zeros = np.array([[100.0], [-50.0]]) + np.array([[3.0], [-7.0]]) * run
    errors = np.zeros((0, *moments.shape)) if errors is None else errors
    return Session(readings_of(seen) + zeros, moments, run, errors, np.zeros(2))


def inverse(coefficients):
    """Readings of straight cells with cross-talk."""
    return lambda moments: np.linalg.solve(coefficients, moments)


def bent(gain, square):
    """Readings of cells whose moment is gain r + square r^2, in closed form."""
    gain, square = np.array(gain)[:, None], np.array(square)[:, None]
    return lambda m: (-gain + np.sqrt(gain**2 + 4 * square * m)) / (2 * square)


def test_straight_cells_come_back_with_the_zero_of_every_run():
    fit = fit_model(session(inverse(np.diag([0.02, -0.025]))), STRAIGHT)
    np.testing.assert_allclose(fit.coefficients, np.diag([0.02, -0.025]), atol=1e-12)
    np.testing.assert_allclose(fit.zeros, [[100, 103, 106], [-50, -57, -64]], atol=1e-8)


def test_second_order_comes_back_about_the_zero():
    fit = fit_model(session(bent([0.02, 0.025], [2e-6, -3e-6])), CURVED)
    np.testing.assert_allclose(
        fit.coefficients, [[0.02, 0, 2e-6, 0], [0, 0.025, 0, -3e-6]], rtol=1e-9, atol=1e-15
    )


def test_second_order_comes_back_although_no_run_was_unloaded():
    made = session(bent([0.02, 0.025], [2e-6, -3e-6]))
    loaded = (made.moments > 0).all(axis=0)
    some = Session(
        made.readings[:, loaded], made.moments[:, loaded], made.run[loaded], np.zeros((0, 2, 27)), np.zeros(2)
    )
    fit = fit_model(some, CURVED)
    np.testing.assert_allclose(fit.coefficients[[0, 1], [0, 1]], [0.02, 0.025], rtol=1e-8)
    np.testing.assert_allclose(fit.zeros, [[100, 103, 106], [-50, -57, -64]], atol=1e-4)


def test_cross_talk_comes_back():
    true = np.array([[0.02, 0.0005], [-0.0002, 0.025]])
    fit = fit_model(session(inverse(true)), CROSSED)
    np.testing.assert_allclose(fit.coefficients, true, atol=1e-12)


def test_units_of_the_readings_change_the_constants_alone():
    made = session(
        inverse(np.array([[0.02, 0.0005], [0.0, 0.025]])), rng=np.random.default_rng(1), noise_Nm=0.01
    )
    other = Session(made.readings * 1e6, made.moments, made.run, made.errors, made.resolution)
    a, b = fit_model(made, BOTH), fit_model(other, BOTH)
    scale = np.array([1e6, 1e6, 1e12, 1e12])
    np.testing.assert_allclose(b.coefficients * scale, a.coefficients, rtol=1e-6, atol=1e-12)
    assert b.aicc == pytest.approx(a.aicc, abs=1e-6)


def test_a_row_left_out_has_no_say_and_its_shift_is_what_it_is_off_by():
    made = session(inverse(np.diag([0.02, 0.025])), rng=np.random.default_rng(2), noise_Nm=0.01)
    moments = made.moments.copy()
    moments[:, 15] += [3.0, 2.0]
    wrong = Session(made.readings, moments, made.run, made.errors, made.resolution)
    keep = np.arange(33) != 15
    without = Session(
        made.readings[:, keep], moments[:, keep], made.run[keep], np.zeros((0, 2, 32)), np.zeros(2)
    )
    fit, clean = fit_model(wrong, STRAIGHT, (15,)), fit_model(without, STRAIGHT)
    np.testing.assert_allclose(fit.coefficients, clean.coefficients, rtol=1e-10)
    np.testing.assert_allclose(fit.scatter_Nm, clean.scatter_Nm, rtol=1e-6)
    np.testing.assert_allclose(fit.shifts[0], [3.0, 2.0], atol=5 * 0.011)  # five deviations of one row


def test_one_run_without_known_errors_is_the_straight_line_of_the_textbook():
    made = session(inverse(np.diag([0.02, 0.025])), arms=(0.0,), rng=np.random.default_rng(3), noise_Nm=0.02)
    fit = fit_model(made, STRAIGHT)
    for cell in (0, 1):
        line, cov = np.polyfit(made.readings[cell], made.moments[cell], 1, cov="unscaled")
        left = made.moments[cell] - np.polyval(line, made.readings[cell])
        std = np.sqrt(left @ left / (11 - 2))
        assert fit.coefficients[cell, cell] == pytest.approx(line[0], rel=1e-9)
        assert fit.scatter_Nm[cell] == pytest.approx(std, rel=1e-6)
        assert np.sqrt(fit.cov[cell, cell, cell, cell]) == pytest.approx(std * np.sqrt(cov[0, 0]), rel=1e-6)
        assert fit.dof[cell] == pytest.approx(9)


def test_errors_that_rows_share_do_not_average_out():
    """An error of 0.1 % common to all weights is one of 0.1 % of the constants, however many the rows."""
    plain = session(inverse(np.diag([0.02, 0.025])), rng=np.random.default_rng(4), noise_Nm=1e-4)
    shared = Session(plain.readings, plain.moments, plain.run, 1e-3 * plain.moments[None], plain.resolution)
    fit = fit_model(shared, STRAIGHT)
    relative = np.sqrt([fit.cov[k, k, k, k] for k in (0, 1)]) / [0.02, 0.025]
    np.testing.assert_allclose(relative, 1e-3, rtol=0.01)


def test_loads_at_one_arm_have_no_condition_and_apart_a_small_one():
    assert condition_number(moments_of(LOADS, 30.0)) == np.inf
    load, arm = np.tile(LOADS, 2), np.repeat([0.0, 120.0], 11)
    made = moments_of(load, arm)
    unit = made / np.linalg.norm(made, axis=1, keepdims=True)
    cosine = float(unit[0] @ unit[1])
    assert condition_number(made) == pytest.approx(np.sqrt((1 + cosine) / (1 - cosine)), rel=1e-9)


def test_models_that_the_loads_cannot_carry_say_why():
    few = moments_of(np.array([0.0, 50.0, 0.0]), 0.0)
    assert "arms too much alike" in CROSSED.why_not(few, 1, np.inf)
    assert "fewer than 4 different moments" in CURVED.why_not(few, 1, np.inf)
    assert "no more rows than parameters" in STRAIGHT.why_not(few[:, :2], 1, np.inf)
    assert STRAIGHT.why_not(few, 1, np.inf) == ""
    assert levels(few[0]) == 2
