"""Displacement of the frames: log, photographs or speed; the offset of the two clocks."""

import numpy as np
import pandas as pd
import pytest

from ploughval.run.clock import find_clock_offset, frame_displacement
from ploughval.scene import Scene

LOG_TIME = np.arange(0, 80, 0.02)
LOG_U = np.clip(LOG_TIME - 10.0, 0, 55.0)  # 1 mm/s from 10 s on, stops at 65 s
FRAME_TIME = np.arange(5.0, 70.0, 2.0)


def scene(**camera):
    return Scene.model_validate(
        {
            "test": {"name": "clock"},
            "blade": {"depth_mm": 30, "width_mm": 200, "speed_mm_s": 1.5},
            "camera": {"photos": "*.png", "mm_per_px": 0.1, "tip_px": [0, 0], **camera},
        }
    )


def log():
    return pd.DataFrame({"time_s": LOG_TIME, "u_mm": LOG_U})


def true_u(time_s):
    return np.clip(time_s - 10.0, 0, 55.0)


@pytest.mark.parametrize("offset_s", [-3.21, 0.0, 7.65])
def test_the_offset_of_the_clocks_is_found_to_a_hundredth_of_a_second(offset_s):
    """Blade noise 0.02 mm, 30 frames at 1 mm/s, offset and scale together: 2 x 0.02 / sqrt(30) s."""
    noise = np.random.default_rng(1).normal(0, 0.02, len(FRAME_TIME))
    found = find_clock_offset(FRAME_TIME + offset_s, true_u(FRAME_TIME) + noise, LOG_TIME, LOG_U)
    assert found.offset_s == pytest.approx(offset_s, abs=0.02)
    assert 0.002 < found.offset_std_s < 0.02
    assert found.scale == pytest.approx(1.0, abs=4 * found.scale_std)


def test_a_scale_that_is_wrong_by_two_per_cent_and_a_stray_blade_do_not_move_the_clocks():
    """A tenth of the frame interval is 0.2 s; left out, the scale alone would cost 0.3 s."""
    blade = 1.02 * true_u(FRAME_TIME) + np.random.default_rng(2).normal(0, 0.02, len(FRAME_TIME))
    blade[11] += 9.0
    found = find_clock_offset(FRAME_TIME + 1.37, blade, LOG_TIME, LOG_U)
    assert found.offset_s == pytest.approx(1.37, abs=0.03)
    assert found.scale == pytest.approx(1.02, abs=0.001)


def test_the_stated_uncertainties_cover_what_they_should():
    """Of 600 draws, within one std 68 % and within two 95 %; three times their own scatter is 6 and 3 %."""
    rng, offsets, scales = np.random.default_rng(3), [], []
    for _ in range(600):
        blade = true_u(FRAME_TIME) + rng.normal(0, 0.05, len(FRAME_TIME))
        found = find_clock_offset(FRAME_TIME, blade, LOG_TIME, LOG_U)
        offsets.append(abs(found.offset_s) / found.offset_std_s)
        scales.append(abs(found.scale - 1) / found.scale_std)
    for ratio in (np.array(offsets), np.array(scales)):
        assert 0.62 < np.mean(ratio < 1) < 0.74
        assert np.mean(ratio < 2) > 0.92


def test_nothing_moving_gives_no_offset():
    found = find_clock_offset(FRAME_TIME, np.zeros_like(FRAME_TIME), LOG_TIME, LOG_U)
    assert np.isnan(found.offset_s)
    assert np.isnan(found.offset_std_s)


def test_a_blade_that_travels_half_as_far_is_not_that_of_the_log():
    found = find_clock_offset(FRAME_TIME, 0.5 * true_u(FRAME_TIME), LOG_TIME, LOG_U)
    assert np.isnan(found.offset_s)


def test_displacement_comes_from_the_log_shifted_by_the_given_offset():
    d = frame_displacement(scene(clock_offset_s=2.5), FRAME_TIME + 2.5, true_u(FRAME_TIME) + 0.01, log())
    assert d.source == "log"
    assert np.allclose(d.u_mm, true_u(FRAME_TIME), atol=1e-9)
    assert d.difference_rms_mm == pytest.approx(0.01, abs=1e-6)


def test_a_photograph_outside_the_log_has_no_displacement():
    d = frame_displacement(scene(), np.array([-5.0, 20.0, 500.0]), np.full(3, np.nan), log())
    assert np.isnan(d.u_mm[[0, 2]]).all()
    assert d.u_mm[1] == pytest.approx(10.0)


def test_without_a_log_the_photographs_give_the_displacement():
    blade = np.array([0.1, 1.1, np.nan, 3.1])
    d = frame_displacement(scene(), np.full(4, np.nan), blade, None)
    assert d.source == "photographs"
    assert np.allclose(d.u_mm, [0, 1, np.nan, 3], equal_nan=True)


def test_without_log_and_blade_the_speed_gives_the_displacement():
    d = frame_displacement(scene(), np.array([3.0, 5.0]), np.full(2, np.nan), None)
    assert d.source == "speed"
    assert np.allclose(d.u_mm, [0.0, 3.0])
