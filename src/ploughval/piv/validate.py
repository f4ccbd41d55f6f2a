"""Vectors judged: correlation, and the normalised median test (Westerweel & Scarano 2005)."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ploughval.axes import Status
from ploughval.piv.subsets import Fit

Floats = NDArray[np.float64]
NEIGHBOURS = 8
BLURRED = 0.8
"""Share of what noise leaves of the correlation that other differences may leave of it."""
CHANCE = 4.0
"""Standard deviations of the correlation of unrelated texture."""


def texture_share(fit: Fit, noise_variance: float) -> Floats:
    """Share of the variance of each subset's grey values that is not noise, (N,)."""
    return np.asarray(np.clip(1.0 - noise_variance / np.maximum(fit.variance, 1e-12), 0.0, 1.0))


def chance_zncc(fit: Fit, noise_variance: float) -> Floats:
    """Correlation that chance reaches, (N,).

    CHANCE standard deviations of the correlation of unrelated texture, whose artanh spreads by
    1 / sqrt(n - 3) with n the independent grey values of the subset (Fisher 1915). A grain covers pi times
    its squared length of correlation; noise is independent from pixel to pixel. A subset of fewer than about
    ten grains cannot be told from chance.
    """
    count = np.maximum(fit.pixels, 1.0)
    texture = texture_share(fit, noise_variance)
    grain = np.pi * texture * fit.variance / np.maximum(fit.slope * fit.answer, 1e-12)
    independent = count / np.clip(1.0 + texture**2 * (grain - 1.0), 1.0, count)
    return np.asarray(np.tanh(CHANCE / np.sqrt(np.maximum(independent - 3.0, 1.0))))


def usual_zncc(fit: Fit, noise_variance: float) -> float:
    """Correlation that vectors of a pair are measured by.

    What the better half of those beyond chance reaches, or BLURRED times what noise leaves where that is
    more.
    """
    seen = fit.zncc[(fit.status == Status.OK) & (fit.zncc > chance_zncc(fit, noise_variance))]
    if seen.size == 0:
        return 1.0
    left = float(np.median(texture_share(fit, noise_variance)[fit.pixels > 0]))
    return max(float(np.percentile(seen, 75)), BLURRED * left)


def least_zncc(fit: Fit, zncc_min: float, noise_variance: float) -> Floats:
    """Least correlation that makes each vector valid, (N,).

    Noise alone lowers the correlation of every subset, so ``zncc_min`` is taken relative to what is usual; it
    never falls below what chance reaches.
    """
    return np.maximum(chance_zncc(fit, noise_variance), zncc_min * usual_zncc(fit, noise_variance))


def judge_correlation(fit: Fit, zncc_min: float, noise_variance: float) -> None:
    """Mark converged vectors whose correlation is too low, in place."""
    low = (fit.status == Status.OK) & ~(fit.zncc >= least_zncc(fit, zncc_min, noise_variance))
    fit.status[low] = Status.LOW_CORRELATION


def neighbours_of(points: Floats, count: int = NEIGHBOURS) -> NDArray[np.intp]:
    """Indices of the nearest points of each point, (N, count); the index N stands for none."""
    total = len(points)
    if total < 2:
        return np.full((total, count), total, np.intp)
    found = cKDTree(points).query(points, k=min(count + 1, total))[1][:, 1:]
    out = np.full((total, count), total, np.intp)
    out[:, : found.shape[1]] = found
    return out


def gather(values: Floats, near: NDArray[np.intp]) -> Floats:
    """Values of neighbours, (N, K, ...); NaN where there is none."""
    extra = np.full((1, *values.shape[1:]), np.nan)
    return np.asarray(np.concatenate([values, extra])[near])


def distance_to(points: Floats, near: NDArray[np.intp]) -> Floats:
    """Distance of each point (N, 2) to its neighbours, (N, K) px; NaN where there is none."""
    return np.asarray(np.linalg.norm(gather(points, near) - points[:, None], axis=2))


def outliers(
    points: Floats,
    displacement: Floats,
    *,
    threshold: float = 3.0,
    fluctuation_px: float = 0.1,
    support: int = 2,
    reach_px: float = np.inf,
    near: NDArray[np.intp] | None = None,
) -> NDArray[np.bool_]:
    """Normalised median test.

    Parameters
    ----------
    points : (N, 2) float, px
        Any set of points.
    displacement : (N, 2) float, px
        NaN: not valid, neither tested nor used.
    threshold : float
        Limit of the normalised residual (with the constant ``fluctuation_px``).
    fluctuation_px : float, px
        Fluctuation that is always allowed.
    support : int
        A vector that this many neighbours agree with (within 0.2 px or a fifth of their spread) stays:
        beside a shear band the median may belong to the other side.
    reach_px : float, px
        A vector is judged only where at least half of its neighbours are nearer than this.
    near : (N, NEIGHBOURS) int
        Neighbours of all points, where they are known; used when all are valid.

    Returns
    -------
    (N,) bool
        True: disagrees with its neighbours.
    """
    valid = np.flatnonzero(np.isfinite(displacement).all(axis=1))
    flags = np.zeros(len(points), bool)
    if valid.size < 4:
        return flags
    if near is None or valid.size < len(points):
        near = neighbours_of(points[valid], min(NEIGHBOURS, valid.size - 1))
    own = displacement[valid]
    around = gather(own, near)
    median = np.median(around, axis=1)
    # Most vectors are so near the median that their neighbours' spread does not matter.
    some = np.flatnonzero((np.abs(own - median) > threshold * fluctuation_px / np.sqrt(2)).any(axis=1))
    own, around, median, near, place = own[some], around[some], median[some], near[some], points[valid]
    spread = np.median(np.abs(around - median[:, None]), axis=1)
    ratio = np.hypot(*(np.abs(own - median) / (spread + fluctuation_px)).T)
    distance = np.linalg.norm(around - own[:, None], axis=2)
    close = np.maximum(0.2, 0.2 * np.ptp(np.linalg.norm(around, axis=2), axis=1))
    agree = np.sum(distance < close[:, None], axis=1)
    distance_px = np.linalg.norm(gather(place, near) - place[some, None], axis=2)
    wrong = (ratio > threshold) & (agree < support) & (np.median(distance_px, axis=1) <= reach_px)
    flags[valid[some]] = wrong
    return flags
