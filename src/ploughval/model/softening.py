"""Friction on a band falling with the slip gathered on it (Kashizadeh et al. 2014, section 2.5).

docs/theory-model.md, Eq. (9).
"""

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray


def mobilised_friction_deg(
    slip_mm: ArrayLike, peak_deg: float, residual_deg: float, length_mm: float
) -> NDArray[np.float64]:
    """Friction angle after a slip: linear from peak to residual over the mobilization length.

    Parameters
    ----------
    slip_mm : array of float, mm
        Slip gathered on the band, not negative.
    peak_deg, residual_deg : float, degrees
        Friction angles of fresh sand and of a fully sheared band.
    length_mm : float, mm
        Mobilization length; 0: any slip at all brings the band to the residual angle.

    Returns
    -------
    array of float, degrees
        Same shape as ``slip_mm``.

    >>> mobilised_friction_deg([0.0, 0.5, 2.0], 50.0, 32.0, 1.0).tolist()
    [50.0, 41.0, 32.0]
    """
    slip = np.asarray(slip_mm, float)
    share = np.minimum(slip / length_mm, 1.0) if length_mm > 0 else (slip > 0).astype(float)
    return np.asarray(peak_deg - (peak_deg - residual_deg) * share)


@njit(cache=True, nogil=True)
def tan_mobilised(slip: float, peak: float, residual: float, length: float) -> float:
    """Tangent of the mobilised friction angle; angles in radians, slip and length in mm."""
    if slip >= length:
        return math.tan(residual) if slip > 0.0 else math.tan(peak)
    return math.tan(peak - (peak - residual) * slip / length)
