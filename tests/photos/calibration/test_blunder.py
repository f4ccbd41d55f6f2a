"""A mistyped point is named with its likely cause; a lens, or careless clicks, blame nobody."""

import numpy as np
import pytest

from ploughval.errors import CalibrationError
from ploughval.photos.calibration.blunder import refuse_blunder, refuse_crossed
from ploughval.photos.calibration.camera_fit import PointSet, fit_camera

TILTED = {"tilt_deg": (2.1, -2.1), "roll_deg": 1.0, "distance_mm": 900.0}


@pytest.fixture
def points(cameras):
    """Points of a camera with the given lens, read with the given error, spoilt by `spoil(mm)`."""

    def make(count, *, read_px=0.3, lens=(0.0, 0, 0, 0), seed=1, spoil=None):
        rng = np.random.default_rng(seed)
        camera = cameras.made_camera(**TILTED, lens=lens)
        mm = cameras.window_points(count, rng)
        px = camera.photograph(mm) + rng.normal(0, read_px, mm.shape)
        if spoil is not None:
            spoil(mm)
        return PointSet(px, mm, cameras.SHAPE)

    return make


def message(points):
    try:
        fit = fit_camera(points)
    except CalibrationError:
        fit = None
    with pytest.raises(CalibrationError) as caught:
        refuse_blunder(points, fit)
    return str(caught.value)


def negate(k, axis):
    def spoil(mm):
        mm[k, axis] *= -1

    return spoil


def exchange_axes(k):
    def spoil(mm):
        mm[k] = mm[k, ::-1]

    return spoil


def tenfold(k, axis):
    def spoil(mm):
        mm[k, axis] *= 10

    return spoil


def exchange_points(i, j):
    def spoil(mm):
        mm[[i, j]] = mm[[j, i]]

    return spoil


# six points of which one is wrong do not show a lens
@pytest.mark.parametrize(("count", "barrel"), [(6, 0.0), (8, 0.0), (8, -0.01), (15, -0.01)])
@pytest.mark.parametrize(
    ("spoil", "cause"),
    [
        (negate(2, 0), "the sign of x_mm is wrong"),
        (negate(2, 1), "the sign of y_mm is wrong"),
        (exchange_axes(2), "x_mm and y_mm are exchanged"),
        (tenfold(2, 0), "the point of x_mm stands one digit too far right"),
    ],
)
def test_the_point_and_what_was_probably_done_are_named(points, count, spoil, cause, barrel):
    text = message(points(count, spoil=spoil, lens=(barrel, 0, 0, 0)))
    assert "control_points.2: got" in text
    assert cause in text


@pytest.mark.parametrize("count", [6, 8, 12])
def test_two_points_exchanged_are_named_together(points, count):
    text = message(points(count, spoil=exchange_points(1, 4)))
    assert "control_points.1 and control_points.4" in text
    assert "Exchange" in text


@pytest.mark.parametrize(
    ("spoil", "cause"),
    [(negate(2, 0), "control_points.2"), (exchange_points(1, 4), "1 and control_points.4 are exchanged")],
)
def test_among_five_points_a_usual_mistake_is_named(points, spoil, cause):
    text = message(points(5, spoil=spoil))
    assert "the five control points contradict each other" in text
    assert cause in text


def test_among_five_points_a_free_mistake_is_seen_but_not_placed(points):
    def spoil(mm):
        mm[3] += [17.0, -23.0]

    text = message(points(5, spoil=spoil))
    assert "five points cannot tell" in text
    assert "add a sixth" in text


@pytest.mark.parametrize("count", [5, 6, 7, 8, 12])
@pytest.mark.parametrize("barrel", [0.0, -0.01, 0.01])
@pytest.mark.parametrize("read_px", [0.05, 0.5])
def test_neither_lens_nor_noise_blames_a_point(points, count, barrel, read_px):
    for seed in range(4):
        given = points(count, read_px=read_px, lens=(barrel, 0, 0, 0), seed=seed)
        refuse_blunder(given, fit_camera(given))


@pytest.mark.parametrize("count", [8, 15])
def test_a_point_off_by_a_millimetre_is_found_among_well_read_ones(points, count):
    def spoil(mm):
        mm[5] += [1.0, 0.0]

    text = message(points(count, read_px=0.05, spoil=spoil, lens=(-0.01, 0, 0, 0)))
    assert "control_points.5: got" in text


def test_a_gross_mistake_is_named_although_five_others_do_not_show_the_lens(points):
    text = message(points(6, spoil=tenfold(0, 0), lens=(0.01, 0, 0, 0)))
    assert "control_points.0: got" in text


def test_points_that_agree_on_nothing_are_refused(points):
    def spoil(mm):
        mm += np.random.default_rng(3).normal(0, 5, mm.shape)

    assert "check them all" in message(points(12, spoil=spoil))


def test_four_points_out_of_order_are_refused_with_the_pairs_that_would_do(points):
    given = points(4, spoil=exchange_points(0, 1))
    with pytest.raises(CalibrationError, match=r"same order.*control_points\.0 and control_points\.1"):
        refuse_crossed(given)
    refuse_crossed(points(4))


def test_points_keep_their_numbers_where_others_were_not_found(points):
    given = points(8, spoil=negate(2, 0)).without(0)
    text = message(given)
    assert "control_points.2: got" in text
