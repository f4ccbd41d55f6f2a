"""The least step of a log, and the doubt that it leaves (JCGM 100:2008, F.2.2.1)."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.zero import Zero

Floats = NDArray[np.float64]
_DITHERED = 0.5  # noise of this many steps makes means finer than a step


def least_step(readings: Floats) -> Floats:
    """Least difference (2,) between neighbouring readings (2, N) that differ; 0 where none do.

    >>> least_step(np.array([[0.0, 0.5, 0.5, 1.5], [1.0, 1.0, np.nan, 1.0]])).tolist()
    [0.5, 0.0]
    """
    steps = np.abs(np.diff(readings, axis=1))
    steps[~(steps > 0)] = np.inf
    least = steps.min(axis=1, initial=np.inf)
    return np.asarray(np.where(np.isfinite(least), least, 0.0))


def with_resolution(zero: Zero, step: Floats) -> Zero:
    """Zeros with the doubt that steps (2,) of the log leave where noise is too small to show it.

    A reading is then anywhere within its step: variance step^2 / 12 of one sample, and of the offset itself
    where noise does not spread the readings over several steps.
    """
    doubt = step**2 / 12
    noise = np.diag(zero.noise_cov)
    blind = np.where(noise < (_DITHERED * step) ** 2, doubt, 0.0)
    return replace(
        zero,
        noise_cov=zero.noise_cov + np.diag(np.maximum(doubt - noise, 0.0)),
        mean_cov=zero.mean_cov + np.diag(blind),
    )
