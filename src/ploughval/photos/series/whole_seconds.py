"""Times of photographs from a clock that tells whole seconds only.

A stamp s means that the photograph was taken in [s, s + 1). Where the photographs were taken at a constant
interval, which each keeps to a twentieth, all stamps together confine it, and the start with it: the times
are the middle of what they leave open. The standard uncertainty is that of rectangular distributions, half
their widths over the root of 3 (JCGM 100:2008, 4.3.7).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STAMP_STD_S = 1 / np.sqrt(12)
"""Standard uncertainty of one stamp of whole seconds, s."""
LEAST = 5
"""Photographs that it takes to say that an interval is constant."""
JITTER = 0.05
"""How far a photograph may lie off a constant interval, in intervals: an assumption, no finding."""
_PLACES = 17
_SECOND = 1.0 - 1e-9  # the second is open at its end


@dataclass(frozen=True, slots=True)
class SteadyTimes:
    """Times (N,), s, their standard uncertainties (N,), s, the interval and its bounds, s."""

    time_s: Floats
    std_s: Floats
    interval_s: float
    least_s: float
    most_s: float


def steady_times(stamp_s: Floats, number: NDArray[np.intp]) -> SteadyTimes | None:
    """Times at a constant interval that agree with every stamp.

    Parameters
    ----------
    stamp_s : (N,) float
        Whole seconds, s.
    number : (N,) int
        Number of each photograph in the series, increasing; numbers that were lost may be left out.

    Returns
    -------
    SteadyTimes or None
        None where no constant interval agrees, or fewer than `LEAST` photographs could tell.
    """
    if len(stamp_s) < LEAST:
        return None
    base, k = stamp_s[0], number.astype(float)
    # start + (k - JITTER) interval < s + 1 and start + (k + JITTER) interval >= s; the interval is positive
    walls = np.vstack(
        [
            np.column_stack([np.ones_like(k), k - JITTER]),
            np.column_stack([-np.ones_like(k), -k - JITTER]),
        ]
    )
    limits = np.concatenate([stamp_s - base + _SECOND, base - stamp_s])
    interval = _reach(np.array([0.0, 1.0]), walls, limits)
    if interval is None:
        return None
    # the bounds are convex and concave in k: between the places a chord is on the safe side
    places = np.unique(np.linspace(k[0], k[-1], _PLACES))
    bounds = [_reach(np.array([1.0, place]), walls, limits) for place in places]
    low, high = np.array([b for b in bounds if b is not None]).T
    low, high = np.interp(k, places, low), np.interp(k, places, high)
    middle = (low + high) / 2
    usual = float((middle[-1] - middle[0]) / (k[-1] - k[0]))
    return SteadyTimes(
        time_s=base + middle,
        std_s=np.hypot((high - low) / 2, JITTER * usual) / np.sqrt(3),
        interval_s=usual,
        least_s=interval[0],
        most_s=interval[1],
    )


def _reach(direction: Floats, walls: Floats, limits: Floats) -> tuple[float, float] | None:
    """Least and greatest of a linear function of start and interval within the walls; None: no room."""
    from scipy.optimize import linprog

    ends = [
        linprog(sign * direction, A_ub=walls, b_ub=limits, bounds=[(None, None), (0, None)], method="highs")
        for sign in (1.0, -1.0)
    ]
    return (ends[0].fun, -ends[1].fun) if all(end.status == 0 for end in ends) else None
