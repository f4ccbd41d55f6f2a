"""When the blade stands still within its travel: friction there is not that of the travel."""

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.motion import Motion

_LEAST_ROWS = 20
_LEAST_SHARE = 0.01  # of the rows of the travel; stick and slip is shorter
_NOISES = 20.0  # the blade would have travelled as many standard deviations of the displacement
_STANDS = 0.25  # of the mean advance that a pause stays below
_BLOCKS = 20  # means of a stretch at rest that are compared
_RISES = 0.1  # of the greatest force


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


def rise_standing(force_N: NDArray[np.float64], still: NDArray[np.bool_]) -> tuple[int, float] | None:
    """Where the force rises though the displacement stands still: sand before a blade at rest lets go.

    Parameters
    ----------
    force_N : (N,) float, N
        NaN where it could not be had.
    still : (N,) bool
        Rows after the onset of motion at which the displacement stands still.

    Returns
    -------
    (int, float) or None
        First row of the stretch with the greatest rise, and that rise, N: above ten standard deviations of
        the means that are compared, and a tenth of the greatest force. None: no such stretch.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    found = None
    most = _RISES * float(np.nanmax(np.abs(force_N), initial=0.0))
    for start, end in edges.reshape(-1, 2):
        force = force_N[start:end]
        force = force[np.isfinite(force)]
        rows = force.size // _BLOCKS
        if rows < 2:
            continue
        means = force[: rows * _BLOCKS].reshape(_BLOCKS, rows).mean(axis=1)
        noise_N = 1.4826 * float(np.median(np.abs(np.diff(force)))) / np.sqrt(2.0)
        rise = float(np.max(means - np.minimum.accumulate(means)))
        if rise > max(most, 10.0 * noise_N / np.sqrt(rows)):
            found, most = (int(start), rise), rise
    return found
