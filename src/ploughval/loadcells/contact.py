"""When the blade meets the sand: where the force leaves its noise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_NOISES = 5.0  # a mean of a few rows this many of its standard deviations above rest is a force
_ROWS = 5
_HOLDS = 20  # rows over which the force must stay above


@dataclass(frozen=True, slots=True)
class Contact:
    """First contact: time, travel of the blade until then, and the standard uncertainty of that travel."""

    time_s: float
    u_mm: float
    std_mm: float


def find_contact(
    time_s: Floats, u_mm: Floats, force_N: Floats, *, onset: int, noise_N: float
) -> Contact | None:
    """Find where a compensated force first leaves its noise.

    Parameters
    ----------
    time_s, u_mm, force_N : (N,) float
        Record; NaN rows are passed over. ``u_mm`` counts from rest.
    onset : int
        Row from which the blade moves.
    noise_N : float
        Noise of one sample of the force.

    Returns
    -------
    Contact or None
        None where the force never stays above its noise. The travel is that of the row before the rise; its
        uncertainty is rectangular over the rows that the test of the noise needs (JCGM 100:2008, 4.3.7).
    """
    rows = np.flatnonzero(np.isfinite(force_N) & np.isfinite(u_mm))
    rows = rows[rows >= onset]
    if rows.size < _ROWS:
        return None
    force = force_N[rows]
    means = np.convolve(force, np.full(_ROWS, 1.0 / _ROWS), mode="valid")
    above = means > max(_NOISES * noise_N / np.sqrt(_ROWS), 1e-9 * float(np.abs(force).max()))
    if not above.any():
        return None
    # the first row from which the force stays above for a while
    left = np.minimum(_HOLDS, np.arange(above.size, 0, -1))
    count = np.concatenate([[0], np.cumsum(above)])
    stays = count[np.minimum(np.arange(above.size) + _HOLDS, above.size)] - count[:-1] == left
    if not stays.any():
        return None
    first = int(np.argmax(stays))
    last_quiet = max(first - 1, 0)
    u = u_mm[rows]
    span = float(abs(u[min(first + _ROWS - 1, u.size - 1)] - u[last_quiet]))
    return Contact(float(time_s[rows[first]]), float(u[first]), span / float(np.sqrt(12.0)))
