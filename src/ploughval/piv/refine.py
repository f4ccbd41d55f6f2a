"""Richer descriptions where a plain subset does not do: curvature, smaller subsets, shear bands.

A point is suspect when its residuals exceed the noise, or when its neighbours, carried on along their
gradients, disagree with it. Among plain and quadratic subsets the smoothest one is taken that agrees with
all finer ones within their noise (Lepski 1991): the least total error of bias and noise. What still does not
fit is a band.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.band import REACH, Bands, match_bands, neighbours_bands, starts_of, two_sides
from ploughval.piv.subsets import Description, Fit, Floats, Pair, centres_of, match
from ploughval.piv.validate import NEIGHBOURS, gather, least_zncc, neighbours_of

Index = NDArray[np.intp]

MISMATCH_PX = 0.05
"""Residuals beyond noise that answer to this mismatch make a vector suspect."""
DISAGREES = 5.0
"""Standard deviations by which neighbours carried on may disagree."""
LEAST_PX = 0.003
"""Disagreement that never matters."""
AGREES = 2.5
"""A smoother description agrees with a finer one within so many of the finer one's standard deviations."""
ENOUGH = 1.3
"""Residual variance over that of undisturbed subsets at which no other start is tried."""
GRAIN_PX = 1.5
"""Grains reach this far out of a band."""
ROUNDS = 2
"""Times that bands found beside a point are tried on it."""
BAND_TERMS, PLAIN_TERMS = 11, 6


def noise_level(fit: Fit) -> float:
    """Residual variance of undisturbed subsets: the lower quartile of the valid ones."""
    seen = fit.stats[fit.status == Status.OK, 1]
    return float(np.percentile(seen, 25)) if seen.size else 0.0


def mismatch_px(fit: Fit, level: float) -> Floats:
    """Displacement (N,) that would explain the residuals beyond noise, px."""
    slope = np.maximum(fit.stats[:, 7] * fit.stats[:, 8], 1e-12)
    return np.asarray(np.sqrt(np.maximum(fit.stats[:, 1] - 1.5 * level, 0.0) / slope))


def spread_px(fit: Fit) -> Floats:
    """Standard deviation (N, 2) of the displacement if residuals were white, px."""
    return np.asarray(np.sqrt(fit.stats[:, 1:2] * fit.stats[:, 2:4]) / np.maximum(fit.stats[:, 8:9], 0.1))


def suspects(fit: Fit, level: float) -> Index:
    """Points that failed, or whose residuals say that part of the subset moves otherwise."""
    failed = np.isin(fit.status, (Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER))
    astray = (fit.status == Status.OK) & (mismatch_px(fit, level) > MISMATCH_PX)
    return np.flatnonzero(failed | astray)


def curved(pair: Pair, fit: Fit, points: Floats) -> NDArray[np.bool_]:
    """Whether the motion of a point's neighbours, carried on along their gradients, misses it, (N,)."""
    flags = np.zeros(len(points), bool)
    valid = np.flatnonzero(fit.status == Status.OK)
    if valid.size < 5 or pair.recipe.terms < 3:
        return flags
    place, params = points[valid], fit.params[valid]
    near = neighbours_of(place, NEIGHBOURS)
    offset = place[:, None] - gather(place, near)
    around = gather(params, near)
    carried = around[:, :, :, 0] + np.einsum("nkad,nkd->nka", around[:, :, :, 1:3], offset / pair.recipe.half)
    carried[~(np.linalg.norm(offset, axis=2) <= pair.recipe.subset)] = np.nan
    known = np.isfinite(carried[:, :, 0]).any(axis=1)
    missed = np.abs(np.nanmedian(carried[known], axis=1) - params[known, :, 0])
    flags[valid[known]] = (missed > DISAGREES * spread_px(fit)[valid[known]] + LEAST_PX).any(axis=1)
    return flags


def refine(pair: Pair, fit: Fit, points: Floats, zncc_min: float) -> None:
    """Match again, in place, the points that a whole plain subset does not describe."""
    level = noise_level(fit)
    doubtful = suspects(fit, level)
    index = np.union1d(doubtful, np.flatnonzero(curved(pair, fit, points)))
    if index.size == 0:
        return
    clean = np.setdiff1d(np.flatnonzero(fit.status == Status.OK), doubtful)
    least = least_zncc(fit, zncc_min, pair.noise_variance)
    _smoothest(pair, fit, points, index, least)
    torn = suspects(fit, level)
    sides = two_sides(
        points[clean], fit.params[clean], points[torn], pair.recipe.half, REACH * pair.recipe.subset
    )
    two = np.isfinite(sides[:, 0, 0, 0])
    torn, sides = torn[two], sides[two]
    if torn.size:
        _follow_bands(pair, fit, points, torn, sides, level, least)


