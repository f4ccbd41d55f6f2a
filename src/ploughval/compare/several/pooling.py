"""One quantity in several tests: scatter, what the stated uncertainties explain of it, and the pooled value.

ISO 5725-2 (repeatability standard deviation, Grubbs' test), Birge (1932), Paule & Mandel (1982),
Viechtbauer (2007), Knapp & Hartung (2003).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, stdtrit

from ploughval.compare.several.excess import are_stated, excess_variance, size_of, weighted_fit

Floats = NDArray[np.float64]
Verdict = Literal["explained", "more", "less", "unknown"]
NAN = float("nan")
_TAIL = 0.025  # either end of a 95 % interval
_OUTLIER = 0.01  # level of Grubbs' test at which a value is called an outlier


@dataclass(frozen=True, slots=True)
class Pooled:
    """What several values of one quantity say together; NaN where it cannot be said.

    Attributes
    ----------
    count : int
    mean, std : float
        Plain mean and standard deviation between tests.
    std_low, std_high : float
        95 % interval of the standard deviation (chi-square, normal scatter).
    stated_std : float
        Root mean square of the stated standard uncertainties.
    birge : float
        Root of chi-square over its degrees of freedom, from the stated uncertainties alone.
    excess_std, excess_low, excess_high : float
        Standard deviation between tests beyond the stated uncertainties, and its 95 % interval.
    pooled, pooled_low, pooled_high : float
        Mean weighted by stated and excess variances, and its 95 % interval (Student), by scatter alone:
        what of the stated uncertainty is common to all tests does not show in it.
    verdict : {"explained", "more", "less", "unknown"}
        Whether the scatter is what the stated uncertainties let expect, at 95 %.
    outlier : int
        Place of a value that is an outlier at 1 % (Grubbs); -1: none.
    """

    count: int
    mean: float = NAN
    std: float = NAN
    std_low: float = NAN
    std_high: float = NAN
    stated_std: float = NAN
    birge: float = NAN
    excess_std: float = NAN
    excess_low: float = NAN
    excess_high: float = NAN
    pooled: float = NAN
    pooled_low: float = NAN
    pooled_high: float = NAN
    verdict: Verdict = "unknown"
    outlier: int = -1

    @property
    def half_width(self) -> float:
        """Half the pooled value's interval."""
        return (self.pooled_high - self.pooled_low) / 2


def pool(values: Sequence[float], stds: Sequence[float]) -> Pooled:
    """Take several values of one quantity together.

    Parameters
    ----------
    values : sequence of float
        One a test, finite.
    stds : sequence of float
        Standard uncertainties. Where one is NaN or 0 nothing is weighted, nor said of what they explain.

    Returns
    -------
    Pooled
        With fewer than two values the mean alone.
    """
    x, u = np.asarray(values, dtype=np.float64), np.asarray(stds, dtype=np.float64)
    if x.size < 2:
        alone = float(x[0]) if x.size else NAN
        return Pooled(x.size, mean=alone, pooled=alone)
    size = size_of(x, u)
    one = _weighted(x / size, u / size) if are_stated(u, size) else _plain(x / size)
    lengths = {name: getattr(one, name) * size for name in _WITH_UNIT}
    return replace(one, **lengths)


_WITH_UNIT = (
    "mean", "std", "std_low", "std_high", "stated_std", "excess_std", "excess_low", "excess_high", "pooled",
    "pooled_low", "pooled_high",
)  # fmt: skip


def _plain(x: Floats) -> Pooled:
    """Mean, scatter and Student's interval of the mean."""
    mean, std = float(np.mean(x)), float(np.std(x, ddof=1))
    # Values that are all alike (counts) show no scatter, but do not show how small it is.
    low, high = std_interval(std, x.size - 1) if std > 0 else (NAN, NAN)
    reach = float(stdtrit(x.size - 1, 1 - _TAIL)) * std / np.sqrt(x.size) if std > 0 else NAN
    return Pooled(
        x.size, mean, std, low, high, pooled=mean, pooled_low=mean - reach, pooled_high=mean + reach,
        outlier=_outlier(x, mean, std),
    )  # fmt: skip


def _weighted(x: Floats, u: Floats) -> Pooled:
    """The same and, with stated uncertainties, what they explain and the weighted mean."""
    chi2, excess = _against_stated(x, u)
    fit = weighted_fit(np.ones((x.size, 1)), x, u**2 + excess[1])
    centre = float(fit.coefficients[0])
    # With the excess in the weights the factor of Knapp and Hartung is 1, or less where there is no excess.
    reach = float(stdtrit(x.size - 1, 1 - _TAIL) * np.sqrt(fit.covariance[0, 0]))
    low, middle, high = (float(np.sqrt(variance)) for variance in excess)
    return replace(
        _plain(x), stated_std=float(np.sqrt(np.mean(u**2))), birge=float(np.sqrt(chi2 / (x.size - 1))),
        excess_low=low, excess_std=middle, excess_high=high,
        pooled=centre, pooled_low=centre - reach, pooled_high=centre + reach,
        verdict=_verdict(chi2, x.size - 1),
    )  # fmt: skip


def std_interval(std: float, dof: int) -> tuple[float, float]:
    """95 % interval of a standard deviation with its degrees of freedom, for normal scatter.

    docs/several-tests.md, Eq. (1).

    >>> [round(end, 3) for end in std_interval(1.0, 9)]
    [0.688, 1.826]
    """
    if dof < 1:
        return NAN, NAN
    return std * float(np.sqrt(dof / chdtri(dof, _TAIL))), std * float(np.sqrt(dof / chdtri(dof, 1 - _TAIL)))


def _against_stated(x: Floats, u: Floats) -> tuple[float, tuple[float, float, float]]:
    """Chi-square about the weighted mean; excess variance: low end, estimate, high end.

    docs/several-tests.md, Eq. (2).
    """
    ones, dof = np.ones((x.size, 1)), x.size - 1
    targets = (float(chdtri(dof, _TAIL)), float(dof), float(chdtri(dof, 1 - _TAIL)))
    low, middle, high = (excess_variance(ones, x, u, target) for target in targets)
    return weighted_fit(ones, x, u**2).chi2, (low, middle, high)


def _verdict(chi2: float, dof: int) -> Verdict:
    if chi2 > chdtri(dof, _TAIL):
        return "more"
    return "less" if chi2 < chdtri(dof, 1 - _TAIL) else "explained"


def _outlier(x: Floats, mean: float, std: float) -> int:
    """Grubbs' test for one value (ISO 5725-2), two-sided."""
    n = x.size
    if n < 3 or std <= 0:
        return -1
    farthest = int(np.argmax(np.abs(x - mean)))
    t2 = float(stdtrit(n - 2, 1 - _OUTLIER / (2 * n))) ** 2
    critical = (n - 1) / np.sqrt(n) * np.sqrt(t2 / (n - 2 + t2))
    return farthest if abs(x[farthest] - mean) / std > critical else -1
