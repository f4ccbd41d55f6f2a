"""A calibration from its file is the same to the bit, and files that do not fit are refused."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from ploughval.errors import CalibrationError, DataError
from ploughval.photos import calibrate
from ploughval.photos.calibration.camera_fit import PointSet, fit_camera
from ploughval.photos.calibration.file import calibration_record, read_calibration

FRAMES = SimpleNamespace(shape=(2000, 3000))
PANE = {"thickness_mm": 20.0, "distance_mm": 780.0, "points_on": "outside"}


@pytest.fixture
def written(make_scene, cameras, tmp_path):
    """A calibration by twenty points through a window and a bent lens, and its file."""
    camera = cameras.made_camera(
        tilt_deg=(2, -1), distance_mm=800.0, lens=(-0.01, 0, 0, 0), pane=(20.0, 1.49)
    )
    mm = cameras.window_points(20)
    px = camera.photograph(mm, camera.outside_mm) + np.random.default_rng(1).normal(0, 0.05, mm.shape)
    found = calibrate(make_scene(control_points=np.hstack([px, mm]).tolist(), window=PANE), FRAMES)
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(calibration_record(found)))
    return found, path


def test_the_round_trip_is_exact_to_the_bit(written):
    found, path = written
    again = read_calibration(path, FRAMES.shape)
    px = np.random.default_rng(2).uniform([0, 0], [2999, 1999], (500, 2))
    assert np.array_equal(again.to_mm(px), found.to_mm(px))
    assert np.array_equal(again.to_px(found.to_mm(px)), found.to_px(found.to_mm(px)))
    assert np.array_equal(again.std_mm(px), found.std_mm(px))
    assert np.array_equal(again.points.to_numpy(), found.points.to_numpy())
    for name in ("mm_per_px", "scale_std", "residual_px", "std_px", "method", "direction", "shape", "tests"):
        assert getattr(again, name) == getattr(found, name), name
    assert calibration_record(again) == calibration_record(found)


def test_a_plain_scale_survives_too(make_scene, tmp_path):
    found = calibrate(make_scene(mm_per_px=0.1, tip_px=[500.25, 1500.75], direction="left"), FRAMES)
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(calibration_record(found)))
    again = read_calibration(path, FRAMES.shape)
    px = np.array([[17.0, 33.0]])
    assert np.array_equal(again.to_mm(px), found.to_mm(px))
    assert np.isnan(again.std_px)


def test_another_test_of_the_set_up_uses_it(written, make_scene):
    found, _ = written
    cal = calibrate(make_scene(calibration="calibration.json"), FRAMES)
    px = np.random.default_rng(3).uniform([0, 0], [2999, 1999], (50, 2))
    assert np.array_equal(cal.to_mm(px), found.to_mm(px))
    assert "taken from calibration.json" in cal.method


def test_a_tip_of_its_own_moves_the_origin_and_nothing_else(written, make_scene):
    found, _ = written
    tip = np.array([700.0, 1500.0])
    cal = calibrate(make_scene(calibration="calibration.json", tip_px=tip.tolist()), FRAMES)
    px = np.random.default_rng(3).uniform([0, 0], [2999, 1999], (50, 2))
    np.testing.assert_allclose(cal.to_mm(px), found.to_mm(px) - found.to_mm(tip), atol=1e-9)
    np.testing.assert_allclose(cal.to_px(cal.to_mm(px)), px, atol=1e-8)
    assert cal.mm_per_px == pytest.approx(float(found.mm_per_px_at(tip)), rel=1e-9)


def test_with_a_tip_of_its_own_places_are_as_uncertain_as_their_distance_from_it(
    cameras, make_scene, tmp_path
):
    camera = cameras.made_camera(tilt_deg=(2, -1), distance_mm=800.0, lens=(-0.01, 0, 0, 0))
    mm, rng = cameras.window_points(20), np.random.default_rng(6)
    exact, shape = camera.photograph(mm), FRAMES.shape
    draws = [fit_camera(PointSet(exact + rng.normal(0, 0.3, mm.shape), mm, shape)).model for _ in range(150)]
    noisy = exact + rng.normal(0, 0.3, mm.shape)
    found = calibrate(make_scene(control_points=np.hstack([noisy, mm]).tolist(), points_std_px=0.3), FRAMES)
    (tmp_path / "calibration.json").write_text(json.dumps(calibration_record(found)))
    tip, px = np.array([700.0, 1500.0]), np.array([[710.0, 1490.0], [1500.0, 1000.0], [2500.0, 400.0]])
    cal = calibrate(make_scene(calibration="calibration.json", tip_px=tip.tolist()), FRAMES)
    np.testing.assert_allclose(cal.std_mm(tip), 0.0, atol=1e-9)
    scatter = np.std([model.to_mm(px) - model.to_mm(tip) for model in draws], axis=0)
    # 150 draws know a standard deviation to 6 %; terms of the lens that do not pay are allowed for besides
    assert (cal.std_mm(px) > 0.82 * scatter).all()
    assert (cal.std_mm(px) < 2.2 * scatter).all()


def test_files_that_do_not_fit_are_refused_by_what_is_wrong(written, make_scene):
    _, path = written
    good = json.loads(path.read_text())

    def told(error, **camera):
        with pytest.raises(error) as caught:
            calibrate(make_scene(calibration="calibration.json", **camera), FRAMES)
        assert "calibration" in str(caught.value)
        return str(caught.value)

    assert "travels to the right" in told(CalibrationError, direction="left")
    assert "Take it out" in told(CalibrationError, window=PANE)
    for change, text in (
        ({"version": 2}, "version: got 2; expected 1"),
        ({"mm_per_px": "wide"}, "mm_per_px: got 'wide'"),
        ({"lens": {"k1": 0.0}}, "lens: got ['k1']"),
        ({"spread": [[1.0]]}, "spread: got 1 rows; expected 16"),
        ({"px_from_face": [[0.0] * 3] * 3}, "px_from_face: not a homography"),
        ({"more": 1}, "more: got 1"),
    ):
        path.write_text(json.dumps({**good, **change}))
        assert text in told(DataError)
    path.write_text(json.dumps({**good, "photograph_px": [1500, 1000]}))
    assert "1500 x 1000 px; got 3000 x 2000 px" in told(CalibrationError)
    path.write_text("{")
    assert "not readable as JSON" in told(DataError)
    path.write_text("[1]")
    assert "version: got None" in told(DataError)


def test_a_missing_file_is_a_fault_of_the_settings(make_scene):
    with pytest.raises(DataError, match="not readable"):
        calibrate(make_scene(calibration="nowhere.json"), FRAMES)


@pytest.mark.parametrize("side", [0, -255, 40_000, 10**400])
def test_a_size_that_no_photograph_has_is_refused(written, side):
    _, path = written
    path.write_text(json.dumps(json.loads(path.read_text()) | {"photograph_px": [255, side]}))
    with pytest.raises(DataError, match=r"photograph_px: got 255 x -?\d+; expected 1 to 32766 px"):
        read_calibration(path)
