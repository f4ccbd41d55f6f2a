"""What a reading of the two cells means: bending moments as a combination of powers of the readings."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Powers = tuple[tuple[int, int], ...]

OWN: Powers = ((1, 0), (0, 1))
"""Straight in the reading of the upper and of the lower cell."""
CURVED: Powers = (*OWN, (2, 0), (0, 2))
"""Of second order in each cell's own reading."""


@dataclass(frozen=True, slots=True, eq=False)
class CellResponse:
    """Moments M = C f(r) of readings r less their zero, f being products of powers of r.

    docs/theory-loadcells.md, Eq. (2); docs/theory-loadcell-calibration.md, Eq. (2).

    Attributes
    ----------
    powers : tuple of (int, int)
        Exponents of the (upper, lower) reading in each of the K features.
    coefficients : (2, K) float, N m per unit of the log to the feature's power
        C: rows give the upper and the lower moment.
    cov : (2, K, 2, K) float, units of the coefficients squared
        Covariance of the coefficients at the stated geometry.
    by_spacing, by_lower_to_tip : (2, K) float
        Change of the coefficients for a millimetre more of spacing or lower_to_tip; zero for constants that
        were given, while those found from known forces at known arms follow the geometry.
    dof : float
        Degrees of freedom behind ``cov``; inf where it is known.
    """

    powers: Powers
    coefficients: Floats
    cov: Floats
    by_spacing: Floats
    by_lower_to_tip: Floats
    dof: float = np.inf

    @classmethod
    def constant(cls, gain: Floats, std: Floats) -> "CellResponse":
        """Constants (2,) of the (upper, lower) cell, N m per unit, with their standard uncertainties (2,).

        >>> two = CellResponse.constant(np.array([2.0, 3.0]), np.zeros(2))
        >>> two.moments(np.array([[1.0], [1.0]])).tolist()
        [[2.0], [3.0]]
        """
        cov = np.zeros((2, 2, 2, 2))
        cov[0, 0, 0, 0], cov[1, 1, 1, 1] = np.asarray(std, float) ** 2
        none = np.zeros((2, 2))
        return cls(OWN, np.diag(np.asarray(gain, float)), cov, none, none)

    def features(self, readings: Floats) -> Floats:
        """Products of powers (K, N) of readings (2, N) less their zero."""
        if self.powers == OWN:
            return readings  # an hour at 1 kHz is 58 MB: no copy
        upper, lower = readings
        return np.stack(
            [upper**i * lower**j if (i and j) else (upper**i if i else lower**j) for i, j in self.powers]
        )

    def moments(self, readings: Floats) -> Floats:
        """Moments (2, N), N m, of readings (2, N) less their zero."""
        return np.asarray(self.coefficients @ self.features(readings))

    def slopes(self, readings: Floats) -> Floats:
        """Derivative (2, 2) of the moments by the readings at one pair of readings (2,)."""
        upper, lower = (float(r) for r in readings)
        by_upper = [i * upper ** (i - 1) * lower**j if i else 0.0 for i, j in self.powers]
        by_lower = [j * lower ** (j - 1) * upper**i if j else 0.0 for i, j in self.powers]
        return np.asarray(self.coefficients @ np.array([by_upper, by_lower]).T)
