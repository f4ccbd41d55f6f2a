"""From px to mm and back: scale and tip, control points, a board, or an earlier calibration; only here."""

import logging
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import Direction
from ploughval.errors import CalibrationError, ConfigError, Fault
from ploughval.limits import MM_PER_PX
from ploughval.photos.calibration.blunder import refuse_blunder, refuse_crossed
from ploughval.photos.calibration.board import find_board
from ploughval.photos.calibration.board_fit import (
    centre_offset_px,
    fit_board,
    place_board,
    turn_of_rows,
)
from ploughval.photos.calibration.camera_fit import (
    ASSUMED_K1_STD,
    CameraFit,
    PointSet,
    fit_camera,
    window_sources,
)
from ploughval.photos.calibration.camera_model import PARAMETERS, CameraModel
from ploughval.photos.calibration.file import read_calibration
from ploughval.photos.calibration.lens import Lens
from ploughval.photos.calibration.mapping import POINT_COLUMNS, Calibration, local_axes, scale_at_origin
from ploughval.photos.markers.control import find_control_points
from ploughval.photos.series.frames import FrameSeries
from ploughval.scene import Camera, Scene, Window

log = logging.getLogger(__name__)

Array = NDArray[np.float64]

_POOR_PX = 2.0
_POOR_SCALE = 0.01
_ASKEW = np.radians(0.1)
_LEAST_POINTS = 4  # that a homography needs


def calibrate(scene: Scene, frames: FrameSeries) -> Calibration:
    """Calibrate the photographs of a test.

    Parameters
    ----------
    scene : Scene
        With a [camera] table.
    frames : FrameSeries
        Its photographs: their size, and the first of them where control markers are found in it.

    Returns
    -------
    Calibration

    Raises
    ------
    CalibrationError
        Points that fix nothing or contradict each other, a board that is not found, a turned photograph.
    DataError
        A picture of a board, or a calibration file, that cannot be read.
    ConfigError
        No [camera].
    """
    camera = scene.camera
    if camera is None:
        raise ConfigError(scene.source, [Fault("camera", "no such table", "a [camera] table", "Add it.")])
    if camera.tip_px is not None:
        _check_tip(scene, camera.tip_px, frames.shape)
    if camera.control_points is not None:
        try:
            calibration = _by_points(camera, frames)
        except CalibrationError as error:
            raise CalibrationError(f"{scene.source}, camera.control_points: {error}") from None
    elif camera.board is not None:
        calibration = _by_board(scene, camera, frames.shape)
    elif camera.calibration is not None:
        calibration = _by_file(scene, camera, frames.shape)
    else:
        return _by_scale(camera, frames.shape)
    _check_scale(scene, camera, calibration)
    _check_view(calibration, camera, frames.shape)
    calibration = replace(calibration, warnings=calibration.warnings + _doubts(calibration))
    for text in calibration.warnings:
        log.warning("%s", text)
    return calibration


def _check_scale(scene: Scene, camera: Camera, calibration: Calibration) -> None:
    """Refuse a scale that comes of lengths in another unit: what is drawn and sampled in mm would be huge."""
    if calibration.mm_per_px > MM_PER_PX:
        key = next(
            key for key in ("control_points", "board", "calibration") if getattr(camera, key) is not None
        )
        raise CalibrationError(
            f"{scene.source}, camera.{key}: gives {calibration.mm_per_px:.4g} mm a pixel; expected at most "
            f"{MM_PER_PX:g}. Give lengths in mm and places in px"
        )


def _check_tip(scene: Scene, tip_px: tuple[float, float], shape: tuple[int, int]) -> None:
    """Refuse a tip that no photograph shows."""
    height, width = shape
    if not (-0.5 <= tip_px[0] <= width - 0.5 and -0.5 <= tip_px[1] <= height - 0.5):
        expected = f"a place in the photograph of {width} x {height} px"
        fault = Fault("camera.tip_px", repr(list(tip_px)), expected, "Read it off the first photograph.")
        raise ConfigError(scene.source, [fault])


def _by_scale(camera: Camera, shape: tuple[int, int]) -> Calibration:
    if camera.mm_per_px is None or camera.tip_px is None:
        raise CalibrationError("mm_per_px and tip_px are both needed")
    model = _scaled_model(camera, shape, camera.window)
    relative = camera.mm_per_px_std / camera.mm_per_px
    by_scale = np.zeros(PARAMETERS)
    by_scale[[0, 1, 3, 4]] = -relative * model.px_from_face[:2, :2].ravel()
    others = window_sources(model, camera.window, lambda pane: _scaled_model(camera, shape, pane))
    spread = np.stack([by_scale, *others], axis=-1)
    scale, std = (camera.mm_per_px, relative) if camera.window is None else scale_at_origin(model, spread)
    return Calibration(
        model=model,
        mm_per_px=scale,
        scale_std=std,
        residual_px=0.0,
        points=pd.DataFrame(np.empty((0, 6)), columns=list(POINT_COLUMNS)),
        method="scale and tip" + _behind(camera),
        direction=camera.direction,
        spread=spread,
        std_px=float("nan"),
        shape=shape,
    )


