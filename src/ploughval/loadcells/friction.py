"""Friction of blade and box per cell, from runs without sand (JCGM 100:2008, 4.2 and G.3)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.motion import find_motion
from ploughval.loadcells.zero import Zero, zero_of

Floats = NDArray[np.float64]
_BLOCKS = 20


@dataclass(frozen=True, slots=True)
class EmptyRun:
    """One run without sand: mean of (upper, lower) while moving, less its zeros, and its scatter."""

    mean: Floats
    variation_cov: Floats  # along the travel, noise taken off
    slow_cov: Floats  # of the means of 20 parts of the travel
    rows: int
    own_zero: bool


@dataclass(frozen=True, slots=True)
class Friction:
    """Friction to be taken off: mean (2,), covariance of one further run, variation along the travel."""

    mean: Floats
    cov: Floats
    dof: float  # degrees of freedom behind ``cov``
    variation_cov: Floats
    runs: int


def empty_run(time_s: Floats, displacement_mm: Floats, cells: Floats, zero: Zero) -> EmptyRun | None:
    """Friction during the steady travel of one run.

    Parameters
    ----------
    time_s : (N,) float, s
        Strictly increasing.
    displacement_mm : (N,) float, mm
        NaN where not measured.
    cells : (2, N) float
        Upper and lower moment, in any one unit.
    zero : Zero
        Offsets of the test, used where the run holds no rest before its motion.

    Returns
    -------
    EmptyRun or None
        None where the run shows no motion with finite moments.
    """
    motion = find_motion(displacement_mm)
    if motion is None:
        return None
    own = zero_of(time_s[: motion.rest_end], cells[:, : motion.rest_end])
    moving = cells[:, motion.steady_start : motion.steady_end]
    moving = moving[:, np.isfinite(moving).all(axis=0)]
    if moving.shape[1] < 3:
        return None
    used = own or zero
    parts = np.array_split(moving, min(_BLOCKS, moving.shape[1]), axis=1)
    return EmptyRun(
        moving.mean(axis=1) - used.mean,
        _positive(np.cov(moving) - used.noise_cov),
        np.cov(np.stack([part.mean(axis=1) for part in parts], axis=1)),
        moving.shape[1],
        own is not None,
    )


def mean_friction(runs: Sequence[EmptyRun]) -> Friction:
    """Mean of the runs' means, with the covariance that a further run has about it.

    The spread S between n runs gives S (1 + 1/n), the test being one more run, with n - 1 degrees of freedom.
    With a single run the variation along its own travel stands in.
    """
    means = np.stack([run.mean for run in runs], axis=1)
    count = len(runs)
    cov = np.cov(means) * (1 + 1 / count) if count > 1 else runs[0].slow_cov
    dof = count - 1.0 if count > 1 else np.inf
    variation = np.mean([run.variation_cov for run in runs], axis=0)
    return Friction(means.mean(axis=1), cov, dof, variation, count)


def _positive(cov: Floats) -> Floats:
    """The nearest covariance without negative variances."""
    values, vectors = np.linalg.eigh(cov)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)
