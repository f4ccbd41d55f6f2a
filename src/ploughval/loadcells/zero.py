"""Zero offsets, noise and drift of the two cells from the rows at rest."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_BLOCKS = 10
_COLOURED = (
    2.2  # block means that vary this much more than white noise would (2 % level of 9 degrees of freedom)
)


@dataclass(frozen=True, slots=True, eq=False)
class Zero:
    """Offsets of the (upper, lower) cell over one window, in the unit of the log.

    Attributes
    ----------
    mean, mean_cov : (2,) and (2, 2) float64, unit of the log (squared)
        The offsets and their covariance.
    noise_cov : (2, 2) float64, unit of the log squared
        Covariance of one sample.
    drift, drift_cov : (2,) and (2, 2) float64, unit of the log (squared)
        Change over the window and its covariance.
    rows : int
        Samples of the window.
    middle_s : float, s
        Time that the mean belongs to.
    end_s, span_s : float, s
        End and length of the window.
    """

    mean: Floats
    noise_cov: Floats
    mean_cov: Floats
    drift: Floats
    drift_cov: Floats
    rows: int
    middle_s: float
    end_s: float
    span_s: float

    @property
    def drift_std(self) -> Floats:
        """Standard uncertainty (2,) of the change over the window."""
        return np.asarray(np.sqrt(np.diag(self.drift_cov)))

    @property
    def drifts(self) -> bool:
        """Whether a cell's change over the window is beyond three standard deviations."""
        return bool(np.any(np.abs(self.drift) > 3 * self.drift_std))


def zero_of(time_s: Floats, cells: Floats) -> Zero | None:
    """Zero offsets from rows at rest.

    Parameters
    ----------
    time_s : (N,) float, s
        Strictly increasing.
    cells : (2, N) float, unit of the log
        Upper and lower reading; columns with NaN are left out.

    Returns
    -------
    Zero or None
        None with fewer than 3 finite rows. The offsets' covariance follows the scatter of the means of 10
        blocks where that shows that the noise is not white.
    """
    good = np.isfinite(cells).all(axis=0) & np.isfinite(time_s)
    count = int(good.sum())
    if count < 3:
        return None
    middle = float(time_s[good].mean())
    t, m = time_s[good] - middle, cells[:, good]
    mean = m.mean(axis=1)
    centred = m - mean[:, None]
    slope = centred @ t / (t @ t)
    residual = centred - slope[:, None] * t
    noise_cov = residual @ residual.T / (count - 2)
    mean_cov = noise_cov / count
    span = float(t[-1] - t[0])
    drift_cov = noise_cov * (span**2 / (t @ t))
    if count >= 10 * _BLOCKS:
        blocks = np.stack([part.mean(axis=1) for part in np.array_split(residual, _BLOCKS, axis=1)], axis=1)
        block_cov = np.cov(blocks) / _BLOCKS
        ratio = np.diag(block_cov) / np.maximum(np.diag(mean_cov), np.finfo(float).tiny)
        if ratio.max() > _COLOURED:
            mean_cov = block_cov
            wider = np.sqrt(np.maximum(ratio, 1.0))
            drift_cov = drift_cov * np.outer(wider, wider)
    return Zero(
        mean, noise_cov, mean_cov, slope * span, drift_cov, count, middle, middle + float(t[-1]), span
    )


def unknown_zero(cells: Floats) -> Zero:
    """Offsets of 0 without uncertainty for a record (2, N) without rest; noise from second differences."""
    second = np.diff(cells, 2, axis=1)
    second = second[:, np.isfinite(second).all(axis=0)]
    noise = np.cov(second) / 6.0 if second.shape[1] > 1 else np.zeros((2, 2))
    none = np.zeros(2)
    return Zero(none, np.asarray(noise), np.zeros((2, 2)), none, np.zeros((2, 2)), 0, 0.0, 0.0, 0.0)
