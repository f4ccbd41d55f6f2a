"""Weighted least squares with scatter beyond the stated uncertainties (Paule & Mandel 1982)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


_LEAST_STATED = (
    1e-10  # of the largest value: less is rounding, and would weigh everything else down to nothing
)


def size_of(values: Floats, stated: Floats | None = None) -> float:
    """Largest magnitude among values and uncertainties, taken out before squares are; 1 where all are 0."""
    every = np.abs(values) if stated is None else np.append(np.abs(values), stated[np.isfinite(stated)])
    return float(every.max(initial=0.0)) or 1.0


def are_stated(stated: Floats, size: float) -> bool:
    """Whether every uncertainty is a number that values of this size can be weighted by."""
    return bool(np.all(np.isfinite(stated) & (stated > _LEAST_STATED * size)))


class Fit(NamedTuple):
    """Coefficients (p,), their covariance (p, p) and the weighted sum of squared residuals."""

    coefficients: Floats
    covariance: Floats
    chi2: float


def weighted_fit(design: Floats, values: Floats, variance: Floats) -> Fit:
    """Least squares weighted by the inverse variances.

    Parameters
    ----------
    design : (n, p) float
        Columns of full rank.
    values : (n,) float
        What is fitted.
    variance : (n,) float
        Variances, greater than 0.
    """
    root = 1 / np.sqrt(variance)
    left, right = design * root[:, None], values * root
    # Columns of very different size are brought to one before the normal matrix is inverted.
    size = np.linalg.norm(left, axis=0)
    inverse = np.linalg.inv((left / size).T @ (left / size)) / np.outer(size, size)
    coefficients = inverse @ (left.T @ right)
    residual = right - left @ coefficients
    return Fit(coefficients, inverse, float(residual @ residual))


def excess_variance(design: Floats, values: Floats, stated: Floats, target: float) -> float:
    """Variance that, added to the stated ones, brings the weighted sum of squares to a target.

    With the degrees of freedom as target it is Paule and Mandel's estimate; with quantiles of chi-square it
    is an end of the interval of Viechtbauer (2007), "Q profile" (docs/several-tests.md, Eq. (3)).

    Parameters
    ----------
    design : (n, p) float
        As for :func:`weighted_fit`.
    values : (n,) float
        What is fitted.
    stated : (n,) float
        Standard uncertainties, greater than 0.
    target : float
        Sum of squares aimed at, greater than 0.

    Returns
    -------
    float
        0 where the stated variances are enough.
    """
    variance = stated**2

    def beyond(extra: float) -> float:
        return weighted_fit(design, values, variance + extra).chi2 - target

    if values.size <= design.shape[1] or beyond(0.0) <= 0:
        return 0.0
    from scipy.optimize import brentq

    # The sum falls without end as the variance grows: at the plain sum over the target it is below.
    highest = weighted_fit(design, values, np.ones_like(variance)).chi2 / target
    while beyond(highest) > 0:
        highest *= 2
    return float(brentq(beyond, 0.0, highest, xtol=1e-14 * highest, rtol=1e-12))
