"""Area validation metric: the area between two cumulative distributions (Ferson et al. 2008, eq. 4)."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

Floats = NDArray[np.float64]
_CERTAIN = 1e-9  # an uncertainty below this share of the values is none: both distributions are steps


def area_metric(experiment: Floats, experiment_std: Floats, drawn: Floats) -> Floats:
    """Area between a normal distribution and that of the model's draws, at every place of a history.

    The measured value is known as a normal distribution, the model's as the steps of its draws (one step
    without uncertain inputs). The area has the values' unit. It is 0 where both distributions are the same,
    and the distance of two values that are certain. The parts have a closed form
    (docs/theory-comparison.md, Eq. (12)).

    Parameters
    ----------
    experiment : (M,) float
        Measured values.
    experiment_std : (M,) float
        Their standard uncertainties.
    drawn : (N, M) float
        One row a draw; NaN where a draw has no such value.

    Returns
    -------
    (M,) float
        NaN where the measurement, its uncertainty or every draw is missing.
    """
    area = np.full(experiment.shape, np.nan)
    count = np.isfinite(drawn).sum(axis=0)
    scale = np.maximum(np.abs(experiment), np.finfo(float).tiny)
    std = np.maximum(experiment_std, _CERTAIN * scale)
    for n in np.unique(count[count > 0]):
        here = (count == n) & np.isfinite(experiment) & np.isfinite(std)
        steps = np.sort(drawn[:, here], axis=0)[:n]  # NaN is sorted last
        area[here] = std[here] * _standard_area((steps - experiment[here]) / std[here])
    return area


def _standard_area(z: Floats) -> Floats:
    """Area between the standard normal distribution and steps at z (n, M), each column in rising order."""
    n = len(z)
    level = (np.arange(1, n) / n)[:, None]
    tails = _integral(z[0]) + _integral(-z[-1])
    if n == 1:
        return np.asarray(tails)
    cross = np.clip(ndtri(level), z[:-1], z[1:])  # the normal crosses the step's level here, or not inside
    low, middle, high = (_integral(x) - level * x for x in (z[:-1], cross, z[1:]))
    return np.asarray(tails + (np.abs(middle - low) + np.abs(high - middle)).sum(axis=0))


def _integral(x: Floats) -> Floats:
    """Integral of the standard normal distribution function up to x: x Phi(x) + phi(x)."""
    return np.asarray(x * ndtr(x) + np.exp(-0.5 * x**2) / np.sqrt(2 * np.pi))