def _smoothest(pair: Pair, fit: Fit, points: Floats, index: Index, least: Floats) -> None:
    """Take the smoothest of plain, quadratic and small quadratic subsets that agrees with all finer ones."""
    tried = [fit.take(index)]
    small = 2 * (pair.recipe.subset // 3) + 1
    for side, kind in ((pair.recipe.subset, Description.QUADRATIC), (small, Description.QUADRATIC_SMALL)):
        tried.append(_quadratic(pair, points[index], tried[0].params, side, kind))
    good = [f.status == Status.OK for f in tried]
    good = [g & (f.zncc >= least[index]) for g, f in zip(good, tried, strict=True)]
    open_ = np.ones(index.size, bool)
    for k, rough in enumerate(tried):
        agrees = open_ & good[k]
        for finer, known in zip(tried[k + 1 :], good[k + 1 :], strict=True):
            apart = np.abs(rough.params[:, :, 0] - finer.params[:, :, 0])
            agrees &= ~known | (apart <= AGREES * spread_px(finer) + LEAST_PX).all(axis=1)
        chosen = np.flatnonzero(agrees)
        fit.put(index[chosen], rough.take(chosen))
        open_ &= ~agrees


def _quadratic(pair: Pair, points: Floats, start: Floats, side: int, kind: Description) -> Fit:
    """Second-order subsets of a side; parameters are those of the pair's own recipe."""
    recipe = replace(pair.recipe, order=2, subset=side)
    terms = pair.recipe.terms
    scale = (recipe.half / pair.recipe.half) ** np.array([0, 1, 1, 2, 2, 2])
    guess = np.zeros((len(points), 2, recipe.terms))
    guess[:, :, :terms] = start
    new = match(replace(pair, recipe=recipe), points, guess * scale)
    new.stats[:, -1] = kind
    return Fit((new.params / scale)[:, :, :terms].copy(), new.stats, new.status)


def _follow_bands(
    pair: Pair, fit: Fit, points: Floats, index: Index, sides: Floats, level: float, least: Floats
) -> None:
    """Match suspects as two sides and a band; those still suspect once more, from bands found beside them."""
    bands = match_bands(pair, points[index], starts_of(pair, points[index], sides), ENOUGH * level)
    params = np.full((len(points), BAND_TERMS), np.nan)
    _take_bands(fit, index, bands, params, least)
    for _ in range(ROUNDS):
        left = np.intersect1d(index, suspects(fit, level))
        starts = neighbours_bands(points, params, left)
        some = np.isfinite(starts[:, 0, 0])
        left, starts = left[some], starts[some]
        if left.size == 0:
            break
        _take_bands(fit, left, match_bands(pair, points[left], starts, ENOUGH * level), params, least)
    _own_side(pair, fit, points, params)


def _own_side(pair: Pair, fit: Fit, points: Floats, params: Floats) -> None:
    """Match points beside a band on the part of their subset that lies on their side, in place.

    What a band does to the sand within it is not known exactly, and is left out.
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
    good = (new.status == Status.OK) & (new.stats[:, 1] < ENOUGH * fit.stats[index, 1])
    chosen = np.flatnonzero(good)
    fit.put(index[chosen], new.take(chosen))


def _take_bands(fit: Fit, index: Index, bands: Bands, params: Floats, least: Floats) -> None:
    """Keep a band where it explains enough more than what there is."""
    new = bands.fit
    good = (new.status == Status.OK) & (new.zncc >= least[index])
    failed = fit.status[index] != Status.OK
    # Bayes' criterion (Schwarz 1978): a parameter pays when it lowers the residuals by more than log n / n.
    count = np.maximum(new.stats[:, 4], 16.0)
    terms = np.where(fit.description[index] == Description.BAND, BAND_TERMS, PLAIN_TERMS)
    before = np.log(np.maximum(fit.stats[index, 1], 1e-12))
    after = np.log(np.maximum(new.stats[:, 1], 1e-12)) + (BAND_TERMS - terms) * np.log(count) / count
    taken = np.flatnonzero(good & (failed | (after < before)))
    fit.put(index[taken], new.take(taken))
    params[index[taken]] = bands.params[taken]
