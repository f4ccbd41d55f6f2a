"""A straight line through values of several tests, with scatter beyond their stated uncertainties."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

from ploughval.compare.several.excess import are_stated, excess_variance, size_of, weighted_fit

Floats = NDArray[np.float64]
NAN = float("nan")
_TAIL = 0.025


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line ``level + slope (x - centre)`` through points that scatter beyond what is stated.

    Attributes
    ----------
    count : int
        Points.
    centre, level : float
        Mean of x, and the line's value there.
    slope, slope_low, slope_high : float
        With its 95 % interval (Student; normal with two points).
    excess_std : float
        Scatter about the line beyond the stated uncertainties.
    """

    count: int
    centre: float
    level: float
    slope: float
    slope_low: float
    slope_high: float
    excess_std: float

    def at(self, x: Floats) -> Floats:
        """Values of the line."""
        return np.asarray(self.level + self.slope * (np.asarray(x) - self.centre))


def fit_line(x: Floats, y: Floats, std: Floats | None) -> Line | None:
    """Fit a straight line.

    Parameters
    ----------
    x : (n,) float, any unit
        Known places.
    y : (n,) float, any unit
        Values.
    std : (n,) float or None, unit of y
        Their standard uncertainties; None, or with one that is NaN or 0: all weigh the same.

    Returns
    -------
    Line or None
        None with fewer than two places. Two points have an interval only by their stated uncertainties.
    """
    if np.unique(x).size < 2:
        return None
    n, size = x.size, size_of(y, std)
    y = y / size
    known = std is not None and are_stated(std, size)
    centre = float(np.mean(x))
    design = np.column_stack([np.ones(n), x - centre])
    if known:
        assert std is not None
        std = std / size
        extra = excess_variance(design, y, std, float(n - 2)) if n > 2 else 0.0
        fit = weighted_fit(design, y, std**2 + extra)
        slope_std = float(np.sqrt(fit.covariance[1, 1]))
    else:
        extra = NAN
        fit = weighted_fit(design, y, np.ones(n))
        scattered = n > 2 and float(np.ptp(y)) > 0  # values all alike do not show how exact they are
        slope_std = float(np.sqrt(fit.covariance[1, 1] * fit.chi2 / (n - 2))) if scattered else NAN
    factor = float(stdtrit(n - 2, 1 - _TAIL)) if n > 2 else float(ndtri(1 - _TAIL))
    slope, reach = float(fit.coefficients[1]) * size, factor * slope_std * size
    level = float(fit.coefficients[0]) * size
    return Line(n, centre, level, slope, slope - reach, slope + reach, float(np.sqrt(extra)) * size)
