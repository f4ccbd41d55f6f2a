"""A lens bends as Brown's equations say, is undone to 1e-12 px, and is refused where it folds."""

import numpy as np
import pytest

from ploughval.photos.calibration.lens import Lens, bend, bend_by_terms, bend_slope

SHAPE = (2000, 3000)
LENSES = {
    "barrel": [-0.01, 0.0, 0.0, 0.0, 0.0],
    "pincushion": [0.03, 0.0, 0.0, 0.0, 0.0],
    "moustache": [-0.05, 0.03, 0.0, 0.0, 0.0],
    "strong barrel": [-0.15, 0.02, -0.002, 0.0, 0.0],
    "decentred": [-0.02, 0.004, 0.001, 0.002, -0.003],
}


def picture_grid():
    y, x = np.mgrid[0 : SHAPE[0] : 40j, 0 : SHAPE[1] : 60j]
    return np.stack([x, y], axis=-1)


def test_one_percent_of_barrel_draws_the_corner_in_by_one_percent_of_half_the_diagonal():
    lens = Lens.of_picture(SHAPE, np.array(LENSES["barrel"]))
    corner = lens.centre_px + np.array([1500.0, 1000.0])
    moved = lens.distort(corner) - corner
    np.testing.assert_allclose(moved, [-15.0, -10.0], atol=1e-9)


def test_tangential_terms_are_browns():
    # at (x, y) = (0.6, 0) of half the diagonal: dx = p2 (r2 + 2 x2) = 1.08 p2, dy = p1 r2 = 0.36 p1
    moved = bend(np.array([0.6, 0.0]), np.array([0, 0, 0, 1e-3, 2e-3])) - [0.6, 0.0]
    np.testing.assert_allclose(moved, [2.16e-3, 0.36e-3], atol=1e-15)


@pytest.mark.parametrize("name", LENSES)
def test_the_inverse_is_exact_to_1e_12_px_over_the_picture(name):
    lens = Lens.of_picture(SHAPE, np.array(LENSES[name]))
    px = picture_grid()
    ideal = lens.undistort(px)
    # 1e-12 px and what float64 keeps of a place near 3000 px
    assert np.abs(lens.distort(ideal) - px).max() < 1e-12 + 4 * np.spacing(3000.0)
    assert not lens.folds()


@pytest.mark.parametrize("name", LENSES)
def test_slopes_are_those_of_differences(name):
    terms = np.array(LENSES[name])
    q = np.random.default_rng(1).uniform(-0.8, 0.8, (50, 2))
    h = 1e-6
    for k in range(2):
        step = h * np.eye(2)[k]
        slope = (bend(q + step, terms) - bend(q - step, terms)) / (2 * h)
        np.testing.assert_allclose(bend_slope(q, terms)[..., k], slope, atol=1e-9)
    for k in range(5):
        step = h * np.eye(5)[k]
        slope = (bend(q, terms + step) - bend(q, terms - step)) / (2 * h)
        np.testing.assert_allclose(bend_by_terms(q)[..., k], slope, atol=1e-9)


def test_numbers_do_not_depend_on_what_is_asked_beside_them():
    lens = Lens.of_picture(SHAPE, np.array(LENSES["decentred"]))
    px = picture_grid().reshape(-1, 2)
    whole = lens.undistort(px)
    alone = np.array([lens.undistort(p) for p in px[::97]])
    assert np.array_equal(whole[::97], alone)


def test_a_lens_that_turns_back_inside_the_picture_folds_and_gives_nan_there():
    lens = Lens.of_picture(SHAPE, np.array([-0.5, 0.0, 0.0, 0.0, 0.0]))
    # r (1 - r2 / 2) has its maximum 0.544 at r = 0.816: no place of the photograph beyond that shows anything
    assert lens.folds()
    corner = np.array([2999.0, 1999.0])
    assert np.isnan(lens.undistort(corner)).all()
    far = lens.centre_px + np.array([0.9 * lens.radius_px, 0.0])
    assert np.isnan(lens.distort(far)).all()
    near = lens.centre_px + np.array([0.5 * lens.radius_px, 0.0])
    np.testing.assert_allclose(lens.distort(near) - lens.centre_px, [0.4375 * lens.radius_px, 0], atol=1e-9)


def test_a_lens_without_terms_changes_no_bit():
    px = np.random.default_rng(3).uniform(0, 2000, (7, 3, 2))
    lens = Lens.of_picture(SHAPE)
    assert np.array_equal(lens.distort(px), px)
    assert np.array_equal(lens.undistort(px), px)


def test_places_that_are_not_numbers_stay_so():
    lens = Lens.of_picture(SHAPE, np.array(LENSES["barrel"]))
    px = np.array([[100.0, 200.0], [np.nan, 200.0]])
    assert np.isfinite(lens.undistort(px)[0]).all()
    assert np.isnan(lens.undistort(px)[1]).all()
    assert np.isnan(lens.distort(px)[1]).any()
