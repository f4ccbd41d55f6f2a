"""How far a band has softened after a slip, averaged over the slip of a row.

docs/theory-mobilised.md, section 4.
"""

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Law(StrEnum):
    """Shape of the fall of friction from peak to residual."""

    LINEAR = "linear"
    EXPONENTIAL = "exponential"


def softened(low_mm: Floats, high_mm: Floats, length_mm: float, law: Law = Law.LINEAR) -> Floats:
    """Share of the way from peak to residual, the mean over slips from low to high; 0 where slip is negative.

    Parameters
    ----------
    low_mm, high_mm : (N,) float, mm
        Slip at either end of a row.
    length_mm : float, mm
        Mobilization length; of the exponential law the slip that leaves 1/e.
    law : Law
        Linear: min(slip / length, 1), docs/theory-model.md, Eq. (9).

    Returns
    -------
    (N,) float

    >>> softened(np.array([0.0, 1.0]), np.array([1.0, 3.0]), 2.0).tolist()
    [0.25, 0.875]
    """

    def gathered(slip: Floats) -> Floats:
        s = np.maximum(slip, 0.0)
        if law is Law.EXPONENTIAL:
            return np.asarray(s + length_mm * np.expm1(-s / length_mm))
        return np.where(s < length_mm, s**2 / (2 * length_mm), s - length_mm / 2)

    return np.asarray((gathered(high_mm) - gathered(low_mm)) / np.maximum(high_mm - low_mm, 1e-12))


def ahead(low_mm: Floats, high_mm: Floats, origin_mm: float) -> Floats:
    """How far rows lie before an origin, the mean over each row; 0 behind it.

    docs/theory-mobilised.md, Eq. (8).

    Parameters
    ----------
    low_mm, high_mm : (N,) float, mm
        Travel at either end of a row.
    origin_mm : float, mm
        The origin.

    Returns
    -------
    (N,) float, mm
    """

    def gathered(u: Floats) -> Floats:
        return np.asarray(np.minimum(u - origin_mm, 0.0) ** 2 / 2)

    return np.asarray((gathered(low_mm) - gathered(high_mm)) / np.maximum(high_mm - low_mm, 1e-12))
