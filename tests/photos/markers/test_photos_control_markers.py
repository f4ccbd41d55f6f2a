"""Control points painted on the window: found in the photograph, then calibrated with."""

import math

import cv2
import numpy as np
import pytest

from ploughval import load_scene
from ploughval.errors import CalibrationError, ConfigError
from ploughval.photos import calibrate, open_frames
from ploughval.scene import Camera

SHAPE = (300, 460)
TILT = math.radians(8.0)
# 2 px/mm, the window turned by 8 degrees about a vertical line, the camera 600 mm away
TRUE = np.array([[2.0 * math.cos(TILT), 0.0, 60.0], [0.1, -2.0, 260.0], [math.sin(TILT) / 600.0, 0.0, 1.0]])
PLACES_MM = np.array([[x, y] for y in (15.0, 60.0, 105.0) for x in (0.0, 60.0, 120.0, 185.0)])
RADIUS_MM, FINE = 4.0, 8


def to_px(mm):
    mapped = np.column_stack([mm, np.ones(len(mm))]) @ TRUE.T
    return mapped[:, :2] / mapped[:, 2:]


def photograph(rng, *, without=()):
    """Discs on the window as the tilted camera sees them, counted on an eight times finer grid."""
    y, x = (np.indices((SHAPE[0] * FINE, SHAPE[1] * FINE)) + 0.5) / FINE - 0.5
    back = np.linalg.inv(TRUE)
    w = back[2, 0] * x + back[2, 1] * y + back[2, 2]
    u = (back[0, 0] * x + back[0, 1] * y + back[0, 2]) / w
    v = (back[1, 0] * x + back[1, 1] * y + back[1, 2]) / w
    fine = np.full(x.shape, 205.0, np.float32)
    for k, (cx, cy) in enumerate(PLACES_MM):
        if k not in without:
            fine[(u - cx) ** 2 + (v - cy) ** 2 < RADIUS_MM**2] = 50.0
    picture = fine.reshape(SHAPE[0], FINE, SHAPE[1], FINE).mean(axis=(1, 3))
    picture = cv2.GaussianBlur(picture, (0, 0), 0.7) + 2.0 * rng.standard_normal(SHAPE)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def scene_with(make_scene, tmp_path, image, off_px=3.0, seed=0, **markers):
    cv2.imwrite(str(tmp_path / "photos" / "0.png"), image)
    rng = np.random.default_rng(seed)
    given = to_px(PLACES_MM) + rng.uniform(-off_px, off_px, PLACES_MM.shape)
    return make_scene(
        control_points=[[*px, *mm] for px, mm in zip(given.tolist(), PLACES_MM.tolist(), strict=True)],
        markers={"radius_px": 7.5, **markers},
    )


def test_approximate_places_calibrate_like_exact_ones(make_scene, tmp_path):
    scene = scene_with(make_scene, tmp_path, photograph(np.random.default_rng(1)))
    calibration = calibrate(scene, open_frames(scene))
    grid = np.array([[x, y] for x in np.linspace(0, 185, 8) for y in np.linspace(10, 110, 5)])
    # 0.05 px in the picture: 0.025 mm; twelve points average it
    assert np.abs(calibration.to_px(grid) - to_px(grid)).max() < 0.05
    assert np.abs(calibration.to_mm(to_px(grid)) - grid).max() < 0.025
    assert "12 control markers found in the photograph" in calibration.method


def test_found_places_are_those_of_the_discs_not_of_the_ellipses(make_scene, tmp_path):
    scene = scene_with(make_scene, tmp_path, photograph(np.random.default_rng(2)))
    points = calibrate(scene, open_frames(scene)).points
    off = points[["px_x", "px_y"]].to_numpy() - to_px(PLACES_MM)
    assert np.sqrt(np.mean(off**2)) < 0.02
    assert np.abs(off.mean(axis=0)).max() < 0.01


def test_control_point_that_is_not_there_costs_only_itself(make_scene, tmp_path, caplog):
    scene = scene_with(make_scene, tmp_path, photograph(np.random.default_rng(3), without=(5,)))
    calibration = calibrate(scene, open_frames(scene))
    assert len(calibration.points) == 11
    assert "1 more not found" in calibration.method
    assert "control_points.5: nothing round of radius 7.5 px" in caplog.text
    assert np.abs(calibration.to_px(PLACES_MM) - to_px(PLACES_MM)).max() < 0.06


def test_too_few_markers_are_refused_by_name(make_scene, tmp_path):
    image = photograph(np.random.default_rng(4), without=range(9))
    scene = scene_with(make_scene, tmp_path, image)
    with pytest.raises(
        CalibrationError, match=r"3 of 12 control points were found.*control_points\.0: nothing"
    ):
        calibrate(scene, open_frames(scene))


def test_markers_need_places(make_scene, tmp_path):
    with pytest.raises(ValueError, match="at least 3 markers"):
        Camera(
            photos="*", mm_per_px=0.1, tip_px=(1.0, 2.0), markers={"radius_px": 5.0, "fixed_px": [[1.0, 2.0]]}
        )


def test_unknown_key_of_markers_is_refused(tmp_path):
    (tmp_path / "test.toml").write_text(
        '[test]\nname = "t"\n[blade]\ndepth_mm = 30.0\nwidth_mm = 200.0\n[camera]\nphotos = "*.png"\n'
        "mm_per_px = 0.1\ntip_px = [5.0, 6.0]\n[camera.markers]\nradius_px = 5.0\nfixed = [[1.0, 2.0]]\n"
    )
    with pytest.raises(ConfigError, match=r"camera\.markers\.fixed"):
        load_scene(tmp_path)
