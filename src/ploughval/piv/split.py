"""Subsets cut along shear bands: points that an affine subset cannot follow are matched on their own side."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ploughval.axes import Status
from ploughval.piv.subsets import Fit, Floats, Pair, match, match_split

MISMATCH_PX = 0.05
"""Residuals beyond noise that answer to this mismatch make a vector suspect."""
AGREE_PX = 0.15
"""Pixels whose residuals answer to less than this mismatch move with the centre."""
LEAST_SHARE = 0.12
"""A split subset needs this share of its pixels."""
NEAREST = 64
"""Neighbours that are looked at: enough to see the other side of a band."""
CANDIDATES = 3
"""Displacements of neighbours that are tried for each point, besides its own and the plane through them."""
REACH = 2.0
"""Neighbours count within so many subsets."""
SMALL_ZNCC = 0.85
"""Least correlation of a small subset: it has few pixels, and chance fits them well."""


def noise_level(fit: Fit) -> float:
    """Residual variance of undisturbed subsets: the lower quartile of the valid ones."""
    seen = fit.stats[fit.status == Status.OK, 1]
    return float(np.percentile(seen, 25)) if seen.size else 0.0


def mismatch_px(fit: Fit, level: float) -> Floats:
    """Displacement (N,) that would explain the residuals beyond noise, px."""
    slope = np.maximum(fit.stats[:, 7] * fit.stats[:, 8], 1e-12)
    return np.asarray(np.sqrt(np.maximum(fit.stats[:, 1] - 1.5 * level, 0.0) / slope))


def suspects(fit: Fit, level: float) -> NDArray[np.intp]:
    """Points that failed, or whose residuals say that part of the subset moves otherwise."""
    failed = np.isin(fit.status, (Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER))
    astray = (fit.status == Status.OK) & (mismatch_px(fit, level) > MISMATCH_PX)
    return np.flatnonzero(failed | astray)


def split_suspects(pair: Pair, fit: Fit, points: Floats) -> None:
    """Find the points that a whole subset does not describe, and match them on what moves with them."""
    level = noise_level(fit)
    index = suspects(fit, level)
    clean = np.setdiff1d(np.flatnonzero(fit.status == Status.OK), index)
    near = near_motion(points[clean], fit.params[clean, :, 0], points[index], REACH * pair.recipe.subset)
    split(pair, fit, points[index], index, make_candidates(*near, fit.params[index], pair.recipe.half), level)


def near_motion(
    known: Floats, displacement: Floats, points: Floats, reach_px: float
) -> tuple[Floats, Floats]:
    """Offsets and displacements (I, NEAREST, 2) of the nearest known points within reach, NaN: none."""
    count = len(known)
    if count < 3 or len(points) == 0:
        nothing = np.full((len(points), NEAREST, 2), np.nan)
        return nothing, nothing.copy()
    distance, near = cKDTree(known).query(points, k=min(NEAREST, count), distance_upper_bound=reach_px)
    place = np.vstack([known, [[np.nan, np.nan]]])[near] - points[:, None]
    moved = np.vstack([displacement, [[np.nan, np.nan]]])[near]
    moved[~np.isfinite(distance)] = np.nan
    return place, moved


def make_candidates(place: Floats, moved: Floats, own: Floats, half_px: float) -> Floats:
    """Parameters (I, K, 2, terms) from neighbours' displacements; ``half_px``: what gradients refer to."""
    terms = own.shape[2]
    out = np.full((len(own), CANDIDATES + 2, 2, terms), np.nan)
    out[:, -1] = own
    for k in range(len(own)):
        some = np.flatnonzero(np.isfinite(moved[k, :, 0]))
        if some.size == 0:
            continue
        picked = _distinct(moved[k, some])
        out[k, : len(picked)] = 0.0
        out[k, : len(picked), :, 0] = picked
        if some.size >= 4 and terms >= 3:
            plane = np.column_stack([np.ones(some.size), place[k, some] / half_px])
            out[k, -2] = 0.0
            out[k, -2, :, :3] = np.linalg.lstsq(plane, moved[k, some], rcond=None)[0].T
    return out


