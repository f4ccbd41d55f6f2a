"""The cases that displacement measurement is scored on: the scores themselves, from made answers."""

import numpy as np
import pytest

from correlation import cases


def test_the_truth_scores_without_error_and_a_constant_error_is_bias():
    case, points = cases.affine_case(), cases.grid_points(64)
    truth, valid = case.motion(points), np.ones(len(points), bool)
    exact = cases.score(case, points, truth, valid, np.full(truth.shape, 0.1))
    assert exact.rmse_px == 0.0
    assert exact.valid == 1.0
    assert exact.within_1_std == 1.0
    biased = cases.score(case, points, truth + np.array([0.1, 0.0]), valid)
    assert biased.bias_px == pytest.approx(0.1)
    assert biased.random_px == pytest.approx(0.0, abs=1e-12)


def test_vectors_that_are_not_valid_lower_the_share_and_nothing_else():
    case, points = cases.hard_case(), cases.grid_points(64)
    truth, valid = case.motion(points), np.arange(len(points)) % 2 == 0
    given = np.where(valid[:, None], truth, 50.0)
    found = cases.score(case, points, given, valid)
    assert 0.4 < found.valid < 0.6
    assert found.rmse_px == 0.0


def test_error_near_a_band_and_elsewhere_are_kept_apart():
    case, points = cases.band_cases(widths=(4.0,))[0], cases.grid_points(16)
    near = np.abs(case.side(points)) < 15.5
    given = case.motion(points) + np.where(near[:, None], 0.3, 0.01)
    found = cases.score(case, points, given, np.ones(len(points), bool))
    assert found.near_rmse_px == pytest.approx(0.3)
    assert found.elsewhere_rmse_px == pytest.approx(0.01)


@pytest.mark.parametrize("profile", ["tanh", "erf", "ramp"])
def test_profiles_of_a_band_have_one_width_and_one_jump(profile):
    case = next(c for c in cases.band_cases(widths=(12.0,)) if profile in c.name)
    across = np.array([-np.sin(cases.BAND_ANGLE), -np.cos(cases.BAND_ANGLE)])
    s = np.linspace(-80.0, 80.0, 16001)
    share = np.linalg.norm(case.motion(cases.MIDDLE + s[:, None] * across), axis=1) / cases.JUMP_PX
    assert share[0] == pytest.approx(0.0, abs=1e-4)
    assert share[-1] == pytest.approx(1.0, abs=1e-4)
    # tanh(s / 6) goes from 10 to 90 % of its jump in 2 x 6 artanh(0.8) = 13.18 px.
    assert np.interp(0.9, share, s) - np.interp(0.1, share, s) == pytest.approx(13.183, abs=0.05)


def test_resolution_is_the_period_above_which_nine_tenths_are_measured():
    case, points = cases.star_case(), cases.grid_points(8)
    gain = np.clip(0.9 + 0.01 * (case.period(points) - 60.0), 0.0, 1.0)  # 90 % at 60 px
    found = cases.score(case, points, case.motion(points) * gain[:, None], np.ones(len(points), bool))
    assert found.star_period_px == pytest.approx(60.0, abs=2.0)  # bins of 7 px


def test_bound_is_that_of_the_exact_slopes_of_a_subset():
    case, seed = cases.hard_case(), cases.SEED
    point = np.array([[512.0, 384.0]])
    grains = cases.texture(seed)
    ahead, behind = (grains.moved((step, 0.0)).picture(cases.SHAPE).astype(float) for step in (0.5, -0.5))
    slope = case.contrast * (ahead - behind)[384 - 15 : 384 + 16, 512 - 15 : 512 + 16]
    noise = np.hypot(case.noise, 1 / np.sqrt(12))
    expected = np.sqrt(2.0) * noise / np.sqrt(np.sum(slope**2))
    # A difference over one px measures slopes 5 to 8 % short of the exact ones: the bound lies below it.
    assert cases.bound_px(case, point)[0, 0] == pytest.approx(0.93 * expected, rel=0.05)
