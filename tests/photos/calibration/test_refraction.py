"""The window shifts places as rays refracted by Snell's law do, and the camera's foot point is found."""

from types import SimpleNamespace

import numpy as np
import pytest

from ploughval.errors import CalibrationError
from ploughval.photos import calibrate
from ploughval.photos.calibration.camera_fit import PointSet, fit_camera
from ploughval.photos.calibration.foot import foot_mm
from ploughval.photos.calibration.refraction import Pane
from ploughval.scene import Window

THICKNESS, INDEX, DISTANCE = 20.0, 1.49, 800.0


def sand_under(outer_mm, foot_mm, thickness=THICKNESS, index=INDEX, distance=DISTANCE):
    """Snell's law with angles, ray by ray."""
    places = []
    for place in outer_mm:
        away = place - foot_mm
        r = np.hypot(*away)
        inside = np.arcsin(np.sin(np.arctan2(r, distance)) / index)
        unit = away / r if r else away
        places.append(place + unit * thickness * np.tan(inside))
    return np.array(places)


@pytest.mark.parametrize("distance", [150.0, 800.0])
def test_places_behind_the_pane_are_those_of_snells_law_to_1e_9_mm(distance):
    foot = np.array([90.0, 55.0])
    outer = np.random.default_rng(2).uniform([-100, -60], [300, 160], (200, 2))
    outer[0] = foot
    pane = Pane(THICKNESS, INDEX, distance, foot)
    expected = sand_under(outer, foot, distance=distance)
    np.testing.assert_allclose(pane.behind(outer), expected, atol=1e-9)
    np.testing.assert_allclose(pane.front(expected), outer, atol=1e-9)


def test_near_the_foot_the_scale_grows_by_t_over_n_d():
    pane = Pane(THICKNESS, INDEX, DISTANCE, np.zeros(2))
    grown = pane.behind(np.array([1e-3, 0.0]))[0] / 1e-3
    assert grown == pytest.approx(1 + THICKNESS / (INDEX * DISTANCE), abs=1e-9)  # 1.7 %


def test_a_pane_of_air_shifts_as_the_ray_goes_on():
    pane = Pane(THICKNESS, 1.0, DISTANCE, np.zeros(2))
    np.testing.assert_allclose(pane.behind(np.array([80.0, 40.0])), [82.0, 41.0], atol=1e-12)


@pytest.fixture
def camera(cameras):
    """Tilted by 3 degrees, the pupil 800 mm from the sand along the axis; the face is 780 mm away or so."""
    return cameras.made_camera(
        tilt_deg=(2.4, -1.8), distance_mm=DISTANCE, lens=(-0.01, 0, 0, 0), pane=(THICKNESS, INDEX)
    )


def exact_window(camera, points_on, **more):
    return Window(
        thickness_mm=THICKNESS,
        index=INDEX,
        distance_mm=float(camera.place_mm[2] - THICKNESS),
        points_on=points_on,
        **more,
    )


@pytest.mark.parametrize("points_on", ["outside", "inside"])
@pytest.mark.parametrize("given_foot", [False, True])
def test_points_on_either_face_place_the_sand_to_a_nanometre(cameras, camera, points_on, given_foot):
    mm = cameras.window_points(20)
    places = camera.outside_mm if points_on == "outside" else camera.sand_mm
    px = camera.photograph(mm, places)
    more = {}
    if given_foot:
        foot = camera.photograph(camera.place_mm[None, :2], camera.outside_mm)[0]
        more = {"foot_px": tuple(foot.tolist())}
    fit = fit_camera(PointSet(px, mm, cameras.SHAPE), exact_window(camera, points_on, **more))
    sand = cameras.over_window()
    np.testing.assert_allclose(fit.model.to_mm(camera.photograph(sand)), sand, atol=1e-6)
    foot = fit.model.pane.foot_mm
    np.testing.assert_allclose(foot, camera.place_mm[:2], atol=1e-4)
    px = np.random.default_rng(1).uniform(0, 1900, (300, 2))
    np.testing.assert_allclose(fit.model.to_px(fit.model.to_mm(px)), px, atol=1e-9)


