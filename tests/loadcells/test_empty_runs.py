"""Empty runs held against the test that they are to compensate."""

import numpy as np
import pytest

from ploughval.loadcells.empty_runs import friction_from
from ploughval.loadcells.motion import find_motion
from ploughval.loadcells.response import CellResponse
from ploughval.loadcells.run_log import RunLog
from ploughval.loadcells.zero import zero_of

ONE = CellResponse.constant(np.ones(2), np.zeros(2))


def run(name, level, *, speed=1.0, travel=20.0, rest=4.0, seed=0):
    """A run whose friction is ``level`` N m at the upper cell and 0.6 of it at the lower."""
    t = np.arange(0, rest + abs(travel / speed) + 1, 0.01)
    u = np.clip((t - rest) * abs(speed), 0, abs(travel)) * np.sign(travel)
    moments = np.where(t > rest, np.array([[level], [0.6 * level]]), 0.0)
    moments = moments + np.array([[0.3], [-0.2]]) + np.random.default_rng(seed).normal(0, 0.002, (2, t.size))
    return RunLog(name, t, u, moments, find_motion(u))


TEST = run("test.csv", 5.0)
ZERO = zero_of(TEST.time_s[TEST.resting], TEST.readings[:, TEST.resting])


def friction(*runs):
    faults = []
    return friction_from(runs, TEST, ZERO, ONE, faults), faults


def test_runs_like_the_test_are_used_without_a_word():
    found, faults = friction(run("a.csv", 1.0, seed=1), run("b.csv", 1.1, seed=2))
    assert faults == []
    assert found.runs == 2
    # 1920 rows of 0.002 and as many zeros as rest: 1e-4.
    np.testing.assert_allclose(found.mean[:, 0], [1.05, 0.63], atol=5e-4)


def test_a_run_the_other_way_is_left_out_for_its_sign():
    back = run("back.csv", -1.0, travel=-20.0)
    found, faults = friction(run("a.csv", 1.0, seed=1), back, run("b.csv", 1.0, seed=2))
    assert found.runs == 2
    assert len(faults) == 1
    assert "back.csv: the blade travels -20 mm, against the test's 20 mm: left out" in faults[0]
    found, faults = friction(back)
    assert found is None


def test_another_speed_and_a_shorter_travel_are_said_and_used():
    found, faults = friction(run("fast.csv", 1.0, speed=2.0), run("short.csv", 1.0, travel=10.0))
    assert found.runs == 2
    assert len(faults) == 2
    assert "fast.csv: its speed is 2 mm/s, the test's 1 mm/s" in faults[0]
    assert "short.csv: it travels 10 mm of the test's 20 mm" in faults[1]


def test_a_run_that_is_unlike_all_others_is_said():
    runs = [run("a.csv", 1.0, seed=1), run("b.csv", 1.04, seed=2), run("sand.csv", 6.0, seed=3)]
    found, faults = friction(*runs)
    assert found.runs == 3
    assert len(faults) == 1
    assert "sand.csv: its friction is 6 and 3.6 N m, that of the other runs 1.02 and 0.612 N m" in faults[0]


def test_runs_that_scatter_by_a_tenth_are_not_said():
    runs = [run("a.csv", 1.0, seed=1), run("b.csv", 1.0, seed=2), run("c.csv", 1.1, seed=3)]
    assert friction(*runs)[1] == []


def test_friction_that_drives_the_blade_on_is_said():
    _, faults = friction(run("a.csv", -1.0, seed=1), run("b.csv", -1.02, seed=2))
    assert len(faults) == 1
    # Upper less lower moment: -1.01 (1 - 0.6) N m.
    assert "drives the blade on (upper less lower moment -0.404 N m)" in faults[0]
    assert "order and signs of their columns" in faults[0]


def test_friction_too_small_for_a_sign_is_not_doubted():
    _, faults = friction(run("a.csv", -0.01, seed=1), run("b.csv", 0.005, seed=2), run("c.csv", 0.0, seed=3))
    assert faults == []


def test_one_run_is_said_to_hide_the_spread():
    found, faults = friction(run("a.csv", 1.0))
    assert found.runs == 1
    assert "a single empty-box run" in faults[0]


def test_a_run_without_motion_is_left_out_by_name():
    still = run("still.csv", 1.0)
    still = RunLog("still.csv", still.time_s, 0 * still.u_mm, still.readings, None)
    found, faults = friction(still, run("a.csv", 1.0), run("b.csv", 1.0, seed=3))
    assert found.runs == 2
    assert faults == ["still.csv: no motion found: left out of the friction"]


def test_a_run_without_rest_takes_the_zeros_of_the_test():
    whole = run("late.csv", 1.0, seed=4)
    late = slice(450, None)
    cut = RunLog(
        "late.csv",
        whole.time_s[late],
        whole.u_mm[late],
        whole.readings[:, late],
        find_motion(whole.u_mm[late]),
    )
    found, faults = friction(cut, run("a.csv", 1.0, seed=5))
    assert "late.csv: no rest before motion: the test's zeros are used" in faults
    np.testing.assert_allclose(found.mean[:, 0], [1.0, 0.6], atol=5e-4)


@pytest.mark.parametrize("lost", [slice(0, 3), slice(1000, 1200)])
def test_missing_rows_neither_stop_nor_shift_a_run(lost):
    gappy = run("gap.csv", 1.0, seed=6)
    gappy.readings[:, lost] = np.nan
    gappy.u_mm[lost] = np.nan
    found, faults = friction(gappy, run("a.csv", 1.0, seed=7))
    assert faults == []
    np.testing.assert_allclose(found.mean[:, 0], [1.0, 0.6], atol=5e-4)


def test_without_runs_there_is_no_friction():
    assert friction() == (None, [])
