"""Smoothing without a shift in time, where it is asked for, and what it takes off the peaks."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.covariance import positive

Floats = NDArray[np.float64]
_REACH = 4.0  # standard deviations to which the kernel is summed
_LEAST_ROWS = 0.5  # a kernel of fewer rows does not smooth
_LOST_NOISE = (16 / 9) * 0.470
"""Variance of white noise in the estimated loss, in shares of what smoothing leaves: kernels of width s and
s / 2 leave (3 - 2 sqrt(8 / 5)) of it in their difference.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """Readings (2, N) after smoothing, and what that costs.

    Attributes
    ----------
    readings : (2, N) float, unit of the log
        NaN where the reading itself was NaN.
    noise_share : float
        Variance of white noise that is left, as a share.
    lost : (2, N) float
        Estimate of what smoothing took off the readings: curvature times the kernel's variance.
    """

    readings: Floats
    noise_share: float
    lost: Floats

    def lost_cov(self, moving: NDArray[np.bool_], noise_cov: Floats) -> Floats:
        """Mean square (2, 2) of the loss over rows (N,), less what noise (2, 2) of one sample gives.

        The cells lose together: most of it is common to both and leaves the force a small part.
        """
        lost = self.lost[:, moving & np.isfinite(self.lost).all(axis=0)]
        if lost.shape[1] == 0:
            return np.zeros((2, 2))
        return positive(lost @ lost.T / lost.shape[1] - _LOST_NOISE * self.noise_share * noise_cov)

    def lost_std(self, gradient: Floats, noise_cov: Floats) -> float:
        """Standard deviation that noise (2, 2) of one sample gives the loss of a result of slopes (2,)."""
        return float(np.sqrt(_LOST_NOISE * self.noise_share * (gradient @ noise_cov @ gradient)))

    def lost_weight(self, moving: NDArray[np.bool_], noise_cov: Floats) -> Floats:
        """Share (N,) of ``lost_cov`` that a row has: large at peaks and steps, of mean 1 over rows (N,)."""
        noise = _LOST_NOISE * self.noise_share * float(np.trace(noise_cov))
        square = np.maximum((self.lost**2).sum(axis=0) - noise, 0.0)
        square = np.where(moving & np.isfinite(square), square, 0.0)
        total = float(square.sum())
        rows = int((moving & np.isfinite(self.lost).all(axis=0)).sum())
        return np.asarray(square * (rows / total)) if total > 0 else square


def unsmoothed(readings: Floats) -> Smoothed:
    """Readings as they are."""
    return Smoothed(readings, 1.0, np.zeros_like(readings))


def smooth(time_s: Floats, readings: Floats, bandwidth_Hz: float) -> Smoothed:
    """Smooth two readings with a Gaussian kernel, symmetric in time.

    Rows are put on a regular grid of the median step, so that irregular sampling, gaps and missing values
    weigh as they should (normalised convolution; Knutsson and Westin, 1993). The loss is estimated from a
    second pass of twice the bandwidth: it falls with the square of the kernel's width.

    Parameters
    ----------
    time_s : (N,) float, s
        Strictly increasing.
    readings : (2, N) float, unit of the log
        NaN where missing.
    bandwidth_Hz : float
        Frequency at which an oscillation is left with 1 / sqrt(2) of its amplitude.

    Returns
    -------
    Smoothed
    """
    step = float(np.median(np.diff(time_s))) if time_s.size > 1 else 1.0
    rows = kernel_std_s(bandwidth_Hz) / step
    if rows < _LEAST_ROWS:
        return unsmoothed(readings)
    slot = np.rint((time_s - time_s[0]) / step).astype(np.int64)
    once = _convolved(slot, readings, rows)
    wider_band = _convolved(slot, readings, rows / 2)
    lost = (4 / 3) * (wider_band - once)
    return Smoothed(once, float((_kernel(rows, int(slot[-1])) ** 2).sum()), lost)


def kernel_std_s(bandwidth_Hz: float) -> float:
    """Standard deviation of the Gaussian kernel, s: exp(-2 (pi f s)^2) = 1 / sqrt(2) at the bandwidth.

    docs/theory-loadcells.md, Eq. (6).

    >>> round(kernel_std_s(1.0), 4)
    0.1325
    """
    return float(np.sqrt(np.log(2.0) / 4.0) / (np.pi * bandwidth_Hz))


def _kernel(rows: float, most: int) -> Floats:
    """Weights of a Gaussian kernel of so many rows, symmetric, of sum 1; no wider than the record."""
    reach = int(min(np.ceil(_REACH * rows), most))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / rows) ** 2)
    return np.asarray(weights / weights.sum())


def _convolved(slot: NDArray[np.int64], readings: Floats, rows: float) -> Floats:
    """Weighted means about every row, one stretch without a long pause at a time."""
    from scipy.signal import oaconvolve

    kernel = _kernel(rows, int(slot[-1]))
    result = np.full_like(readings, np.nan)
    # a pause longer than the kernel reaches parts the record: no memory is spent on it
    breaks = np.flatnonzero(np.diff(slot) > 2 * _REACH * rows) + 1
    for part in np.split(np.arange(slot.size), breaks):
        at = slot[part] - slot[part[0]]
        for cell, values in enumerate(readings[:, part]):
            good = np.isfinite(values)
            if not good.any():
                continue
            level = values[good].mean()  # taken off before the transform, whose rounding follows the size
            sums = np.stack([np.bincount(at[good], values[good] - level), np.bincount(at[good])])
            total, weight = oaconvolve(sums, kernel[None], mode="full", axes=1)[:, kernel.size // 2 :]
            result[cell, part[good]] = level + total[at[good]] / weight[at[good]]
    return result
