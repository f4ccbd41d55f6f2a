"""A camera from the points of a board: strays left out, the centres of dots corrected for perspective."""

import numpy as np
from numpy.typing import NDArray

from ploughval.photos.camera_fit import CameraFit, PointSet, fit_camera
from ploughval.scene import Board, Window

Array = NDArray[np.float64]

_STRAY_STDS, _STRAY_PX = 6.0, 0.3
_MOST_STRAYS = 0.1


def fit_board(
    found: tuple[Array, Array], board: Board, points: PointSet, window: Window | None
) -> tuple[CameraFit, PointSet]:
    """Fit a camera to a board's points, in the board's own millimetres.

    Parameters
    ----------
    found : tuple
        As ``find_board`` gives it.
    board : Board
        What the board is.
    points : PointSet
        The same points with their standard uncertainty.
    window : Window or None
        The pane that the fit allows for.

    Returns
    -------
    CameraFit
    PointSet
        The points that it is through.
    """
    fit = fit_camera(points, window)
    for _ in range(max(1, int(_MOST_STRAYS * len(found[0])))):
        off = np.hypot(*fit.residual_px.T)
        usual = float(np.median(off)) / 1.18  # std of a coordinate of which the distance has this median
        worst = int(np.argmax(off))
        if len(points.px) < 8 or off[worst] < max(_STRAY_STDS * usual, _STRAY_PX):
            break
        points = points.without(worst)
        fit = fit_camera(points, window)
    return fit, points