def _distinct(moved: Floats) -> Floats:
    """The nearest neighbour's displacement, then those that differ most from the ones before (by 0.5 px)."""
    kept = [0]
    apart = np.abs(moved - moved[0]).max(axis=1)
    while len(kept) < CANDIDATES and apart.max() > 0.5:
        kept.append(int(np.argmax(apart)))
        apart = np.minimum(apart, np.abs(moved - moved[kept[-1]]).max(axis=1))
    return moved[kept]


def distinct_motions(moved: Floats) -> Floats:
    """Displacements (I, CANDIDATES, 2) of neighbours (I, K, 2) that differ from each other, NaN: no more."""
    out = np.full((len(moved), CANDIDATES, 2), np.nan)
    for k in range(len(moved)):
        some = moved[k][np.isfinite(moved[k, :, 0])]
        if len(some):
            picked = _distinct(some)
            out[k, : len(picked)] = picked
    return out


def split(
    pair: Pair, fit: Fit, points: Floats, index: NDArray[np.intp], candidates: Floats, level: float
) -> NDArray[np.intp]:
    """Match points again on what moves with them; keeps what succeeds, in place, and returns which.

    ``points`` and ``candidates`` are those of ``index``. First the part of the subset on the point's side
    of a band; where the point is inside a band, a small quadratic subset that follows the band's profile.
    """
    # Where all neighbours move alike there is no band to cut along; the whole subset averages best.
    torn = np.isfinite(candidates[:, 1, 0, 0]) | (fit.status[index] != Status.OK)
    points, index, candidates = points[torn], index[torn], candidates[torn]
    if index.size == 0:
        return index
    reach = max(4, pair.recipe.subset // 4)
    allowed = np.array([2.5 * level, AGREE_PX**2, reach, LEAST_SHARE])
    new = match_split(pair, points, candidates, allowed)
    good = np.flatnonzero((new.status == Status.OK) & (new.zncc > 0.5) & _between(new, candidates))
    before = np.where(fit.status[index] == Status.OK, mismatch_px(fit, level)[index], np.inf)
    fit.put(index[good], new.take(good))
    rest = np.setdiff1d(np.arange(index.size), good)
    if rest.size == 0:
        return index[good]
    small = match_small(pair, points[rest], candidates[rest])
    better = (small.status == Status.OK) & (small.zncc > SMALL_ZNCC) & _between(small, candidates[rest])
    better &= mismatch_px(small, level) < 0.75 * before[rest]
    chosen = np.flatnonzero(better)
    fit.put(index[rest[chosen]], small.take(chosen))
    return np.union1d(index[good], index[rest[chosen]])


def _between(fit: Fit, candidates: Floats) -> NDArray[np.bool_]:
    """Whether displacements lie among those of the candidates, within a pixel."""
    tried = candidates[:, :-1, :, 0]
    some = np.isfinite(tried[:, :, 0]).any(axis=1)
    low = np.min(np.where(np.isfinite(tried), tried, np.inf), axis=1) - 1.0
    high = np.max(np.where(np.isfinite(tried), tried, -np.inf), axis=1) + 1.0
    moved = fit.params[:, :, 0]
    return np.asarray(some & ((moved >= low) & (moved <= high)).all(axis=1))


def match_small(pair: Pair, points: Floats, candidates: Floats) -> Fit:
    """Best match of a small quadratic subset among candidates; parameters are those of ``pair``'s recipe."""
    recipe = replace(pair.recipe, subset=2 * (pair.recipe.subset // 4) + 3, order=2)
    scale = (recipe.half / pair.recipe.half) ** np.array([0, 1, 1, 2, 2, 2])
    terms = pair.recipe.terms
    best = Fit(
        np.zeros((len(points), 2, recipe.terms)),
        np.zeros((len(points), 10)),
        np.full(len(points), Status.NOT_CONVERGED, np.int8),
    )
    for k in range(candidates.shape[1]):
        known = np.flatnonzero(np.isfinite(candidates[:, k, 0, 0]))
        guess = np.zeros((known.size, 2, recipe.terms))
        guess[:, :, :terms] = candidates[known, k]
        new = match(replace(pair, recipe=recipe), points[known], guess * scale, limit=recipe.half)
        won = np.flatnonzero((new.status == Status.OK) & (new.zncc > best.zncc[known]))
        best.put(known[won], new.take(won))
    return Fit((best.params / scale)[:, :, :terms], best.stats, best.status)
