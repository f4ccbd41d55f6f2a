"""Mistakes in rows drawn at random: the row is found every time, its cause nearly so."""

import numpy as np
import pytest

from ploughval.loadcells.calibration.blunders import Rig, likely_cause
from ploughval.loadcells.calibration.choice import choose_model
from ploughval.loadcells.calibration.fit import Session
from ploughval.loadcells.calibration.wiring import odd_runs, run_slopes

LOADS = np.array([0, 10, 20, 30, 40, 50, 40, 30, 20, 10, 0], float)
ARMS = (0.0, 100.0)
CROSSED = np.array([[0.02, 0.0005], [0.0002, 0.025]])
DRAWS = 25


def session(rng, *, arms=ARMS, coefficients=CROSSED, noise_Nm=0.02):
    load, arm = np.tile(LOADS, len(arms)), np.repeat(arms, LOADS.size)
    lever = np.stack([410 - arm, 260 - arm]) / 1000
    readings = np.linalg.solve(coefficients, load * lever + noise_Nm * rng.normal(size=lever.shape))
    run = np.repeat(np.arange(len(arms)), LOADS.size)
    return readings + np.array([[100.0], [-50.0]]), load, lever, run


def weight_too_many(readings, load, lever, row):
    return readings, load * lever + 10.0 * lever * (np.arange(load.size) == row)


def arm_of_the_other_run(readings, load, lever, row):
    other = np.where(lever[0, row] == 0.41, 0.1, -0.1)
    return readings, load * (lever - other * (np.arange(load.size) == row))


def slip_of_the_pen(readings, load, lever, row):
    return readings + np.outer([100.0, 0.0], np.arange(load.size) == row), load * lever


def sign(readings, load, lever, row):
    return readings, load * lever * np.where(np.arange(load.size) == row, -1, 1)


def crosswise(readings, load, lever, row):
    return np.where(np.arange(load.size) == row, readings[::-1], readings), load * lever


@pytest.mark.parametrize(
    ("mistake", "text"),
    [
        (weight_too_many, "one weight of 10 N less"),
        (arm_of_the_other_run, "is an arm that was used"),
        (slip_of_the_pen, "the upper reading alone is off"),
        (sign, "the sign of the load or of both readings is turned"),
        (crosswise, "the readings of the two cells are exchanged"),
    ],
)
def test_the_row_is_found_in_every_draw_and_its_cause_in_nine_of_ten(mistake, text):
    rng = np.random.default_rng(1)
    named = 0
    for _ in range(DRAWS):
        readings, load, lever, run = session(rng)
        row = int(rng.choice(np.flatnonzero(load >= 20)))
        wrong, moments = mistake(readings, load, lever, row)
        made = Session(wrong, moments, run, np.zeros((0, 2, load.size)), np.zeros(2))
        fit = choose_model(made).fit
        assert fit.left_out == (row,)
        rig = Rig(150.0, 260.0, np.unique(LOADS), np.array(ARMS))
        named += text in likely_cause(made, fit, row, rig)
    assert named >= 0.9 * DRAWS


def made_runs(change):
    readings, load, lever, run = session(np.random.default_rng(2), arms=(0.0, 50.0, 100.0))
    moments = load * lever
    readings, moments = change(readings, moments, run == 1)
    return Session(readings, moments, run, np.zeros((0, 2, load.size)), np.zeros(2))


def test_sensitivities_of_the_runs_are_readings_per_moment():
    readings, load, lever, run = session(
        np.random.default_rng(3), coefficients=np.diag([0.02, 0.025]), noise_Nm=0
    )
    made = Session(readings, load * lever, run, np.zeros((0, 2, load.size)), np.zeros(2))
    np.testing.assert_allclose(run_slopes(made), [[50.0, 50.0], [40.0, 40.0]])


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda r, m, odd: (np.where(odd, -r, r), m), "the sign of the upper and lower cell is turned"),
        (lambda r, m, odd: (np.where(odd, r[::-1], r), m), "upper and lower cell are exchanged"),
        (lambda r, m, odd: (r, np.where(odd, m / 1000, m)), "a thousand times apart"),
        (lambda r, m, odd: (r, np.where(odd, m / 4.4482216, m)), "pounds and newtons"),
        (lambda r, m, odd: (r, np.where(odd, 2 * m, m)), "0.5 times as much in the upper cell"),
    ],
)
def test_a_run_unlike_the_others_is_told_with_what_it_differs_in(change, text):
    ((run, told),) = odd_runs(made_runs(change))
    assert run == 1
    assert text in told


def test_runs_alike_are_not_odd():
    assert odd_runs(made_runs(lambda r, m, odd: (r, m))) == []
