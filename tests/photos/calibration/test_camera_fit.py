"""Cameras known exactly are found again: places in mm, their uncertainty, and the lens where it pays."""

import numpy as np
import pytest

from ploughval.errors import CalibrationError
from ploughval.photos.calibration.camera_fit import LEVEL, PointSet, fit_camera
from ploughval.photos.calibration.camera_model import spread_of

TILTED = {"tilt_deg": (2.1, -2.1), "roll_deg": 1.0, "distance_mm": 900.0}  # 3 degrees of tilt
BARREL = (-0.01, 0.0, 0.0, 0.0)


def fitted(cameras, camera, count, read_px, rng, *, known=False):
    mm = cameras.window_points(count, rng)
    px = camera.photograph(mm) + rng.normal(0, read_px, mm.shape)
    return fit_camera(PointSet(px, mm, cameras.SHAPE, np.full(count, read_px) if known else None))


def window_error(cameras, camera, fit):
    places = cameras.over_window()
    return fit.model.to_mm(camera.photograph(places)) - places


def test_exact_points_give_camera_and_lens_to_a_nanometre(cameras):
    camera = cameras.made_camera(**TILTED, lens=(-0.012, 0.003, 0.001, -0.0006))
    mm = cameras.window_points(30)
    fit = fit_camera(PointSet(camera.photograph(mm), mm, cameras.SHAPE))
    assert fit.term_names == ("k1", "k2", "p1", "p2")
    np.testing.assert_allclose(fit.model.lens.terms, [-0.012, 0.003, 0, 0.001, -0.0006], atol=1e-9)
    assert np.abs(window_error(cameras, camera, fit)).max() < 1e-6


@pytest.mark.parametrize("count", [8, 12, 20])
def test_points_read_to_0p05_px_place_a_window_of_200_mm_within_0p02_mm(cameras, count):
    camera = cameras.made_camera(**TILTED, lens=BARREL)
    rng = np.random.default_rng(count)
    for _ in range(20):
        fit = fitted(cameras, camera, count, 0.05, rng)
        assert np.abs(window_error(cameras, camera, fit)).max() < 0.02


def test_a_lens_that_bends_nothing_is_taken_no_more_often_than_the_level_says(cameras):
    camera = cameras.made_camera(**TILTED)
    rng = np.random.default_rng(3)
    taken = sum(bool(fitted(cameras, camera, 12, 0.05, rng).terms) for _ in range(400))
    # binomial: 4 expected, 12 is exceeded once in 4 000 such tests
    assert taken <= 12
    assert pytest.approx(0.01) == LEVEL


def test_a_barrel_of_three_hundredths_of_a_percent_is_found_among_twenty_points(cameras):
    camera = cameras.made_camera(**TILTED, lens=(-3e-4, 0, 0, 0))  # 0.5 px at the corners
    rng = np.random.default_rng(4)
    found = [fitted(cameras, camera, 20, 0.05, rng) for _ in range(40)]
    assert sum(fit.term_names == ("k1",) for fit in found) >= 36
    assert np.mean([fit.model.lens.terms[0] for fit in found]) == pytest.approx(-3e-4, rel=0.1)


@pytest.mark.parametrize("known", [True, False])
def test_the_stated_uncertainty_covers_the_error_over_the_window(cameras, known):
    rng = np.random.default_rng(6)
    ratios = []
    for _ in range(150):
        camera = cameras.made_camera(
            tilt_deg=rng.uniform(-3, 3, 2),
            distance_mm=rng.uniform(500, 1600),
            lens=(rng.uniform(-0.02, 0.02), 0, 0, 0),
        )
        fit = fitted(cameras, camera, 15, 0.05, rng, known=known)
        at = camera.photograph(cameras.over_window(7, 5))
        changes = spread_of(lambda model, at=at: model.to_mm(at), fit.model, fit.spread)
        error = fit.model.to_mm(at) - cameras.over_window(7, 5)
        ratios.append(np.abs(error) / np.sqrt(np.sum(changes**2, axis=0)))
    # 150 cameras of which the errors of one hang together: about 1 000 independent ones, +- 0.03 and +- 0.015
    assert np.mean(np.array(ratios) <= 1) == pytest.approx(0.69, abs=0.05)
    assert np.mean(np.array(ratios) <= 2) == pytest.approx(0.95, abs=0.025)


