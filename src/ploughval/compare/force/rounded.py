"""Place and height of a rounded extreme: the top of a parabola, and how far its flanks' corner lies off."""

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.force.curve import Curve

Floats = NDArray[np.float64]
_FLANK = 4  # points of a flank beyond those near the extreme, or as many as are near
_LEAST = 5  # points of a parabola
_SIGNIFICANT = 4.0


def round_extreme(
    curve: Curve, near: tuple[int, int], k: int, between: tuple[int, int]
) -> tuple[float, float, float, float]:
    """Travel, force and their standard uncertainties at an extreme that is no sharp corner.

    Whether sand or log rounded it, the curve does not tell. The value is the curve's own extreme; a sharp one
    would lie where the straight flanks meet. The root mean square of a rectangle between the two is part of
    the uncertainty.

    Parameters
    ----------
    curve : Curve
        A measured one (``step_mm`` above 0).
    near : (int, int)
        First and last point that noise does not tell from the extreme.
    k : int
        The highest (or lowest) point.
    between : (int, int)
        The extremes before and after, or the curve's ends.

    Returns
    -------
    u_mm, u_std_mm, force_N, force_std_N : float
    """
    width = float(max(curve.step_mm, curve.u_mm[near[1]] - curve.u_mm[near[0]]))
    u, middle = float(curve.u_mm[k]), float(0.5 * (curve.u_mm[near[0]] + curve.u_mm[near[1]]))
    u_std = float(np.hypot(width / np.sqrt(12.0), u - middle))  # anywhere among the points near
    force, noise = float(curve.force_N[k]), float(curve.noise_std_N[k])
    top = _parabola(curve, near)
    if top is not None:
        u, force, noise = top
        u_std = width / float(np.sqrt(12.0))
    corner = _flanks_meet(curve, near, between)
    rounding, shift = 0.0, 0.0
    if corner is not None:
        rounding, shift = abs(corner[1] - force), abs(corner[0] - u)
    force_std = np.sqrt(noise**2 + rounding**2 / 3 + curve.shared_std_N[k] ** 2)
    return u, float(np.hypot(u_std, min(shift, width) / np.sqrt(3.0))), force, float(force_std)


def _parabola(curve: Curve, near: tuple[int, int]) -> tuple[float, float, float] | None:
    """Place and height of the vertex, and the height's noise; None where points are few or it is outside."""
    part = slice(near[0], near[1] + 1)
    u, force = curve.u_mm[part], curve.force_N[part]
    if u.size < _LEAST:
        return None
    middle, half = 0.5 * (u[0] + u[-1]), 0.5 * (u[-1] - u[0])
    basis = np.vander((u - middle) / half, 3)
    (bend, slope, level), _, rank, _ = np.linalg.lstsq(basis, force, rcond=None)
    if rank < 3:
        return None
    spread = curve.noise_std_N[near[0]] ** 2 * np.linalg.inv(basis.T @ basis)
    # Only a bend that noise does not make has a top: beside a corner the points lie on a straight flank.
    if abs(bend) <= _SIGNIFICANT * np.sqrt(spread[0, 0]) or abs(slope) > 2 * abs(bend):
        return None
    at = -slope / (2 * bend)
    row = np.array([at * at, at, 1.0])
    noise = float(np.sqrt(row @ spread @ row))
    return float(middle + half * at), float(level - slope**2 / (4 * bend)), noise


def _flanks_meet(curve: Curve, near: tuple[int, int], between: tuple[int, int]) -> tuple[float, float] | None:
    """Where straight lines through the flanks meet; None without two flanks that meet between them."""
    count = max(_FLANK, near[1] - near[0])
    before = slice(max(between[0], near[0] - count), near[0])
    after = slice(near[1] + 1, min(between[1], near[1] + count) + 1)
    lines = []
    for part in (before, after):
        u = curve.u_mm[part]
        if u.size < 2:
            return None
        slope, level = np.polyfit(u - curve.u_mm[near[0]], curve.force_N[part], 1)
        lines.append((float(slope), float(level)))
    turn = lines[0][0] - lines[1][0]
    if turn == 0:
        return None
    shift = (lines[1][1] - lines[0][1]) / turn
    at = float(curve.u_mm[near[0]]) + shift
    inside = curve.u_mm[before][0] <= at <= curve.u_mm[after][-1]
    return (at, lines[0][1] + lines[0][0] * shift) if inside else None
