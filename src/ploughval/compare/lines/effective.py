"""How many independent points a line has: neighbours share errors."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def effective_number(residuals: Floats) -> float:
    """Number of independent values that have a mean as uncertain as so many correlated ones.

    n / (1 + 2 sum rho_k), summed until the first autocorrelation that is not positive (Geyer 1992, initial
    positive sequence, for single lags; docs/theory-comparison-lines.md, Eq. (6)).

    Parameters
    ----------
    residuals : (N,) float
        In order along a line, all finite.

    Returns
    -------
    float
        From 1 to N; 0 without values.
    """
    count = residuals.size
    if count < 3:
        return float(min(count, 1))
    centred = residuals - residuals.mean()
    covariance = np.correlate(centred, centred, mode="full")[count - 1 :]
    if covariance[0] <= 1e-24 * float(np.sum(residuals**2)):
        return 1.0  # all alike: what moves one moves all
    rho = covariance[1:] / covariance[0]
    ends = np.flatnonzero(rho <= 0.0)
    positive = rho[: ends[0]] if ends.size else rho
    return float(np.clip(count / (1.0 + 2.0 * positive.sum()), 1.0, count))