def _scaled_model(camera: Camera, shape: tuple[int, int], window: Window | None) -> CameraModel:
    """A camera square to the window with the scale given for one of its faces, the world begun at the tip."""
    assert camera.mm_per_px is not None
    assert camera.tip_px is not None
    scale, tip_px = camera.mm_per_px, np.array(camera.tip_px)
    inside = window is not None and window.points_on == "inside"
    for _ in range(8 if inside else 1):  # until the sand, not the outer face, has the scale given
        sx = scale * camera.direction.sign
        matrix = np.array([[1 / sx, 0, tip_px[0]], [0, -1 / scale, tip_px[1]], [0, 0, 1]])
        model = CameraModel.of(matrix, Lens.of_picture(shape), window)
        if inside:
            scale *= camera.mm_per_px / float(model.mm_per_px_at(tip_px))
    return model if window is None else model.moved(model.to_mm(tip_px))


def _by_points(camera: Camera, frames: FrameSeries) -> Calibration:
    points, kind, radius_px = _control_points(camera, frames)
    refuse_crossed(points)
    try:
        fit = fit_camera(points, camera.window)
    except CalibrationError:
        refuse_blunder(points, None, camera.window)  # says more where it can
        raise
    refuse_blunder(points, fit, camera.window)
    if radius_px is not None:
        points = replace(points, px=points.px - centre_offset_px(fit.model, points.mm, radius_px))
        fit = fit_camera(points, camera.window)
    calibration = _from_fit(fit, points, kind, camera)
    if len(points.px) == _LEAST_POINTS:
        text = (
            "four control points fit any camera: one that is mistyped or misread cannot be noticed, and no "
            "uncertainty holds it. Give at least six"
        )
        calibration = replace(calibration, warnings=(*calibration.warnings, text))
    if "direction" in camera.model_fields_set and camera.direction != calibration.direction:
        raise CalibrationError(
            f"the control points say that the blade travels to the {calibration.direction}, but direction is "
            f"{camera.direction}: x_mm grows along the travel. Correct the sign of x_mm or the direction."
        )
    return calibration


def _control_points(camera: Camera, frames: FrameSeries) -> tuple[PointSet, str, Array | None]:
    """The control points as given or found in the photograph, what to call them, and radii of discs, px."""
    if camera.markers is None:
        given = np.array(camera.control_points, float)
        points = _point_set(given[:, :2], given[:, 2:], camera, frames.shape)
        return points, f"{len(points.px)} control points", None
    found = find_control_points(camera, frames)
    for text in found.missing:
        log.warning("%s", text)
    # Paint is less exact than its image: without a stated std on the window the residuals tell more.
    std_px = found.std_px if camera.points_std_mm > 0 else None
    lost = f", {len(found.missing)} more not found" if found.missing else ""
    points = _point_set(found.px, found.mm, camera, frames.shape, std_px)
    points = replace(points, numbers=found.numbers)
    kind = f"{len(points.px)} control markers found in the photograph{lost}"
    return points, kind, found.radius_px


def _point_set(
    px: Array, mm: Array, camera: Camera, shape: tuple[int, int], std_px: Array | None = None
) -> PointSet:
    """Points with the standard uncertainty (N,) of each reading, or the one that the settings give."""
    read = camera.points_std_px if std_px is None else std_px
    if read is None:
        return PointSet(px, mm, shape)
    spans = (np.ptp(px, axis=0), np.ptp(mm, axis=0))
    px_per_mm = float(np.hypot(*spans[0]) / max(np.hypot(*spans[1]), 1e-300))
    std = np.hypot(read, camera.points_std_mm * px_per_mm)
    return PointSet(px, mm, shape, np.broadcast_to(std, len(px)).copy())


def _by_board(scene: Scene, camera: Camera, shape: tuple[int, int]) -> Calibration:
    """The board gives shape and scale; the tip the origin, its path or the picture's rows the travel."""
    if camera.board is None or camera.tip_px is None:
        raise CalibrationError("board and tip_px are both needed")
    found = find_board(scene.path(camera.board.picture), camera.board, shape)
    first, points = fit_board(found, _point_set(found.px, found.mm, camera, shape), camera.window)
    tip_px = np.array(camera.tip_px)
    row_px = tip_px + np.array([camera.direction.sign, 0.0])
    ahead_px = row_px if camera.travel_px is None else np.array(camera.travel_px)
    points = points.with_mm(place_board(first.model, points.mm, tip_px, ahead_px))
    lost = len(found.px) - len(points.px)
    stray = f", {lost} more left out that do not lie on it" if lost else ""
    kind = f"{len(points.px)} points of a {camera.board.kind} board{stray}, origin at tip_px"
    along = (
        ", travel along the picture's rows there" if camera.travel_px is None else " and travel to travel_px"
    )
    fit = fit_camera(points, camera.window)
    calibration = _from_fit(fit, points, kind + along, camera).with_origin_at(tip_px)
    return calibration if camera.travel_px is not None else _with_unknown_travel(calibration)


