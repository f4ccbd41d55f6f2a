"""Motion of material points against closed forms."""

import math

import numpy as np
import pytest

from ploughval.synth.motion import Motion, Trench, plan_motion, pour, simplify

TRENCH = Trench(30.0, 5.0, 32.0)
FLAT = np.array([[0.0, 30.0], [400.0, 30.0]])


def one_step(du=0.5, beta_deg=20.0, outcrop=82.0):
    high = FLAT + np.array([0.0, 50.0])
    return Motion(
        np.array([0.0]),
        np.array([du]),
        np.array([beta_deg]),
        np.array([outcrop]),
        (FLAT, high),
        np.array([0, 1]),
        TRENCH,
    )


def plain_step(motion, k, points):
    """The numpy twin of the kernel."""
    u, du = motion.u_mm[k], motion.du_mm[k]
    slope = math.tan(math.radians(motion.beta_deg[k]))
    x, y = points.T
    block = (x >= u - 1e-9) & (x < motion.outcrop_x_mm[k]) & (y > (x - u) * slope)
    moved = points + block[:, None] * np.array([du, du * slope])
    x, y = moved.T
    behind = motion.trench.profile(u + du)
    ahead_gone = y > np.interp(x, *motion.surfaces[k + 1].T) + motion.skin_mm
    behind_gone = y > np.interp(x, *behind.T) + motion.skin_mm
    back = u + du - motion.trench.thickness_mm
    swept = y > 0
    return moved, np.where(x >= u + du - 1e-9, ahead_gone, np.where(x > back, swept, behind_gone))


def test_the_block_moves_along_the_band_and_the_rest_stays():
    motion, tangent = one_step(), math.tan(math.radians(20.0))
    points = np.array([[0.0, 1.0], [40.0, 25.0], [40.0, 14.0], [90.0, 29.0], [10.0, -2.0], [-20.0, 29.0]])
    start, end = motion.positions(points)
    shift = 0.5 * np.array([1.0, tangent])
    # 40 tan 20 = 14.56: the second point is above the band, the third below it
    expected = points + np.array([1, 1, 0, 0, 0, 0])[:, None] * shift
    np.testing.assert_array_equal(start, points)
    np.testing.assert_allclose(end[:5], expected[:5], rtol=0, atol=1e-12)
    assert end[5] == pytest.approx(points[5])  # the slump has not reached it


def test_sand_swept_by_the_blade_or_above_the_surface_is_gone():
    motion = one_step()
    swept = np.array([[0.3, 0.05]])  # under the band, passed by the face
    assert np.isnan(motion.positions(swept)[1]).all()
    lowered = Motion(
        motion.u_mm,
        motion.du_mm,
        motion.beta_deg,
        motion.outcrop_x_mm,
        (FLAT, FLAT),
        motion.frame_steps,
        TRENCH,
    )
    rise = 0.5 * math.tan(math.radians(20.0))
    near = np.array([[20.0, 30.0 - rise + 0.03], [20.0, 30.0 - rise + 0.01]])
    gone = np.isnan(lowered.positions(near)[1, :, 0])
    assert gone.tolist() == [True, False]  # the skin is 0.02 mm


def test_the_kernel_equals_its_numpy_twin(toy_history):
    history = toy_history()
    motion = plan_motion(history.increments, history.surface, np.linspace(0, 6, 5), TRENCH)
    points = np.random.default_rng(2).uniform([-40, -5], [120, 40], (4000, 2))
    for k in range(len(motion)):
        expected, expected_gone = plain_step(motion, k, points)
        gone = motion.step(k, points)
        np.testing.assert_allclose(points, expected, rtol=0, atol=1e-12)
        assert np.array_equal(gone, expected_gone)


@pytest.mark.parametrize("u", [0.01, 3.0, 20.0, 24.005, 24.0056, 60.0])
@pytest.mark.parametrize("repose", [32.0, 45.0])
def test_the_trench_keeps_the_area_of_the_cut_bed(u, repose):
    profile = Trench(30.0, 5.0, repose).profile(u)
    far = profile[0, 0]
    area = np.trapezoid(profile[:, 1], profile[:, 0])
    assert area == pytest.approx(30.0 * (-5.0 - far), rel=1e-12)
    assert profile[-1, 0] == pytest.approx(u - 5.0)
    slopes = np.diff(profile[:, 1]) / np.diff(profile[:, 0])
    assert np.abs(slopes).max() == pytest.approx(math.tan(math.radians(repose)))


def test_steps_are_cut_at_the_photographs_and_keep_the_travel(toy_history):
    history = toy_history(displacement=6.0)
    frames = np.linspace(0.0, 5.3, 8)
    motion = plan_motion(history.increments, history.surface, frames, TRENCH)
    ends = motion.u_mm + motion.du_mm
    np.testing.assert_allclose(motion.u_mm[1:], ends[:-1], rtol=0, atol=1e-12)
    reached = np.concatenate([[0.0], ends])[motion.frame_steps]
    np.testing.assert_allclose(reached, frames, rtol=0, atol=1e-9)
    assert len(motion.surfaces) == len(motion) + 1
    assert motion.frame_steps[-1] == len(motion)


def test_simplified_surfaces_stay_within_a_hundredth_of_a_millimetre():
    x = np.linspace(0, 100, 2001)
    line = np.column_stack([x, 30 + np.exp(-((x - 40) ** 2) / 200) * 8])
    short = simplify(line, 0.01)
    assert len(short) < 100
    # 0.01 mm across the line, 0.0102 mm upwards at its slope, 0.0001 mm rounding
    assert np.abs(np.interp(x, *short.T) - line[:, 1]).max() < 0.0125


def test_poured_sand_lies_where_the_surface_rose_and_evenly():
    before = np.array([[0.0, 10.0], [10.0, 10.0], [20.0, 0.0]])
    after = np.array([[0.0, 4.0], [5.0, 4.0], [11.0, 12.0], [20.0, 0.0]])
    where = np.random.default_rng(1).random((20000, 2))
    x, y = pour(where, before, after).T
    assert np.all(y >= np.interp(x, *before.T) - 1e-9)
    assert np.all(y <= np.interp(x, *after.T) + 1e-9)
    fine = np.linspace(0, 20, 200001)
    gain = np.maximum(np.interp(fine, *after.T) - np.interp(fine, *before.T), 0)
    centroid = (fine * gain).sum() / gain.sum()
    assert x.mean() == pytest.approx(centroid, abs=0.05)  # 4 standard errors of 20 000 points, spread 1.7 mm


def test_the_risen_area_is_the_area_that_slid(toy_history):
    history = toy_history()
    motion = plan_motion(history.increments, history.surface, [0.0, 6.0], TRENCH)
    for k in (3, 15):
        x = np.linspace(motion.u_mm[k] + motion.du_mm[k], 200.0, 400001)
        before, after = (np.interp(x, *line.T) for line in motion.risen_ahead(k))
        change = np.trapezoid(after - before, x)
        rise = math.tan(math.radians(motion.beta_deg[k])) * motion.du_mm[k] ** 2 / 2
        # the triangle at the tip, twice (once under the block's edge), and surfaces rounded to 0.01 mm
        assert abs(change) < 2 * rise + 0.01 * 10
