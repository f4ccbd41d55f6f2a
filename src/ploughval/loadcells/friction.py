"""Friction of blade and box per cell, from runs without sand (JCGM 100:2008, 4.2 and G.3).

All of it is kept in the features of the readings (see :class:`ploughval.loadcells.response.CellResponse`),
in which moments are linear: an error of the calibration then acts on what is left once friction is taken
off.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.covariance import positive
from ploughval.loadcells.response import CellResponse
from ploughval.loadcells.run_log import RunLog
from ploughval.loadcells.zero import Zero, zero_of

Floats = NDArray[np.float64]
BLOCKS = 48
"""Equal parts of a run's travel whose means are kept."""
PIECES = (4, 8, 16, 48)
"""Pieces that a friction varying along the travel may have; each divides BLOCKS."""
PAYS = 0.8
"""Pieces are taken where they leave less than this share of the variance that the mean leaves in a run left
out.
"""
_REACHES = 0.9  # of the longest run's travel
_PARTS = 20


@dataclass(frozen=True, slots=True, eq=False)
class EmptyRun:
    """One run without sand while it moves.

    Attributes
    ----------
    name : str
        File it comes from, for messages.
    features : (K, B) float
        Mean features of the readings less their zero, over B equal parts of the steady travel; NaN where a
        part holds no row.
    u_mm : (B,) float
        Middles of the parts, mm from where motion begins.
    fast_cov : (2, 2) float, (N m)^2
        Covariance within the parts, noise taken off.
    slow_cov : (2, 2) float, (N m)^2
        Covariance of the means of 20 parts of the travel.
    speed_mm_s, travel_mm : float
        Of the blade; signed.
    own_zero : bool
        Whether its zeros come from its own rest.
    """

    name: str
    features: Floats
    u_mm: Floats
    fast_cov: Floats
    slow_cov: Floats
    speed_mm_s: float
    travel_mm: float
    own_zero: bool

    @property
    def mean(self) -> Floats:
        """Mean features (K,) over the travel."""
        return np.asarray(np.nanmean(self.features, axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class Friction:
    """Friction to be taken off.

    Attributes
    ----------
    features : (K, P) float, units of the features
        One column: the mean. Several: against the travel, at ``u_mm``.
    u_mm : (P,) float
        Travel that the columns belong to, mm.
    cov : (2, 2) float, (N m)^2
        Covariance of the level of one further run about the mean of these.
    dof : float
        Degrees of freedom behind ``cov``.
    variation_cov : (2, 2) float, (N m)^2
        What a further run varies along its travel besides.
    runs : int
    reason : str
        Why the mean, or why friction along the travel.
    """

    features: Floats
    u_mm: Floats
    cov: Floats
    dof: float
    variation_cov: Floats
    runs: int
    reason: str

    @property
    def mean(self) -> Floats:
        """Mean features (K, 1) over the travel."""
        return np.asarray(self.features.mean(axis=1, keepdims=True))

    def at(self, u_mm: Floats) -> Floats:
        """Features (K, N) or (K, 1) at travels (N,); beyond the runs' own travel as at its end."""
        if self.features.shape[1] == 1:
            return self.features
        return np.stack([np.interp(u_mm, self.u_mm, row) for row in self.features])


def empty_run(log: RunLog, zero: Zero, response: CellResponse) -> EmptyRun | None:
    """Friction during the steady travel of one run.

    Parameters
    ----------
    log : RunLog
        The run.
    zero : Zero
        Offsets of the test, used where the run holds no rest before its motion.
    response : CellResponse
        Readings to moments.

    Returns
    -------
    EmptyRun or None
        None where the run shows no motion with finite readings.
    """
    motion = log.motion
    if motion is None:
        return None
    own = zero_of(log.time_s[log.resting], log.readings[:, log.resting])
    used = own or zero
    steady = slice(motion.steady_start, motion.steady_end)
    moving = log.readings[:, steady] - used.mean[:, None]
    known = np.isfinite(log.u_mm)
    start = log.u_mm[known & log.resting] if own else log.u_mm[known][:1]
    u = log.u_mm[steady] - (float(np.median(start)) if start.size else np.nan)
    good = np.isfinite(moving).all(axis=0) & np.isfinite(u)
    if good.sum() < 3:
        return None
    moving, u = moving[:, good], u[good]
    slope = response.slopes(moving.mean(axis=1))
    features, middles, fast = _blocks(moving, u, response)
    parts = np.array_split(response.moments(moving), min(_PARTS, moving.shape[1]), axis=1)
    slow = np.cov(np.stack([part.mean(axis=1) for part in parts], axis=1))
    fast = positive(fast - slope @ used.noise_cov @ slope.T)
    return EmptyRun(
        log.name, features, middles, fast, slow, log.speed_mm_s, motion.travel_mm, own is not None
    )


def _blocks(moving: Floats, u: Floats, response: CellResponse) -> tuple[Floats, Floats, Floats]:
    """Mean features (K, B), middles (B,) of equal parts of the travel, covariance of moments within."""
    features, moments = response.features(moving), response.moments(moving)
    low, high = float(u.min()), float(u.max())
    if high <= low:
        return features.mean(axis=1, keepdims=True), np.array([low]), np.cov(moments)
    part = np.minimum(((u - low) / (high - low) * BLOCKS).astype(np.intp), BLOCKS - 1)
    count = np.bincount(part, minlength=BLOCKS)
    with np.errstate(invalid="ignore", divide="ignore"):
        means = np.stack([np.bincount(part, row, BLOCKS) / count for row in features])
        centres = np.stack([np.bincount(part, row, BLOCKS) / count for row in moments])
    rest = moments - centres[:, part]
    freedom = max(u.size - int((count > 0).sum()), 1)
    middles = low + (np.arange(BLOCKS) + 0.5) * (high - low) / BLOCKS
    return means, middles, np.asarray(rest @ rest.T / freedom)


def friction_of(runs: Sequence[EmptyRun], response: CellResponse) -> Friction:
    """Friction from empty runs: their mean, or against the travel where that predicts a run left out better.

    The covariance S of the levels of n runs gives S (1 + 1/n), the test being one more run, with n - 1
    degrees of freedom (docs/theory-loadcells.md, Eq. (3)). With a single run the variation along its own
    travel stands in.

    Parameters
    ----------
    runs : sequence of EmptyRun
        At least one.
    response : CellResponse
        Readings to moments.

    Returns
    -------
    Friction
    """
    count = len(runs)
    means = np.stack([run.mean for run in runs], axis=1)
    level = response.coefficients @ means
    fast = np.mean([run.fast_cov for run in runs], axis=0)
    long = _long(runs)
    u = _common_travel(long)
    mean = means.mean(axis=1, keepdims=True)
    if count == 1:
        reason = "the mean: one run cannot show that friction along the travel repeats"
        return Friction(mean, u[:1], runs[0].slow_cov, np.inf, fast, 1, reason)
    cov = np.cov(level) * (1 + 1 / count)
    if u.size < BLOCKS:
        slow = np.mean([run.slow_cov for run in runs], axis=0)
        reason = "the mean: the runs share too little travel to compare them along it"
        return Friction(mean, u[:1], cov, count - 1.0, fast + slow, count, reason)
    profiles = np.stack([_on(run, u) for run in long])
    left = {pieces: _left_out(profiles, pieces, response) for pieces in (1, *PIECES)}
    size = {pieces: float(np.trace(cov)) for pieces, cov in left.items()}
    best = min(PIECES, key=lambda pieces: size[pieces])
    pays = size[best] < PAYS * size[1]
    taken = best if pays else 1
    features = mean if taken == 1 else _pieces(profiles.mean(axis=0), taken)
    at = u[:1] if taken == 1 else _pieces(u[None], taken)[0]
    met, by_mean = (f"{size[k] ** 0.5:.2g}" for k in (best, 1))
    words = f"the others predict a run left out to {met} N m along its travel, their mean to {by_mean} N m"
    reason = f"against the travel, in {taken} pieces: {words}" if pays else f"the mean: {words}"
    return Friction(features, at, cov, count - 1.0, fast + left[taken], count, reason)


def _long(runs: Sequence[EmptyRun]) -> Sequence[EmptyRun]:
    """Runs that reach as far as the longest, if there are two; a short one would hide what these show."""
    reach = [abs(float(run.u_mm[-1] - run.u_mm[0])) for run in runs]
    far = [run for run, length in zip(runs, reach, strict=True) if length >= _REACHES * max(reach)]
    return far if len(far) > 1 else runs


def _common_travel(runs: Sequence[EmptyRun]) -> Floats:
    """Middles of BLOCKS equal parts of the travel that all runs share; a single one where they share none."""
    low = max(float(run.u_mm[0]) for run in runs)
    high = min(float(run.u_mm[-1]) for run in runs)
    if high <= low or min(run.u_mm.size for run in runs) < BLOCKS:
        return np.array([low])
    return np.linspace(low, high, BLOCKS)


def _on(run: EmptyRun, u: Floats) -> Floats:
    """Features (K, B) of a run at travels (B,)."""
    good = np.isfinite(run.features).all(axis=0)
    return np.stack([np.interp(u, run.u_mm[good], row[good]) for row in run.features])


def _pieces(profile: NDArray[np.floating[Any]], pieces: int) -> Floats:
    """Means (K, pieces) over equal pieces of a profile (K, BLOCKS)."""
    return np.asarray(profile.reshape(len(profile), pieces, -1).mean(axis=2), np.float64)


def _left_out(profiles: Floats, pieces: int, response: CellResponse) -> Floats:
    """Covariance (2, 2) of the moments along a run less what the others predict, its own level taken off."""
    u = np.arange(BLOCKS) + 0.5
    middles = _pieces(u[None], pieces)[0]
    total = np.zeros((2, 2))
    for k in range(len(profiles)):
        others = _pieces(np.delete(profiles, k, axis=0).mean(axis=0), pieces)
        predicted = np.stack([np.interp(u, middles, row) for row in others])
        rest = response.coefficients @ (profiles[k] - predicted)
        rest = rest - rest.mean(axis=1, keepdims=True)
        total += rest @ rest.T / BLOCKS
    return total / len(profiles)
