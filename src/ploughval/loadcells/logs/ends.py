"""Whether a log ends while the blade still moves."""

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.motion import find_motion

_STILL_MOVING = 0.5  # part of the steady speed
_LEAST_ROWS = 10
_SHORTEST_S = 1e-9  # rows at one time have no speed
_ROWS = 10_000  # as many are enough to see it


def stops_early(time_s: NDArray[np.float64], displacement_mm: NDArray[np.float64]) -> list[str]:
    """A note where the last rows of a log move at more than half the steady speed.

    Parameters
    ----------
    time_s : (N,) float, s
        In order.
    displacement_mm : (N,) float, mm
        NaN where not measured.

    Returns
    -------
    list of str
        Empty where the blade has come to rest, or never moved.
    """
    thin = max(displacement_mm.size // _ROWS, 1)
    time_s, displacement_mm = time_s[::-thin][::-1], displacement_mm[::-thin][::-1]
    motion = find_motion(displacement_mm)
    if motion is None:
        return []
    good = np.flatnonzero(np.isfinite(displacement_mm))
    last = good[-max(_LEAST_ROWS, good.size // 100) :]
    steady = good[(good >= motion.steady_start) & (good < motion.steady_end)]
    if last.size < _LEAST_ROWS or steady.size < 2 or last[0] <= motion.onset:
        return []
    if not np.ptp(time_s[last]) > _SHORTEST_S:
        return []
    usual = _speed(time_s, displacement_mm, steady[[0, -1]])
    speed = float(np.polyfit(time_s[last] - time_s[last[0]], displacement_mm[last], 1)[0])
    if usual == 0 or speed / usual < _STILL_MOVING:
        return []
    end = last[-1]
    return [
        f"the log ends at {time_s[end]:.7g} s, {displacement_mm[end]:.4g} mm, as the blade still moves "
        f"at {speed:.3g} mm/s: what came after has no force"
    ]


def _speed(time_s: NDArray[np.float64], u: NDArray[np.float64], ends: NDArray[np.intp]) -> float:
    return float((u[ends[1]] - u[ends[0]]) / (time_s[ends[1]] - time_s[ends[0]]))
