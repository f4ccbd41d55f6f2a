"""The line through the tip that parts sand moving with the blade from sand at rest."""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from ploughval.tracers.view import Floats

_LEAST_MOVING = 4  # points on either side of a line
_WIDTH_SPACINGS = 0.3  # least half-width of the change from rest to motion, in spacings of the points
_ITERATIONS = 40
_GROUPS = 8  # stretches of the line whose residuals may go together
_FAR_WIDTHS = 6.0  # points further from the line than this take no part in its fit


@dataclass(frozen=True, slots=True)
class BandLine:
    """A shear band through the tip: inclination with its std, degrees, and half-width, mm."""

    beta_deg: float
    std_deg: float
    half_width_mm: float


def fit_line(place: Floats, share: Floats, noise: float) -> BandLine | None:
    """Fit the line between moving and still points.

    The block moves by du (1, tan beta): the horizontal motion in parts of the blade's is 1 above
    the line and 0 below it, whatever beta is. Near the line correlation windows see both: the share
    rises over a width that is fitted with the angle.

    Parameters
    ----------
    place : (N, 2) float, mm
        Points relative to the tip.
    share : (N,) float
        Horizontal motion in parts of the blade's.
    noise : float
        Standard deviation of share.

    Returns
    -------
    BandLine or None
        None where nothing moves with the blade.
    """
    usual = np.abs(share - 0.5) < max(1.0, 4 * noise)
    place, share = place[usual], np.clip(share[usual], 0.0, 1.0)
    if len(share) == 0:
        return None
    angle = _parting_angle(place, share)
    moving = place[:, 1] * np.cos(angle) > place[:, 0] * np.sin(angle)
    if (
        not np.isfinite(angle)
        or (moving & (share > 0.5)).sum() < _LEAST_MOVING
        or (~moving).sum() < _LEAST_MOVING
    ):
        return None
    if not 0 < angle < np.radians(89):
        return None
    return _refine(place, share, angle, _spacing(place), noise)


def _parting_angle(place: Floats, share: Floats) -> float:
    """Angle with the least misplaced motion, each point counting by its distance from the tip."""
    angle = np.arctan2(place[:, 1], place[:, 0])
    order = np.argsort(angle, kind="stable")
    angle, share = angle[order], share[order]
    weight = np.hypot(*place[order].T)
    moving_below = np.concatenate([[0.0], np.cumsum(weight * share)])
    still_above = np.concatenate([np.cumsum((weight * (1 - share))[::-1])[::-1], [0.0]])
    cut = int(np.argmin(moving_below + still_above))
    if cut in (0, len(angle)):
        return np.nan
    return float((angle[cut - 1] + angle[cut]) / 2)


def _refine(place: Floats, share: Floats, angle: float, spacing: float, noise: float) -> BandLine:
    """Least squares for the angle and the width of the change (Gauss-Newton, robust against strays)."""
    least = _WIDTH_SPACINGS * spacing
    width = max(spacing, least)
    std = np.nan
    for _ in range(_ITERATIONS):
        sin, cos = np.sin(angle), np.cos(angle)
        above = place[:, 1] * cos - place[:, 0] * sin
        along = place[:, 0] * cos + place[:, 1] * sin
        near = np.abs(above) < _FAR_WIDTHS * width + 2 * spacing
        z = above[near] / width
        residual = share[near] - ndtr(z)
        bell = np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi)
        jacobian = np.column_stack([-along[near] * bell / width, -z * bell / width])
        tolerance = max(2.5 * 1.4826 * float(np.median(np.abs(residual))), 2.5 * noise, 0.1)
        weight = np.minimum(1.0, tolerance / np.maximum(np.abs(residual), 1e-12))
        normal = jacobian.T @ (weight[:, None] * jacobian) + 1e-12 * np.eye(2)
        step = np.linalg.solve(normal, jacobian.T @ (weight * residual))
        limit = 0.5 * width / max(float(along.max()), spacing)
        angle += float(np.clip(step[0], -limit, limit))
        width = float(np.clip(width + np.clip(step[1], -width / 2, width), least, 20 * spacing))
        std = _angle_std(normal, jacobian, weight * residual, along[near], noise)
        if abs(step[0]) < 1e-7:
            break
    return BandLine(float(np.degrees(angle)), float(np.degrees(std)), width)


def _angle_std(normal: Floats, jacobian: Floats, residual: Floats, along: Floats, noise: float) -> float:
    """Standard deviation of the angle, from residuals that go together in groups along the line."""
    inverse = np.linalg.inv(normal)
    group = np.minimum((along / max(float(along.max()), 1e-9) * _GROUPS).astype(int), _GROUPS - 1)
    scores = np.zeros((_GROUPS, 2))
    np.add.at(scores, np.maximum(group, 0), residual[:, None] * jacobian)
    grouped = inverse @ (scores.T @ scores) @ inverse * _GROUPS / (_GROUPS - 1)
    spread = max(float(np.sum(residual**2)) / max(len(residual) - 2, 1), noise**2)
    return float(np.sqrt(max(grouped[0, 0], spread * inverse[0, 0])))


def _spacing(place: Floats) -> float:
    """Typical distance of neighbouring points, mm, from the area they cover."""
    span = np.ptp(place, axis=0)
    return max(float(np.sqrt(span[0] * span[1] / len(place))), 1e-6)