def _with_unknown_travel(found: Calibration) -> Calibration:
    """With what it costs that travel need not run along the rows of a picture taken askew."""
    turn = turn_of_rows(found.model)
    source = found.model.turned(turn).parameters - found.model.parameters
    found = replace(found, spread=np.column_stack([found.spread, source]))
    if abs(turn) < _ASKEW:
        return found
    text = (
        f"the camera looks askew: rows of the picture are turned by {np.degrees(abs(turn)):.2g} degrees "
        "between its middle and the tip, and travel need not run along those there. Give camera.travel_px"
    )
    return replace(found, warnings=(*found.warnings, text))


def _by_file(scene: Scene, camera: Camera, shape: tuple[int, int]) -> Calibration:
    """The calibration of another test of the same set-up, its origin moved to this test's tip."""
    assert camera.calibration is not None
    path = scene.path(camera.calibration)
    found = read_calibration(path, shape)
    if "direction" in camera.model_fields_set and camera.direction != found.direction:
        raise CalibrationError(
            f"{path}: its blade travels to the {found.direction}, but camera.direction is "
            f"{camera.direction}; expected a test of the same set-up. Calibrate this one by itself"
        )
    if camera.window is not None:
        raise CalibrationError(
            "camera.window: got a table; expected none beside camera.calibration, which holds its window. "
            "Take it out"
        )
    method = f"{found.method}; taken from {camera.calibration}"
    if camera.tip_px is None:
        return replace(found, method=method)
    moved = found.with_origin_at(np.array(camera.tip_px))
    return replace(moved, method=f"{method}, origin at tip_px")


def _from_fit(fit: CameraFit, points: PointSet, through: str, camera: Camera) -> Calibration:
    local = local_axes(fit.model)
    up = np.degrees(np.arctan2(local[0, 1], -local[1, 1]))
    if abs(up) > 45:
        raise CalibrationError(
            f"world y (up) is turned by {up:.0f} degrees from up in the photograph; expected within 45. "
            "Check the signs and the order of x_mm and y_mm (y is up, image y is down); "
            "turned photographs must be turned back."
        )
    scale, scale_std = scale_at_origin(fit.model, fit.spread)
    table = np.hstack([points.px, points.mm, fit.residual_px])
    precision = f"{fit.std_px:.2g} px a coordinate, {fit.std_source}"
    return Calibration(
        model=fit.model,
        mm_per_px=scale,
        scale_std=scale_std,
        residual_px=float(np.sqrt(np.mean(np.sum(fit.residual_px**2, axis=1)))),
        points=pd.DataFrame(table, columns=list(POINT_COLUMNS)),
        method=f"{_words(fit)} through {through}{_behind(camera)}; {precision}",
        direction=Direction.RIGHT if local[0, 0] > 0 else Direction.LEFT,
        spread=fit.spread,
        std_px=fit.std_px,
        shape=points.shape,
        tests=fit.tests,
    )


def _words(fit: CameraFit) -> str:
    """What was fitted, and which terms of the lens did not pay."""
    taken = " and ".join(f"{', '.join(t.terms)} (p = {t.p_value:.1g})" for t in fit.tests if t.taken)
    left = "".join(f", {', '.join(t.terms)} left out (p = {t.p_value:.2g})" for t in fit.tests if not t.taken)
    if not fit.tests:
        left = f", {100 * ASSUMED_K1_STD:g} % of barrel allowed for with so few points"
    return f"homography{' with lens terms ' + taken if taken else ''}{left}"


def _behind(camera: Camera) -> str:
    w = camera.window
    if w is None:
        return ""
    pane = f"{w.thickness_mm:g} mm (index {w.index:g}, {w.distance_mm:g} mm away)"
    return f" on the {w.points_on} of a window of {pane}"


def _check_view(calibration: Calibration, camera: Camera, shape: tuple[int, int]) -> None:
    """The part of the photograph that shows the test must lie on one side of the horizon."""
    x0, y0, x1, y1 = camera.view_px or (0, 0, shape[1], shape[0])
    corners = np.array([[x, y] for x in (x0, x1 - 1) for y in (y0, y1 - 1)], float)
    straight = calibration.model.lens.undistort(corners)
    depth = np.column_stack([straight, np.ones(4)]) @ np.linalg.inv(calibration.model.px_from_face)[2]
    if not (np.all(depth > 0) or np.all(depth < 0)):
        raise CalibrationError(
            "the window's horizon lies within the photograph: the control points cannot be right. "
            "Check their values, or spread them over the window."
        )


def _doubts(calibration: Calibration) -> tuple[str, ...]:
    """What its numbers say against a calibration."""
    texts = []
    if calibration.residual_px > _POOR_PX:
        texts.append(f"control points fit to {calibration.residual_px:.1f} px only: check them, and the lens")
    if calibration.scale_std > _POOR_SCALE:
        texts.append(
            f"the scale at the tip is known to {100 * calibration.scale_std:.2g} % only: spread the points "
            "over the window, around it"
        )
    return tuple(texts)
