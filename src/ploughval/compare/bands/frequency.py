"""How often fresh bands come, model against experiment, from few of them and records that end between two."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, logsumexp

Floats = NDArray[np.float64]
LEAST_SCATTER, MOST_SCATTER = 0.03, 1.0
_SCATTERS = np.geomspace(LEAST_SCATTER, MOST_SCATTER, 29)
_LN_RATIO = np.linspace(-2.5, 2.5, 2001)  # about the estimate from whole spacings


class Spacings(NamedTuple):
    """Travel between successive starts of bands, mm: ``whole`` (N,), and ``last``, which the record cuts."""

    whole: Floats
    last: float


class Ratio(NamedTuple):
    """Frequency of the model over that of the experiment.

    ``value`` NaN where no spacing was seen whole on both sides; ``ln_std`` of its logarithm; ``low`` and
    ``high`` bound it with 95 % probability; ``pairs`` spacings were whole on both sides.
    """

    value: float
    ln_std: float
    low: float
    high: float
    pairs: int

    @property
    def std(self) -> float:
        """``ln_std`` for differences from 1: value - 1 is as many of it as ln(value) is of ``ln_std``.

        A ratio is never below 0, so that ``ln_std`` itself would let one of a third pass for 1.
        """
        ln = float(np.log(self.value))
        return self.ln_std * ((self.value - 1.0) / ln if abs(ln) > 1e-9 else 1.0)


def spacings(starts_mm: Floats, last_mm: float) -> Spacings:
    """Spacings of the bands that a record shows.

    Parameters
    ----------
    starts_mm : (N,) float
        Travel at which the bands start, in order.
    last_mm : float
        Travel at which the record ends.

    Returns
    -------
    Spacings
    """
    known = starts_mm[np.isfinite(starts_mm) & (starts_mm < last_mm)]
    return Spacings(np.diff(known), float(last_mm - known[-1]) if known.size else float("nan"))


def frequency_ratio(experiment: Spacings, model: Spacings) -> Ratio:
    """How much more often the model switches bands than the experiment does.

    docs/theory-comparison-lines.md, Eq. (4).

    The k-th spacing of the experiment over the k-th of the model is taken to scatter log-normally about
    the ratio, by a relative scatter that is unknown between LEAST_SCATTER and MOST_SCATTER (flat in its
    logarithm, like the ratio): so few spacings leave much open. A spacing that a record cuts says that it
    is longer than what was seen of it.

    Parameters
    ----------
    experiment, model : Spacings
        Over the same travel.

    Returns
    -------
    Ratio
    """
    pairs = min(len(experiment.whole), len(model.whole))
    if pairs == 0:
        return Ratio(*(float("nan"),) * 4, pairs=0)
    logs = np.log(experiment.whole[:pairs] / model.whole[:pairs])
    centre = float(logs.mean())
    ratio, scatter = centre + _LN_RATIO[:, None], _SCATTERS[None, :]
    log_posterior = np.zeros((_LN_RATIO.size, _SCATTERS.size))
    for log in logs:
        log_posterior -= 0.5 * ((log - ratio) / scatter) ** 2 + np.log(scatter)
    if len(experiment.whole) < len(model.whole) and experiment.last > 0:
        log_posterior += log_ndtr((ratio - np.log(experiment.last / model.whole[pairs])) / scatter)
    if len(model.whole) < len(experiment.whole) and model.last > 0:
        log_posterior += log_ndtr((np.log(experiment.whole[pairs] / model.last) - ratio) / scatter)
    log_weight = logsumexp(log_posterior, axis=1)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    below = np.cumsum(weight) - 0.5 * weight
    low, median, high = centre + np.interp([0.025, 0.5, 0.975], below, _LN_RATIO)
    mean = float(weight @ _LN_RATIO)
    std = float(np.sqrt(weight @ (_LN_RATIO - mean) ** 2))
    return Ratio(float(np.exp(median)), std, float(np.exp(low)), float(np.exp(high)), pairs)
