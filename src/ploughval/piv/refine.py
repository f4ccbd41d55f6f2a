"""Richer descriptions where a plain subset does not do: curvature first, then shear bands."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.band import REACH, Bands, match_bands, neighbours_bands, starts_of, two_sides
from ploughval.piv.curvature import EXPLAINED, Level, bends, follow_curvature, worth
from ploughval.piv.precision import Noise, predict_std
from ploughval.piv.subsets import Description, Fit, Floats, Pair, centres_of, match
from ploughval.piv.validate import usual_zncc

Index = NDArray[np.intp]

MISMATCH_PX = 0.05
"""Residuals beyond noise that answer to this mismatch make a vector suspect."""
MOST_CORRELATED = 3.0
"""Factor on the variance beyond which correlation of residuals is taken to come from the motion."""
ENOUGH = 1.3
"""Residual variance over that of undisturbed subsets at which no other start is tried."""
BARE_PX = 0.5
"""A side whose motion is less certain is taken to have no texture."""
GRAIN_PX = 1.5
"""Grains reach this far out of a band."""
POOR = 1.5
"""Residuals over the usual ones of bands beyond which a band is tried from other starts."""
ROUNDS = 2
"""Times that bands found beside a point are tried on it."""
BAND_TERMS, PLAIN_TERMS = 11, 6


def noise_level(fit: Fit) -> float:
    """Residual variance of undisturbed subsets: the lower quartile of the valid ones."""
    seen = fit.residual[fit.status == Status.OK]
    return float(np.percentile(seen, 25)) if seen.size else 0.0


def mismatch_px(fit: Fit, level: float) -> Floats:
    """Displacement (N,) that would explain the residuals beyond noise, px."""
    slope = np.maximum(fit.slope * fit.answer, 1e-12)
    return np.asarray(np.sqrt(np.maximum(fit.residual - 1.5 * level, 0.0) / slope))


def suspects(fit: Fit, level: float) -> Index:
    """Points that failed, or whose residuals say that part of the subset moves otherwise."""
    failed = np.isin(fit.status, (Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER))
    astray = (fit.status == Status.OK) & (mismatch_px(fit, level) > MISMATCH_PX)
    return np.flatnonzero(failed | astray)


def refine(pair: Pair, fit: Fit, points: Floats, zncc_min: float, noise: Noise, near: Index) -> None:
    """Match again, in place, the points that a whole plain subset does not describe.

    ``near`` (N, NEIGHBOURS): neighbours of all points.
    """
    level = noise_level(fit)
    # What curvature leaves in residuals is correlated as well, and must not excuse itself.
    kept = min(noise.correlated[0], MOST_CORRELATED), min(noise.correlated[1], MOST_CORRELATED)
    noise = replace(noise, correlated=kept)
    doubtful = suspects(fit, level)
    missed, bent = bends(pair, fit, points, noise, near)
    index = np.union1d(doubtful, np.flatnonzero(missed | bent))
    if index.size == 0:
        return
    clean = np.setdiff1d(np.flatnonzero(fit.status == Status.OK), doubtful)
    floor = zncc_min * usual_zncc(fit, pair.noise_variance)
    whole = fit.residual.copy()
    whole[fit.status != Status.OK] = np.inf
    follow_curvature(pair, fit, points, index, bent, level=Level(level, floor), noise=noise)
    torn = suspects(fit, level)
    reach = REACH * pair.recipe.subset
    sides = two_sides(points[clean], fit.params[clean], points[torn], pair.recipe.half, reach)
    two = np.isfinite(sides[:, 0, 0, 0])
    torn, sides = torn[two], sides[two]
    if torn.size:
        _follow_bands(pair, fit, points, torn, sides, Limits(Level(level, floor), whole, noise))


@dataclass(frozen=True, slots=True)
class Limits:
    """What a band must better: undisturbed subsets, and the residual variance of plain ones (N,)."""

    level: Level
    plain: Floats
    noise: Noise


def _follow_bands(pair: Pair, fit: Fit, points: Floats, index: Index, sides: Floats, limits: Limits) -> None:
    """Match suspects as two sides and a band; those still suspect once more, from bands found beside them."""
    enough = ENOUGH * limits.level.residual
    starts = starts_of(pair, points[index], sides)
    params = np.full((len(points), BAND_TERMS), np.nan)
    left = index
    for turn in range(starts.shape[1] + ROUNDS):
        if turn < starts.shape[1]:
            tried = starts[np.isin(index, left), turn : turn + 1]
        else:
            tried = neighbours_bands(points, params, left)
        some = np.isfinite(tried[:, 0, 0])
        _take_bands(
            fit, left[some], match_bands(pair, points[left[some]], tried[some], enough), params, limits
        )
        left = _poor(fit, index, limits.level.residual)
        if left.size == 0:
            break
    _own_side(pair, fit, points, params, limits.noise)


def _poor(fit: Fit, index: Index, level: float) -> Index:
    """Which of some suspects still have no band, or one that leaves far more than the others' bands."""
    banded = fit.description[index] == Description.BAND
    usual = float(np.median(fit.residual[index[banded]])) if banded.any() else 0.0
    poor = ~banded | (fit.residual[index] > POOR * usual)
    return np.intersect1d(index[poor], suspects(fit, level))


def _own_side(pair: Pair, fit: Fit, points: Floats, params: Floats, noise: Noise) -> None:
    """Match points beside a band on the part of their subset that lies on their side, in place.

    What a band does to the sand within it is not known exactly, and is left out. A side without texture
    has no motion that could be measured.
    """
    index = np.flatnonzero(np.isfinite(params[:, 0]) & (fit.description == Description.BAND))
    normal = np.stack([np.cos(params[index, 8]), np.sin(params[index, 8])], axis=1)
    offset = points[index] - centres_of(points[index])
    distance = np.einsum("nd,nd->n", offset, normal) - params[index, 9]
    room = params[index, 10] + GRAIN_PX
    beside = np.abs(distance) > room
    index, normal, distance, room = index[beside], normal[beside], distance[beside], room[beside]
    if index.size == 0:
        return
    sign = np.sign(distance)
    cuts = np.column_stack([normal * sign[:, None], sign * params[index, 9] + room])
    new = match(pair, points[index], fit.params[index], limit=1.0, cuts=cuts)
    new.stats[:, -1] = Description.SIDE
    bare = (new.status == Status.FLAT) | (
        (new.status == Status.OK) & (predict_std(new, noise) > BARE_PX).any(axis=1)
    )
    fit.status[index[bare]] = Status.FLAT
    good = (new.status == Status.OK) & ~bare & (new.residual < ENOUGH * fit.residual[index])
    chosen = np.flatnonzero(good)
    fit.put(index[chosen], new.take(chosen))


def _take_bands(fit: Fit, index: Index, bands: Bands, params: Floats, limits: Limits) -> None:
    """Keep a band where it explains enough more than a plain subset, and more than what there is."""
    new, old, plain = bands.fit, fit.take(index), limits.plain[index]
    good = limits.level.good(new, limits.noise)
    share = worth(BAND_TERMS - PLAIN_TERMS, new.pixels / max(1.0, *limits.noise.correlated))
    better = new.residual < np.minimum(
        (1.0 - share) * plain, (1.0 - EXPLAINED) * plain + EXPLAINED * limits.level.residual
    )
    better &= new.residual < old.residual
    taken = np.flatnonzero(good & ((old.status != Status.OK) | better))
    fit.put(index[taken], new.take(taken))
    params[index[taken]] = bands.params[taken]
