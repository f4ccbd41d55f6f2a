"""Plane-to-plane projection by the normalised direct linear transform (Hartley and Zisserman 2004, ch. 4)."""

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError

Array = NDArray[np.float64]
_FLAT = 1e-3


def project(matrix: Array, points: Array) -> Array:
    """Apply a (3, 3) homography to points (..., 2), docs/theory-calibration.md, Eq. (1)."""
    points = np.asarray(points, float)
    mapped = points @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(mapped[..., :2] / mapped[..., 2:])


def inverse(matrix: Array) -> Array:
    """Inverse of a (3, 3) homography."""
    return np.asarray(np.linalg.inv(matrix), np.float64)


def direct_projection(px: Array, mm: Array) -> Array:
    """The homography (3, 3) that maps `mm` (N, 2) to `px` (N, 2), of least algebraic error.

    Raises
    ------
    CalibrationError
        Fewer than 4 points, or points that do not fix a homography (on a line, coinciding, folded).
    """
    if len(px) < 4:
        raise CalibrationError(f"{len(px)} points; expected at least 4 for a homography")
    for what, points in (("px", px), ("mm", mm)):
        _refuse_line(points, what)
    to_p, to_m = normaliser(px), normaliser(mm)
    m = project(to_m, mm)
    matrix = _direct(project(to_p, px), m)
    refuse_fold(matrix, m)
    return np.asarray(inverse(to_p) @ matrix @ to_m)


def normaliser(points: Array) -> Array:
    """Shift and scale (3, 3) that bring points to zero mean and a mean square distance of 2."""
    centre = points.mean(axis=0)
    scale = np.sqrt(2.0) / np.sqrt(np.mean(np.sum((points - centre) ** 2, axis=1)))
    return np.array([[scale, 0, -scale * centre[0]], [0, scale, -scale * centre[1]], [0, 0, 1.0]])


def _refuse_line(points: Array, what: str) -> None:
    if not np.isfinite(points).all():
        raise CalibrationError(f"control points hold {what} values that are not finite")
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[0] == 0 or spread[1] < _FLAT * spread[0]:
        raise CalibrationError(
            f"the control points lie on one line in {what}; expected points spread over the window: "
            "a homography needs four of which no three are on a line"
        )


def _direct(p: Array, m: Array) -> Array:
    """Direct linear transform of normalised points; refuses points that leave it undetermined."""
    one, nil = np.ones(len(p)), np.zeros((len(p), 3))
    h = np.column_stack([m, one])
    rows = np.vstack([np.hstack([h, nil, -p[:, :1] * h]), np.hstack([nil, h, -p[:, 1:] * h])])
    _, values, vectors = np.linalg.svd(rows)
    if values[7] < 1e-4 * values[0]:
        raise CalibrationError(
            "the control points do not fix a homography: too many coincide or lie on one line; "
            "expected four or more of which no three are on a line"
        )
    matrix = vectors[8].reshape(3, 3)
    if abs(matrix[2, 2]) < 1e-9 * np.abs(matrix).max():
        raise CalibrationError(
            "the control points lie on both sides of the camera's horizon: check their values"
        )
    return np.asarray(matrix / matrix[2, 2])


def refuse_fold(matrix: Array, m: Array) -> None:
    """Refuse a homography whose horizon runs between the points (N, 2).

    Raises
    ------
    CalibrationError
    """
    depth = np.column_stack([m, np.ones(len(m))]) @ matrix[2]
    if not (np.all(depth > 0) or np.all(depth < 0)):
        raise CalibrationError(
            "the control points lie on both sides of the camera's horizon: check their values"
        )