def test_four_points_nearly_in_line_say_so_in_the_uncertainty(cameras):
    camera = cameras.made_camera(**TILTED)
    mm = np.array([[0.0, 50.0], [60.0, 51.5], [120.0, 48.5], [180.0, 50.0]])
    rng = np.random.default_rng(7)
    off_line = np.array([[90.0, 100.0]])
    at = camera.photograph(off_line)
    ratios, stds = [], []
    for _ in range(60):
        px = camera.photograph(mm) + rng.normal(0, 0.05, mm.shape)
        fit = fit_camera(PointSet(px, mm, cameras.SHAPE, np.full(4, 0.05)))
        changes = spread_of(lambda model: model.to_mm(at), fit.model, fit.spread)
        std = np.sqrt(np.sum(changes**2, axis=0))
        ratios.append(np.abs(fit.model.to_mm(at) - off_line) / std)
        stds.append(std.max())
    # spread over the window the same four readings leave 0.005 mm
    assert np.median(stds) > 0.1
    assert np.mean(np.array(ratios) <= 2) > 0.9


def test_a_lens_that_too_few_points_cannot_show_is_allowed_for(cameras):
    camera = cameras.made_camera(**TILTED, lens=(-0.005, 0, 0, 0))
    mm = cameras.window_points(4)
    fit = fit_camera(PointSet(camera.photograph(mm), mm, cameras.SHAPE))
    assert fit.tests == ()
    at = camera.photograph(cameras.over_window())
    changes = spread_of(lambda model: model.to_mm(at), fit.model, fit.spread)
    std = np.sqrt(np.sum(changes**2, axis=0))
    error = np.abs(fit.model.to_mm(at) - cameras.over_window())
    assert error.max() > 0.1  # 0.5 % of half the diagonal, unseen
    assert np.mean(error <= 1.2 * std) > 0.95  # just as large as is allowed for as one standard deviation


def test_a_std_that_the_residuals_contradict_is_widened_and_said(cameras):
    camera = cameras.made_camera(**TILTED)
    mm = cameras.window_points(20)
    px = camera.photograph(mm) + np.random.default_rng(8).normal(0, 0.5, mm.shape)
    fit = fit_camera(PointSet(px, mm, cameras.SHAPE, np.full(20, 0.05)))
    assert fit.std_px == pytest.approx(0.5, rel=0.35)
    assert "times what was given" in fit.std_source
    assert fit.term_names == ()


def test_weights_follow_each_points_own_uncertainty(cameras):
    camera = cameras.made_camera(**TILTED)
    mm = cameras.window_points(20)
    std = np.where(np.arange(20) % 2, 0.05, 2.0)
    px = camera.photograph(mm) + std[:, None] * np.random.default_rng(9).normal(0, 1, mm.shape)
    fit = fit_camera(PointSet(px, mm, cameras.SHAPE, std))
    even = fit_camera(PointSet(px, mm, cameras.SHAPE))
    assert np.abs(window_error(cameras, camera, fit)).max() < 0.02
    assert np.abs(window_error(cameras, camera, even)).max() > 0.05


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_the_unit_and_origin_of_the_window_do_not_matter(cameras, scale):
    camera = cameras.made_camera(**TILTED, lens=BARREL)
    mm = cameras.window_points(15)
    px = camera.photograph(mm) + np.random.default_rng(2).normal(0, 0.05, mm.shape)
    plain = fit_camera(PointSet(px, mm, cameras.SHAPE))
    moved = fit_camera(PointSet(px, scale * mm + 500.0 * scale, cameras.SHAPE))
    at = np.random.default_rng(5).uniform([200, 200], [2800, 1800], (50, 2))
    np.testing.assert_allclose(moved.model.to_mm(at) / scale - 500.0, plain.model.to_mm(at), atol=1e-6)
    assert moved.std_px == pytest.approx(plain.std_px, rel=1e-6)


def test_points_on_a_line_fix_nothing():
    mm = np.array([[0.0, 0], [10, 10], [20, 20], [40, 40]])
    with pytest.raises(CalibrationError, match="on one line"):
        fit_camera(PointSet(mm * 5 + 100, mm, (900, 1400)))
