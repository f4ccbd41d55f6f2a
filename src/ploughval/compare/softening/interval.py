"""An estimate with the limits between which its profile of chi-square stays low."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_TWO_SIDED = 1.959964
_SIGMA, _NORMAL_95 = 1.0, 3.841459  # quantiles of chi-square of one degree of freedom


@dataclass(frozen=True, slots=True)
class Interval:
    """Estimate with its 68 and 95 % limits; an end of NaN is open within the range that was searched."""

    value: float
    low: float
    high: float
    low95: float
    high95: float

    @property
    def std(self) -> float:
        """Half the 68 % interval; NaN where that is open."""
        return (self.high - self.low) / 2

    def widened(self, std: float) -> "Interval":
        """The interval with another normal uncertainty.

        Parameters
        ----------
        std : float
            Standard uncertainty that is added, in the estimate's unit.

        Returns
        -------
        Interval
        """

        def end(limit: float, times: float) -> float:
            reach = float(np.hypot(limit - self.value, times * std))
            return self.value + reach if limit > self.value else self.value - reach

        sides = (self.low, 1.0), (self.high, 1.0), (self.low95, _TWO_SIDED), (self.high95, _TWO_SIDED)
        return Interval(self.value, *(end(*side) for side in sides))


def limits(x: Floats, chi2: Floats, value: float) -> Interval:
    """Where a profile of chi-square passes its least value by 1 and by 3.84 (Venzon and Moolgavkar 1988).

    Parameters
    ----------
    x : (M,) float
        Values of the parameter, ascending.
    chi2 : (M,) float
        The least chi-square at each.
    value : float
        The estimate.

    Returns
    -------
    Interval
        NaN for an end that lies beyond the values given.
    """
    ends = []
    for level in (_SIGMA, _NORMAL_95):
        inside = np.flatnonzero(chi2 <= chi2.min() + level)
        first, last = int(inside[0]), int(inside[-1])
        for edge, beyond in ((first, first - 1), (last, last + 1)):
            if not 0 <= beyond < len(x):
                ends.append(float("nan"))
                continue
            over = chi2.min() + level
            share = (over - chi2[edge]) / (chi2[beyond] - chi2[edge])
            ends.append(float(x[edge] + share * (x[beyond] - x[edge])))
    return Interval(value, *ends)
