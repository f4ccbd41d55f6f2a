"""Plane-to-plane projection by normalised DLT and Gauss-Newton (Hartley and Zisserman, 2004, ch. 4)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError

Array = NDArray[np.float64]
_FLAT = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """A fitted homography mm -> px with what its points say about its quality.

    px_from_mm (3, 3); residual_px (N, 2) projected minus given; covariance (9, 9) of the entries of
    px_from_mm for a standard deviation of 1 px in each coordinate.
    """

    px_from_mm: Array
    residual_px: Array
    covariance: Array

    @property
    def freedom(self) -> int:
        """Number of redundant coordinates."""
        return 2 * len(self.residual_px) - 8

    @property
    def sum_of_squares(self) -> float:
        """Sum of squared residuals, px^2."""
        return float(np.sum(self.residual_px**2))


def project(matrix: Array, points: Array) -> Array:
    """Apply a (3, 3) homography to points (..., 2)."""
    points = np.asarray(points, float)
    mapped = points @ matrix[:, :2].T + matrix[:, 2]
    return mapped[..., :2] / mapped[..., 2:]


def inverse(matrix: Array) -> Array:
    """Inverse of a (3, 3) homography."""
    return np.asarray(np.linalg.inv(matrix), np.float64)


def fit_projection(px: Array, mm: Array) -> Projection:
    """Fit the homography that maps `mm` (N, 2) to `px` (N, 2), errors being in px.

    Raises
    ------
    CalibrationError
        Fewer than 4 points, or points that do not fix a homography (on a line, coinciding).
    """
    if len(px) < 4:
        raise CalibrationError(f"{len(px)} points; expected at least 4 for a homography")
    for what, points in (("px", px), ("mm", mm)):
        _refuse_line(points, what)
    to_p, to_m = _normaliser(px), _normaliser(mm)
    p, m = project(to_p, px), project(to_m, mm)
    fitted = _refine(_direct(p, m), p, m)
    _refuse_fold(fitted, m)
    back = inverse(to_p)
    matrix = back @ fitted @ to_m
    jacobian = _jacobian(fitted, m) / to_p[0, 0]  # px a unit of each of the first eight entries
    inner = np.zeros((9, 9))
    inner[:8, :8] = np.linalg.inv(jacobian.T @ jacobian)
    outer = np.kron(back, to_m.T)  # vec of back @ H @ to_m, row by row
    scale = matrix[2, 2]
    return Projection(matrix / scale, project(matrix, mm) - px, outer @ inner @ outer.T / scale**2)


def log_scale_std(fit: Projection, mm: Array, std_px: float) -> float:
    """Relative standard uncertainty of the scale at `mm` (2,) for errors of `std_px` in each coordinate.

    The scale squared is the Jacobian |det H| / w^3, w being the denominator at the point.
    """
    matrix = fit.px_from_mm
    place = np.append(mm, 1.0)
    gradient = inverse(matrix).T.copy()
    gradient[2] -= 3 * place / (matrix[2] @ place)
    gradient = 0.5 * gradient.ravel()
    return std_px * float(np.sqrt(np.clip(gradient @ fit.covariance @ gradient, 0.0, None)))


def _normaliser(points: Array) -> Array:
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


def _jacobian(matrix: Array, m: Array) -> Array:
    """Derivatives (2N, 8) of the projected coordinates (all x, then all y) by the first eight entries."""
    h = np.column_stack([m, np.ones(len(m))])
    w = h @ matrix[2]
    u, nil = h / w[:, None], np.zeros_like(h)
    x, y = project(matrix, m).T[..., None]
    return np.vstack([np.hstack([u, nil, -x * u[:, :2]]), np.hstack([nil, u, -y * u[:, :2]])])


def _refine(matrix: Array, p: Array, m: Array) -> Array:
    """Gauss-Newton on the reprojection error from the direct solution; a step that does not help ends it."""
    best = float(np.sum((project(matrix, m) - p) ** 2))
    for _ in range(20):
        residual = (p - project(matrix, m)).T.ravel()
        step = np.linalg.lstsq(_jacobian(matrix, m), residual, rcond=None)[0]
        trial = matrix + np.append(step, 0.0).reshape(3, 3)
        error = float(np.sum((project(trial, m) - p) ** 2))
        if not error < best:
            break
        matrix, best = trial, error
    return matrix


def _refuse_fold(matrix: Array, m: Array) -> None:
    depth = np.column_stack([m, np.ones(len(m))]) @ matrix[2]
    if not (np.all(depth > 0) or np.all(depth < 0)):
        raise CalibrationError(
            "the control points lie on both sides of the camera's horizon: check their values"
        )
