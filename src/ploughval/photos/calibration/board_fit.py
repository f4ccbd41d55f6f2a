"""A camera from the points of a board: strays left out, the centres of dots corrected for perspective."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ploughval.photos.calibration.board import BoardPoints
from ploughval.photos.calibration.camera_fit import CameraFit, PointSet, fit_camera
from ploughval.photos.calibration.camera_model import CameraModel
from ploughval.scene import Window

Array = NDArray[np.float64]

_STRAY_STDS, _STRAY_PX = 6.0, 0.3
_MOST_STRAYS = 0.3  # of the points: what glare or a hand may spoil
_RIM = 32  # directions


def fit_board(found: BoardPoints, points: PointSet, window: Window | None) -> tuple[CameraFit, PointSet]:
    """Fit a camera to a board's points, in the board's own millimetres.

    Parameters
    ----------
    found : BoardPoints
        As ``find_board`` gives it.
    points : PointSet
        The same points with their standard uncertainty.
    window : Window or None
        The pane that the fit allows for.

    Returns
    -------
    CameraFit
    PointSet
        The points that it is through, dots where their centres are seen.
    """
    fit, points, kept = _without_strays(points, window)
    if found.radius_px is None:
        return fit, points
    off = centre_offset_px(fit.model, points.mm, found.radius_px[kept])
    points = replace(points, px=points.px - off)
    return fit_camera(points, window), points


def _without_strays(points: PointSet, window: Window | None) -> tuple[CameraFit, PointSet, NDArray[np.int64]]:
    """Leave out the worst point as long as it lies far beyond the scatter of the others."""
    fit, kept = fit_camera(points, window), np.arange(len(points.px))
    for _ in range(int(_MOST_STRAYS * len(points.px))):
        off = np.hypot(*fit.residual_px.T)
        usual = float(np.median(off)) / 1.18  # std of a coordinate, of which the distance has this median
        worst = int(np.argmax(off))
        if len(points.px) < 8 or off[worst] < max(_STRAY_STDS * usual, _STRAY_PX):
            break
        points, kept = points.without(worst), np.delete(kept, worst)
        fit = fit_camera(points, window)
    return fit, points, kept


def place_board(model: CameraModel, mm: Array, tip_px: Array, ahead_px: Array) -> Array:
    """Board points (N, 2) in world mm: moved to the tip, turned so that travel is towards another place."""
    tip, ahead, above = model.to_mm(np.stack([tip_px, ahead_px, tip_px + np.array([0, -1.0])]))
    along = (ahead - tip) / np.hypot(*(ahead - tip))
    up = np.array([-along[1], along[0]])
    up = up if up @ (above - tip) > 0 else -up
    return np.asarray((mm - tip) @ np.column_stack([along, up]))


def turn_of_rows(model: CameraModel) -> float:
    """By how much the rows of the picture are turned between its middle and the world's origin, rad.

    A camera that looks askew shows lines that are level as lines that converge: nothing in the picture of a
    board tells which row is level, and this is how much two good guesses differ.
    """
    ends = [model.to_mm(place + np.array([[-0.5, 0], [0.5, 0]])) for place in _middle_and_origin(model)]
    middle, origin = (complex(*(b - a)) for a, b in ends)
    return float(np.angle(middle / origin))


def _middle_and_origin(model: CameraModel) -> tuple[Array, Array]:
    return model.lens.centre_px, model.to_px(np.zeros(2))


def centre_offset_px(model: CameraModel, centres_mm: Array, radius_px: Array) -> Array:
    """Centre of gravity of a dot's image minus the image of its centre, (N, 2) px.

    Parameters
    ----------
    model : CameraModel
        The camera, lens and window included.
    centres_mm : (N, 2) float, mm
        Centres of the dots.
    radius_px : (N,) float, px
        Radii of their images.
    """
    centre = model.to_px(centres_mm)
    radius_mm = radius_px * model.mm_per_px_at(centre)
    turn = 2 * np.pi * np.arange(_RIM) / _RIM
    rim = np.column_stack([np.cos(turn), np.sin(turn)])
    seen = model.to_px(centres_mm[:, None] + radius_mm[:, None, None] * rim) - centre[:, None]
    x, y = np.moveaxis(seen, -1, 0)
    after_x, after_y = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
    cross = x * after_y - after_x * y
    area = cross.sum(axis=1)
    gravity = [((a + b) * cross).sum(axis=1) / (3 * area) for a, b in ((x, after_x), (y, after_y))]
    return np.stack(gravity, axis=-1)
