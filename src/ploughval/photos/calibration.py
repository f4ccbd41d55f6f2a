"""From px to mm and back: scale and tip, control points, or a board; the only place that does it."""

import logging
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import Direction
from ploughval.errors import CalibrationError, ConfigError, Fault
from ploughval.photos.board import find_board
from ploughval.photos.frames import FrameSeries
from ploughval.photos.homography import Array, Projection, fit_projection, inverse, log_scale_std, project
from ploughval.scene import Camera, Scene

log = logging.getLogger(__name__)

POINT_COLUMNS = ("px_x", "px_y", "x_mm", "y_mm", "residual_x_px", "residual_y_px")
_ASSUMED_CLICK_PX = 0.5
_BLUNDER_PX = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """Mapping between the photograph (px) and the world (mm).

    Attributes
    ----------
    px_from_mm, mm_from_px : (3, 3) float
        Homographies, each other's inverse.
    mm_per_px : float
        Scale at the tip, mm per px (geometric mean of the two directions).
    scale_std : float
        Relative standard uncertainty of the scale at the tip.
    residual_px : float
        Root mean square distance between given and projected points, px; 0 without redundant points.
    points : DataFrame
        px_x, px_y, x_mm, y_mm, residual_x_px, residual_y_px (projected minus given); may be empty.
    method : str
        How it was found, for the report.
    direction : Direction
        The way the blade travels in the photograph.
    """

    px_from_mm: NDArray[np.float64]
    mm_from_px: NDArray[np.float64]
    mm_per_px: float
    scale_std: float
    residual_px: float
    points: pd.DataFrame
    method: str
    direction: Direction

    def to_mm(self, px: NDArray[np.float64]) -> NDArray[np.float64]:
        """World coordinates (..., 2), mm, of image points (..., 2), px."""
        return project(self.mm_from_px, px)

    def to_px(self, mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Image coordinates (..., 2), px, of world points (..., 2), mm."""
        return project(self.px_from_mm, mm)


def calibrate(scene: Scene, frames: FrameSeries) -> Calibration:
    """Calibrate the photographs of a test.

    Parameters
    ----------
    scene : Scene
        With a [camera] table.
    frames : FrameSeries
        Its photographs; only their size is used.

    Returns
    -------
    Calibration

    Raises
    ------
    CalibrationError
        Points that fix nothing or contradict each other, a board that is not found, a turned photograph.
    ConfigError
        No [camera].
    """
    camera = scene.camera
    if camera is None:
        raise ConfigError(scene.source, [Fault("camera", "no such table", "a [camera] table", "Add it.")])
    if frames is not None and camera.tip_px is not None:
        _check_tip(scene, camera.tip_px, frames.shape)
    if camera.control_points is not None:
        calibration = _by_points(camera)
    elif camera.board is not None:
        calibration = _by_board(scene, camera, frames.shape)
    else:
        return _by_scale(camera)
    _check_view(calibration, camera, frames.shape)
    return calibration


def _check_tip(scene: Scene, tip_px: tuple[float, float], shape: tuple[int, int]) -> None:
    """Refuse a tip that no photograph shows."""
    height, width = shape
    if not (-0.5 <= tip_px[0] <= width - 0.5 and -0.5 <= tip_px[1] <= height - 0.5):
        expected = f"a place in the photograph of {width} x {height} px"
        fault = Fault("camera.tip_px", repr(list(tip_px)), expected, "Read it off the first photograph.")
        raise ConfigError(scene.source, [fault])


def _by_scale(camera: Camera) -> Calibration:
    if camera.mm_per_px is None or camera.tip_px is None:
        raise CalibrationError("mm_per_px and tip_px are both needed")
    scale, (tip_x, tip_y) = camera.mm_per_px, camera.tip_px
    sx = scale * camera.direction.sign
    mm_from_px = np.array([[sx, 0, -sx * tip_x], [0, -scale, scale * tip_y], [0, 0, 1]])
    px_from_mm = np.array([[1 / sx, 0, tip_x], [0, -1 / scale, tip_y], [0, 0, 1]])
    points = pd.DataFrame(np.empty((0, 6)), columns=list(POINT_COLUMNS))
    std = camera.mm_per_px_std / scale
    return Calibration(px_from_mm, mm_from_px, scale, std, 0.0, points, "scale and tip", camera.direction)


def _by_points(camera: Camera) -> Calibration:
    given = np.array(camera.control_points, float)
    px, mm = given[:, :2], given[:, 2:]
    fit = fit_projection(px, mm)
    _refuse_blunder(px, mm, fit)
    calibration = _from_fit(fit, px, mm, f"homography through {len(px)} control points")
    if "direction" in camera.model_fields_set and camera.direction != calibration.direction:
        raise CalibrationError(
            f"the control points say that the blade travels to the {calibration.direction}, but direction is "
            f"{camera.direction}: x_mm grows along the travel. Correct the sign of x_mm or the direction."
        )
    return calibration


def _by_board(scene: Scene, camera: Camera, shape: tuple[int, int]) -> Calibration:
    """The board gives shape and scale; the tip the origin, the picture's rows the line of travel."""
    if camera.board is None or camera.tip_px is None:
        raise CalibrationError("board and tip_px are both needed")
    px, mm = find_board(scene.path(camera.board.picture), camera.board, shape)
    world = _place_board(fit_projection(px, mm), mm, np.array(camera.tip_px), camera.direction)
    kind = f"homography through {len(px)} points of a {camera.board.kind} board, origin at tip_px"
    return _from_fit(fit_projection(px, world), px, world, kind)


def _place_board(fit: Projection, mm: Array, tip_px: Array, direction: Direction) -> Array:
    """Board points (N, 2) in world mm: moved to the tip, turned so that travel is along the rows."""
    mm_from_px = inverse(fit.px_from_mm)
    tip, ahead, above = project(mm_from_px, tip_px + np.array([[0, 0], [direction.sign, 0], [0, -1.0]]))
    along = (ahead - tip) / np.hypot(*(ahead - tip))
    up = np.array([-along[1], along[0]])
    up = up if up @ (above - tip) > 0 else -up
    return np.asarray((mm - tip) @ np.column_stack([along, up]))


def _from_fit(fit: Projection, px: Array, mm: Array, method: str) -> Calibration:
    origin = np.zeros(2)
    local = _local_axes(fit.px_from_mm, origin)
    scale = 1 / np.sqrt(abs(np.linalg.det(local)))
    up = np.degrees(np.arctan2(local[0, 1], -local[1, 1]))
    if abs(up) > 45:
        raise CalibrationError(
            f"world y (up) is turned by {up:.0f} degrees from up in the photograph; expected within 45. "
            "Check the signs and the order of x_mm and y_mm (y is up, image y is down); "
            "turned photographs must be turned back."
        )
    if fit.freedom >= 4:
        std_px, source = float(np.sqrt(fit.sum_of_squares / fit.freedom)), "from the residuals"
    else:
        std_px, source = _ASSUMED_CLICK_PX, "assumed, for too few points are redundant"
    return Calibration(
        px_from_mm=fit.px_from_mm,
        mm_from_px=inverse(fit.px_from_mm),
        mm_per_px=float(scale),
        scale_std=log_scale_std(fit, origin, std_px),
        residual_px=float(np.sqrt(fit.sum_of_squares / len(px))),
        points=pd.DataFrame(np.hstack([px, mm, fit.residual_px]), columns=list(POINT_COLUMNS)),
        method=f"{method}; {std_px:.2g} px a coordinate, {source}",
        direction=Direction.RIGHT if local[0, 0] > 0 else Direction.LEFT,
    )


def _local_axes(matrix: Array, mm: Array) -> Array:
    """Derivative (2, 2) of px by mm at a point: rows x, y in px; columns x, y in mm."""
    w = matrix[2] @ np.append(mm, 1.0)
    return np.asarray((matrix[:2, :2] - np.outer(project(matrix, mm), matrix[2, :2])) / w)


def _refuse_blunder(px: Array, mm: Array, fit: Projection) -> None:
    """Refuse a single point that contradicts all others: F test of the fit without it, each point in turn."""
    if len(px) < 6:
        return
    from scipy.stats import f as fisher

    found: list[tuple[float, int, Array]] = []
    for k in range(len(px)):
        try:
            rest = fit_projection(np.delete(px, k, axis=0), np.delete(mm, k, axis=0))
        except CalibrationError:  # the others fix nothing without this point
            continue
        off = project(rest.px_from_mm, mm[k]) - px[k]
        gain = (fit.sum_of_squares - rest.sum_of_squares) / 2
        ratio = gain / max(rest.sum_of_squares / rest.freedom, 1e-12)
        chance = len(px) * float(fisher.sf(ratio, 2, rest.freedom))
        if chance < 0.01 and np.hypot(*off) > _BLUNDER_PX:
            found.append((rest.sum_of_squares, k, project(inverse(rest.px_from_mm), px[k])))
    if found:
        _, k, place = min(found, key=lambda item: item[0])
        raise CalibrationError(
            f"control_points.{k}: got {[*px[k].tolist(), *mm[k].tolist()]}; expected about "
            f"x_mm = {place[0]:.1f}, y_mm = {place[1]:.1f} at that px from the other {len(px) - 1} points. "
            "Correct the point or take it out."
        )


def _check_view(calibration: Calibration, camera: Camera, shape: tuple[int, int]) -> None:
    """The part of the photograph that shows the test must lie on one side of the horizon."""
    x0, y0, x1, y1 = camera.view_px or (0, 0, shape[1], shape[0])
    corners = np.array([[x, y, 1.0] for x in (x0, x1 - 1) for y in (y0, y1 - 1)])
    depth = corners @ calibration.mm_from_px[2]
    if not (np.all(depth > 0) or np.all(depth < 0)):
        raise CalibrationError(
            "the window's horizon lies within the photograph: the control points cannot be right. "
            "Check their values, or spread them over the window."
        )
    if calibration.residual_px > 2.0:
        log.warning("control points fit to %.1f px only: check them, and the lens", calibration.residual_px)
