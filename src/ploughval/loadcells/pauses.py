"""When the blade stands still within its travel: friction there is not that of the travel."""

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.motion import Motion

_LEAST_ROWS = 20
_LEAST_SHARE = 0.01  # of the rows of the travel; stick and slip is shorter
_NOISES = 20.0  # the blade would have travelled as many standard deviations of the displacement
_STANDS = 0.25  # of the mean advance that a pause stays below


def standing(u_mm: NDArray[np.float64], motion: Motion, noise_mm: float) -> NDArray[np.bool_]:
    """Rows (N,) of pauses within the travel.

    Parameters
    ----------
    u_mm : (N,) float, mm
        Displacement, finite.
    motion : Motion
        Where the travel is.
    noise_mm : float
        Standard deviation of the displacement at rest.

    Returns
    -------
    (N,) bool
        Rows of every stretch over which the blade makes less than a quarter of its mean advance. A stretch is
        a hundredth of the travel's rows long, 20 rows, or as long as noise asks for; shorter pauses, and all
        those in a travel that noise hides, are not told.
    """
    found = np.zeros(u_mm.size, bool)
    first, end = motion.onset, min(motion.steady_end, u_mm.size)
    row_mm = abs(motion.travel_mm) / max(end - first, 1)
    rows = int(max(_LEAST_ROWS, _LEAST_SHARE * (end - first), np.ceil(_NOISES * noise_mm / row_mm)))
    if 4 * rows > end - first:
        return found
    u = np.sign(motion.travel_mm) * u_mm[first:end]
    still = np.flatnonzero(u[rows:] - u[:-rows] < _STANDS * rows * row_mm)
    edges = np.zeros(u.size + 1, np.int64)
    edges[still] += 1  # each row is there once
    edges[still + rows] -= 1
    found[first:end] = np.cumsum(edges)[:-1] > 0
    return found
