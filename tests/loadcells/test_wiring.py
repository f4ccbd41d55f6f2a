"""Swapped and sign-flipped cells, from forces of known size and place."""

from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ploughval.loadcells.bending import CellGeometry, moments
from ploughval.loadcells.motion import find_motion
from ploughval.loadcells.response import CellResponse
from ploughval.loadcells.run_log import RunLog
from ploughval.loadcells.wiring import AS_LOGGED, Wiring, mean_action, recognise, wiring_of

ONE = CellResponse.constant(np.ones(2), np.zeros(2))
GEOMETRY = CellGeometry(150.0, 260.0)
WAYS = tuple(product((False, True), ((1, 1), (-1, -1), (-1, 1), (1, -1))))


def miswired(true, swapped, signs):
    """The columns as a log would hold them: what :meth:`Wiring.apply` with these settings turns back."""
    columns = true * np.array(signs, float)[:, None]
    return columns[::-1] if swapped else columns


def true_moments(force, arm, geometry):
    return np.stack(
        moments(force, np.broadcast_to(arm, force.shape), geometry.spacing_mm, geometry.lower_to_tip_mm)
    )


@settings(max_examples=300, deadline=None)
@given(
    st.floats(10, 100), st.floats(100, 400), st.floats(50, 200), st.floats(0.0, 1.0), st.sampled_from(WAYS)
)
def test_every_wiring_is_recognised_where_the_cells_are_above_the_sand(depth, lower, spacing, height, way):
    assume(lower > 1.8 * depth)
    geometry = CellGeometry(spacing, lower)
    true = true_moments(30 + 8 * np.sin(np.arange(50.0)), height * depth, geometry)
    found = recognise(miswired(true, *way), ONE, geometry, depth)
    assert found is not None
    assert (found.swapped, found.signs) == way
    np.testing.assert_array_equal(found.apply(miswired(true, *way)), true)


@settings(max_examples=300, deadline=None)
@given(
    st.floats(10, 100), st.floats(100, 400), st.floats(50, 200), st.floats(-1.0, 3.0), st.sampled_from(WAYS)
)
def test_no_wiring_but_the_true_one_is_ever_claimed(depth, lower, spacing, height, way):
    geometry = CellGeometry(spacing, lower)
    true = true_moments(30 + 8 * np.sin(np.arange(50.0)), height * depth, geometry)
    assume(height * depth < lower)
    found = recognise(miswired(true, *way), ONE, geometry, depth)
    if lower > 1.8 * depth:
        # Other ways push against the travel or act above the lower cell.
        assert found is None or (found.swapped, found.signs) == way
    elif found is not None and found.words:
        force, arm = mean_action(ONE.moments(found.apply(miswired(true, *way))), geometry)
        assert force > 0
        assert -0.25 * depth <= arm <= 1.75 * depth


def log(cells, *, rest=4.0, noise=0.0, seed=0):
    """A run of 20 mm at 1 mm/s after a rest; ``cells`` (2,) is the mean moment in motion."""
    t = np.arange(0, rest + 20, 0.02)
    u = np.clip(t - rest, 0, None)
    readings = np.array([[0.3], [-0.2]]) + np.where(t > rest, np.asarray(cells)[:, None], 0.0)
    readings = readings + np.random.default_rng(seed).normal(0, noise, readings.shape)
    return RunLog("run.csv", t, u, readings, find_motion(u))


SAND = true_moments(np.array([30.0]), 10.0, GEOMETRY)
BOX = true_moments(np.array([3.0]), 15.0, GEOMETRY)


@pytest.mark.parametrize("way", WAYS)
def test_a_test_and_its_empty_runs_are_read_right_and_it_is_said(way):
    faults = []
    test, empty = (log(miswired(cells, *way)[:, 0], noise=0.004) for cells in (SAND + BOX, BOX))
    wiring = wiring_of(test, [empty], ONE, GEOMETRY, 30.0, faults)
    assert (wiring.swapped, wiring.signs) == way
    if way == (False, (1, 1)):
        assert wiring is AS_LOGGED
        assert faults == []
        assert wiring.rewired(test) is test
    else:
        assert len(faults) == 1
        assert wiring.words in faults[0]
        back = wiring.rewired(test).readings
        np.testing.assert_array_equal(miswired(back, *way), test.readings)


def test_friction_as_large_as_the_force_does_not_hide_the_wiring():
    faults = []
    box = true_moments(np.array([30.0]), 200.0, GEOMETRY)  # at the seals, above the sand
    test, empty = (log(-cells[:, 0], noise=0.004) for cells in (SAND + box, box))
    assert wiring_of(test, [empty], ONE, GEOMETRY, 30.0, faults).signs == (-1, -1)
    assert len(faults) == 1


def test_a_force_where_no_sand_is_stays_as_logged_and_is_said():
    faults = []
    high = true_moments(np.array([30.0]), 120.0, GEOMETRY)
    assert wiring_of(log(high[:, 0]), [], ONE, GEOMETRY, 30.0, faults) is AS_LOGGED
    assert "30 N and acts 120 mm above the tip" in faults[0]
    assert "no other order or sign" in faults[0]


def test_what_more_than_one_wiring_explains_stays_as_logged_and_is_said():
    faults = []
    low = CellGeometry(50.0, 100.0)  # cells at 100 and 150 mm, a blade of 100 mm: above and within its heap
    true = true_moments(np.array([30.0]), 33.0, low)
    assert wiring_of(log(-true[:, 0]), [], ONE, low, 100.0, faults) is AS_LOGGED
    assert "more than one other order or sign" in faults[0]


def test_a_tiny_force_tells_nothing():
    faults = []
    # 1000 moving and 200 rest rows of 0.05 N m: the mean is known to 0.05 sqrt(2 / 170) / 0.15 m = 0.04 N.
    assert wiring_of(log(-SAND[:, 0] / 150, noise=0.05), [], ONE, GEOMETRY, 30.0, faults) is AS_LOGGED
    assert faults == []


def test_a_force_within_what_empty_runs_differ_tells_nothing():
    faults = []
    # Levels of 27 and 33 N: one more run is 30 N within 4.2 sqrt(1.5) = 5.2 N; the test's is 32 N.
    box = true_moments(np.array([30.0]), 200.0, GEOMETRY)[:, 0]
    runs = [log(share * box, noise=0.004, seed=seed) for seed, share in enumerate((0.9, 1.1))]
    assert wiring_of(log(1.07 * box, noise=0.004), runs, ONE, GEOMETRY, 30.0, faults) is AS_LOGGED
    assert faults == []


def test_without_rest_or_motion_nothing_is_told():
    faults = []
    moving = log(-SAND[:, 0])
    t = moving.time_s[250:]
    without = RunLog(
        "run.csv", t, moving.u_mm[250:], moving.readings[:, 250:], find_motion(moving.u_mm[250:])
    )
    still = RunLog("run.csv", moving.time_s, 0 * moving.u_mm, moving.readings, None)
    assert wiring_of(without, [], ONE, GEOMETRY, 30.0, faults) is AS_LOGGED
    assert wiring_of(still, [], ONE, GEOMETRY, 30.0, faults) is AS_LOGGED
    assert faults == []


def test_as_logged_changes_nothing():
    readings = np.random.default_rng(0).normal(size=(2, 5))
    assert AS_LOGGED.apply(readings) is readings
    assert Wiring() == AS_LOGGED