def test_without_the_window_points_on_its_outside_give_a_scale_wrong_by_its_thickness(cameras, camera):
    mm = cameras.window_points(20)
    fit = fit_camera(PointSet(camera.photograph(mm, camera.outside_mm), mm, cameras.SHAPE))
    sand = cameras.over_window()
    found = fit.model.to_mm(camera.photograph(sand))
    slope = np.polyfit(sand[:, 0], found[:, 0], 1)[0]
    assert slope == pytest.approx(1 / (1 + THICKNESS / (INDEX * (DISTANCE - THICKNESS))), abs=3e-4)


def test_without_the_window_points_on_its_inside_leave_less_than_a_hundredth_of_a_millimetre(cameras, camera):
    mm = cameras.window_points(20)
    fit = fit_camera(PointSet(camera.photograph(mm), mm, cameras.SHAPE))
    sand = cameras.over_window()
    error = fit.model.to_mm(camera.photograph(sand)) - sand
    assert np.abs(error).max() < 0.01


def test_a_scale_on_the_outside_becomes_that_of_the_sand(make_scene):
    frames = SimpleNamespace(shape=(2000, 3000))
    tip = [400.5, 1700.0]
    pane = {"thickness_mm": THICKNESS, "distance_mm": DISTANCE}
    outside, inside = (
        calibrate(make_scene(mm_per_px=0.08, tip_px=tip, window={**pane, "points_on": face}), frames)
        for face in ("outside", "inside")
    )
    assert inside.mm_per_px == pytest.approx(0.08, rel=1e-9)
    # near the axis by t / nD; at the tip, 90 mm from it, by 3 parts in 10 000 less
    assert outside.mm_per_px / 0.08 == pytest.approx(1 + THICKNESS / (INDEX * DISTANCE), abs=3e-4)
    for cal in (outside, inside):
        np.testing.assert_allclose(cal.to_mm(np.array(tip)), [0, 0], atol=1e-9)
        assert cal.to_mm(np.array([tip[0] + 100, tip[1] - 50]))[0] > 7.9


def test_the_foot_is_refused_where_no_camera_can_stand(cameras):
    matrix = np.array([[1.0, 0, 0], [0, -1.0, 0], [5e-2, 0, 1.0]])
    with pytest.raises(CalibrationError, match="distance_mm: got 5000"):
        foot_mm(matrix, np.array([1500.0, 1000.0]), 5000.0)


@pytest.mark.parametrize("by", ["scale", "points"])
def test_an_uncertain_distance_makes_the_scale_as_uncertain_as_the_window_enlarges(
    make_scene, cameras, camera, by
):
    far = float(camera.place_mm[2] - THICKNESS)
    pane = {"thickness_mm": THICKNESS, "distance_mm": far, "distance_std_mm": 16.0, "points_on": "outside"}
    if by == "scale":
        keys = {"mm_per_px": 0.08, "tip_px": [1499.5, 999.5]}
    else:
        mm = cameras.window_points(20)
        px = camera.photograph(mm, camera.outside_mm)
        keys = {"control_points": np.hstack([px, mm]).tolist(), "points_std_px": 1e-3}
    found = calibrate(make_scene(**keys, window=pane), SimpleNamespace(shape=cameras.SHAPE))
    enlarged = THICKNESS / (INDEX * far)
    # the next term: 1 - 6 a r2 / D2 with a = (n2 - 1) / 2 n2, the tip being r from the foot
    r = 0.0 if by == "scale" else np.hypot(*camera.place_mm[:2])
    rest = 1 - 6 * (INDEX**2 - 1) / (2 * INDEX**2) * (r / far) ** 2
    assert found.scale_std == pytest.approx(enlarged * 16.0 / far / (1 + enlarged) * rest, rel=0.01)
