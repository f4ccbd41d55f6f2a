"""Where a camera stands over a plane: from the plane's homography and the distance (after Zhang 2000)."""

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError

Array = NDArray[np.float64]


def foot_mm(px_from_face: Array, centre_px: Array, distance_mm: float) -> Array:
    """Where the normal through the camera meets the window, (2,) mm, for a camera at a known distance.

    The optical axis is taken to go through the picture's middle; the focal length follows from the distance.

    Raises
    ------
    CalibrationError
        When no focal length puts the camera at that distance.
    """
    from scipy.optimize import brentq

    back = np.eye(3)
    back[:2, 2] = -centre_px
    matrix = back @ px_from_face

    def off(log_focal: float) -> float:
        return float(np.log(_foot(matrix, float(np.exp(log_focal)))[1] / distance_mm))

    scale = np.sqrt(abs(np.linalg.det(px_from_face)))  # px a mm, about
    guess = float(np.log(distance_mm * scale))
    try:
        focal_px = np.exp(brentq(off, guess - 2, guess + 2, xtol=1e-13))
    except ValueError:
        raise CalibrationError(
            f"camera.window.distance_mm: got {distance_mm:g}; no camera at that distance sees the window as "
            "the points say. Check it, or give camera.window.foot_px: where the lens sees itself mirrored"
        ) from None
    return _foot(matrix, float(focal_px))[0]


def _foot(matrix: Array, focal_px: float) -> tuple[Array, float]:
    """Foot point (2,) mm of a camera of that focal length, and the distance to it, mm.

    ``matrix`` is the plane's homography about the picture's middle. The foot is seen where the plane's normal
    vanishes.
    """
    axes = matrix / np.array([[focal_px], [focal_px], [1.0]])
    length = np.sqrt(np.linalg.norm(axes[:, 0]) * np.linalg.norm(axes[:, 1]))
    u, _, v = np.linalg.svd(axes[:, :2] / length, full_matrices=False)
    turn = u @ v  # the nearest two columns of a rotation
    normal = np.cross(turn[:, 0], turn[:, 1])
    foot = np.linalg.solve(axes, normal)
    foot = foot[:2] / foot[2]
    return foot, float(np.linalg.norm(axes @ np.append(foot, 1.0)) / length)
