"""Logs of coarse steps: what cannot be seen below a step is stated."""

import numpy as np
import pytest

from ploughval.loadcells.bending import CellGeometry, moments
from ploughval.loadcells.drift import zero_line
from ploughval.loadcells.record import Rig, force_from_readings
from ploughval.loadcells.resolution import least_step, with_resolution
from ploughval.loadcells.response import CellResponse
from ploughval.loadcells.zero import zero_of

TIME = np.arange(0, 24, 0.02)
MOVING = TIME > 4
FORCE = np.where(MOVING, 30 + 8 * np.sin(TIME / 3), 0.0)


def stepped(step, noise_steps, rng):
    """Readings of a force at 10 mm, rounded to steps, about offsets that lie anywhere within one."""
    cells = np.stack(moments(FORCE, np.full(TIME.size, 10.0), 150.0, 260.0))
    cells = cells + rng.uniform(-0.5, 0.5, (2, 1)) + rng.normal(0, noise_steps * step, cells.shape)
    return np.round(cells / step) * step


@pytest.mark.parametrize("step", [1e-3, 0.02, 0.3])
def test_the_least_step_is_that_of_the_log(step):
    readings = stepped(step, 1.0, np.random.default_rng(0))
    np.testing.assert_allclose(least_step(readings), step, rtol=1e-9)


def test_readings_that_never_change_have_no_step():
    assert not least_step(np.ones((2, 5))).any()
    assert not least_step(np.ones((2, 1))).any()


@pytest.mark.parametrize("noise_steps", [0.0, 0.1, 0.3, 1.0])
def test_the_force_of_a_stepped_log_is_within_its_interval_and_its_arm_is_never_huge(noise_steps):
    rng = np.random.default_rng(1)
    step, inside, far = 0.02, [], []
    for _ in range(300):
        readings = stepped(step, noise_steps, rng)
        zero = with_resolution(zero_of(TIME[:195], readings[:, :195]), least_step(readings))
        rig = Rig(CellGeometry(150.0, 260.0), CellResponse.constant(np.ones(2), np.zeros(2)), zero.noise_cov)
        found = force_from_readings(readings, rig, zero_line(TIME, zero), moving=MOVING)
        inside.append((np.abs(found.force_N - FORCE) <= 1.96 * found.force_std_N)[MOVING].mean())
        far.append(np.nanmax(np.abs(found.arm_mm - 10)))
    # Two roundings and two offsets: a sum of rectangles is at least as often within 1.96 as a normal.
    assert np.mean(inside) >= 0.93
    # Five deviations of noise move the arm by five times a fifth of the cells' reach of 334 mm.
    assert max(far) < 334


def test_noise_of_several_steps_needs_no_more_doubt():
    readings = stepped(0.001, 3.0, np.random.default_rng(2))
    zero = zero_of(TIME[:195], readings[:, :195])
    wider = with_resolution(zero, least_step(readings))
    np.testing.assert_array_equal(wider.noise_cov, zero.noise_cov)
    np.testing.assert_array_equal(wider.mean_cov, zero.mean_cov)
