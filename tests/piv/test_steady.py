"""Movement of the camera, told by sand that stands still."""

import numpy as np
import pytest

from ploughval.piv.steady import CameraWatch


def still_below(sand, row=120):
    mask = np.zeros(sand.shape, bool)
    mask[row:] = True
    return mask


def moving_above(shift, row=110):
    """Everything above a row moves by 6 px, and the camera by a shift."""
    return lambda p: np.where(p[:, 1:] < row, [6.0, -2.0], [0.0, 0.0]) + np.asarray(shift)


@pytest.mark.parametrize("shift", [(2.4, -1.8), (-0.3, 0.2), (31.0, -17.5)])
def test_knock_is_found_within_0p01_px_beside_moving_sand(sand, shift):
    watch = CameraWatch(sand.picture(noise=2, seed=1), still_below(sand))
    assert watch.patches >= 20
    found = watch.see(sand.picture(moving_above(shift), noise=2, seed=2))
    assert found.shift_px == pytest.approx(
        shift, abs=0.01
    )  # noise 2 of slope 14: 0.1 / 31 / sqrt(30) = 0.001 px
    assert 0 < found.std_px < 0.01
    assert abs(found.turn_deg) < 0.01


def test_camera_that_stands_still_moved_by_exactly_nothing(sand):
    watch = CameraWatch(sand.picture(noise=3, seed=1), still_below(sand))
    found = watch.see(sand.picture(moving_above((0.0, 0.0)), noise=3, seed=2))
    assert found.shift_px.tolist() == [0.0, 0.0]
    assert found.zncc > 0.9


def test_sand_that_creeps_is_no_camera_and_a_knock_on_top_of_it_is(sand):
    """0.1 px a frame for ten frames, a knock of 2 px in the sixth."""
    watch = CameraWatch(sand.picture(), still_below(sand))
    for frame in range(1, 11):
        knock = np.array([2.0, 0.0]) if frame > 5 else np.zeros(2)
        creep = np.array([0.1 * frame, 0.0])
        found = watch.see(sand.picture(creep + knock))
        expected = knock + (
            np.array([0.1, 0.0]) if frame > 5 else 0.0
        )  # of this frame's creep nothing is known
        assert found.shift_px == pytest.approx(expected, abs=0.01)
        assert found.drift_px == pytest.approx(creep + knock - expected, abs=0.02)
        assert (found.std_px > 0) == (frame > 5)


def test_turn_is_told_from_a_shift(sand):
    turn = np.radians(0.2)
    middle = np.array([130.0, 170.0])

    def turned(p):
        arm = p - middle
        return turn * np.column_stack([arm[:, 1], -arm[:, 0]]) + [1.0, 0.5]

    watch = CameraWatch(sand.picture(), still_below(sand))
    found = watch.see(sand.picture(turned))
    assert found.turn_deg == pytest.approx(0.2, abs=0.01)


def test_flicker_and_a_hand_over_a_third_do_not_matter(sand):
    watch = CameraWatch(sand.picture(noise=1, seed=1), still_below(sand))
    picture = sand.picture((1.2, 0.7), noise=1, seed=2).astype(float) * 0.9
    picture[:, :90] = 60.0
    found = watch.see(picture.astype(np.uint8))
    assert found.shift_px == pytest.approx((1.2, 0.7), abs=0.01)


def test_sand_that_fell_apart_tells_nothing(sand):
    watch = CameraWatch(sand.picture(), still_below(sand))
    noise = np.random.default_rng(3).integers(0, 255, sand.shape).astype(np.uint8)
    found = watch.see(noise)
    assert np.isnan(found.drift_px).all()
    assert found.zncc < 0.5


def test_no_still_sand_tells_nothing(sand):
    watch = CameraWatch(sand.picture(), np.zeros(sand.shape, bool))
    assert watch.patches == 0
    found = watch.see(sand.picture((3.0, 0.0)))
    assert found.shift_px.tolist() == [0.0, 0.0]
    assert np.isnan(found.drift_px).all()


def test_thin_strip_of_still_sand_will_do(sand):
    mask = np.zeros(sand.shape, bool)
    mask[-14:] = True
    watch = CameraWatch(sand.picture(), mask)
    found = watch.see(sand.picture((0.6, -0.4)))
    assert found.shift_px == pytest.approx((0.6, -0.4), abs=0.03)  # 11 px high: a ninth of the pixels
