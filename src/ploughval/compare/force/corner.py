"""Place and height of a corner in a noisy, averaged curve: two straight lines that meet there."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.force.curve import Curve

Floats = NDArray[np.float64]
_SIDE = 8  # points of a line beyond those near the extreme
_LEAST = 4


class Corner(NamedTuple):
    """Where the lines meet: travel and force, with the standard uncertainties that noise leaves them."""

    u_mm: float
    force_N: float
    u_std_mm: float
    force_std_N: float


class _Line(NamedTuple):
    level: float  # at the origin given
    slope: float
    squares: float
    points: int


def find_corner(curve: Curve, near: tuple[int, int], first: int, last: int) -> Corner | None:
    """Refine an extreme of a curve whose points are means over steps of travel.

    The highest of many noisy means lies too high, and a mean over a sharp corner too low. Instead two
    straight lines are fitted to the points around the extreme, parted at every point in turn (which belongs
    to neither), and the pair that fits best is taken. At the start of the curve there is only the line ahead.

    Parameters
    ----------
    curve : Curve
        A measured one (``step_mm`` above 0).
    near : (int, int)
        First and last point that noise does not tell from the extreme.
    first : int
        Index of the extreme before, or of the curve's first point.
    last : int
        Index of the extreme after, or of the curve's last point.

    Returns
    -------
    Corner or None
        None where the lines are too short or do not meet at the point that parts them: a rounded extreme.
    """
    start, stop = max(first, near[0] - _SIDE), min(last, near[1] + _SIDE) + 1
    if first == 0 and near[0] < _LEAST:
        return _at_start(curve, near[0], last)
    if stop - start < 2 * _LEAST + 1:
        return None
    u, force = curve.u_mm, curve.force_N
    origin = float(u[near[0]])
    places = range(start + _LEAST, stop - _LEAST)
    pairs = [(_fit(u, force, start, c, origin), _fit(u, force, c + 1, stop, origin)) for c in places]
    best = int(np.argmin([before.squares + ahead.squares for before, ahead in pairs]))
    before, ahead = pairs[best]
    turn = before.slope - ahead.slope
    if turn == 0:
        return None
    shift = (ahead.level - before.level) / turn
    noise = float(curve.noise_std_N[places[best]])
    ends = [2 * noise / np.sqrt(line.points) for line in (before, ahead)]  # of a line at its end
    force_std = float(np.hypot(ahead.slope * ends[0], before.slope * ends[1]) / abs(turn))
    u_std = float(max(np.hypot(*ends) / abs(turn), 0.1 * curve.step_mm))
    if abs(origin + shift - u[places[best]]) > 1.5 * curve.step_mm + 2 * u_std:
        return None
    return Corner(origin + float(shift), before.level + before.slope * float(shift), u_std, force_std)


def _at_start(curve: Curve, k: int, last: int) -> Corner | None:
    """The line ahead of an extreme at the curve's start, carried back to where its first step began."""
    if last - k < _LEAST:
        return None
    u0 = max(float(curve.u_mm[k]) - 0.5 * curve.step_mm, 0.0)
    ahead = _fit(curve.u_mm, curve.force_N, k, k + _LEAST, u0)  # short: softening curves it
    std = 2 * float(curve.noise_std_N[k]) / np.sqrt(ahead.points)
    rest = abs(ahead.slope) * curve.step_mm / np.sqrt(12.0)
    return Corner(u0, ahead.level, curve.step_mm / float(np.sqrt(12.0)), float(np.hypot(std, rest)))


def _fit(u: Floats, force: Floats, start: int, stop: int, origin: float) -> _Line:
    x, y = u[start:stop] - origin, force[start:stop]
    mean_x, mean_y = x.mean(), y.mean()
    slope = float(((x - mean_x) * (y - mean_y)).sum() / ((x - mean_x) ** 2).sum())
    level = float(mean_y - slope * mean_x)
    return _Line(level, slope, float(((y - level - slope * x) ** 2).sum()), x.size)
