"""Curved motion: quadratic and smaller subsets where a plain one averages what it should follow.

Among plain, quadratic and small quadratic subsets the smoothest one is taken that agrees with the finer ones
within their noise (Lepski 1991): the least total error of bias and noise. Curvature must also show in the
residuals, of a point and its neighbours together: noise alone makes finer subsets disagree at times, and
single ones fit better.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.precision import Noise, predict_std, with_correlation
from ploughval.piv.subsets import (
    Description,
    Fit,
    Floats,
    Pair,
    displacement_of,
    match,
    moved_at,
    read_subsets,
)
from ploughval.piv.validate import chance_zncc, distance_to, gather, neighbours_of

Index = NDArray[np.intp]
DISAGREES = 5.0
"""Standard deviations by which neighbours carried on may disagree."""
LEAST_PX = 0.003
"""Disagreement that never matters."""
DIFFERS = 2.0
"""Mean squared difference of two descriptions over the finer one's variance that makes them differ."""
ALIKE = 2
"""The motion is curved where so many neighbours are missed the same way."""
WORST = -0.1
"""A finer description that fits worse counts as so much worse at most."""
EXPLAINED = 0.3
"""Least share of the residuals beyond noise that a finer description takes away: sand that falls apart leaves
residuals as well, and no description explains these."""
POOLED = 4
"""Neighbours whose residuals count with a point's own."""
TERMS = 6
"""Parameters that second order adds."""
MOST_CORRELATED = 1.5
"""Neighbours together outweigh the correlation of residuals beyond this."""
CHUNK = 512


def bends(
    pair: Pair, fit: Fit, points: Floats, noise: Noise, near: Index
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether the motion of a point's neighbours, carried on along their gradients, misses it.

    ``near`` (N, NEIGHBOURS): neighbours of all points.

    Returns
    -------
    missed : (N,) bool
        Beyond what noise allows.
    together : (N,) bool
        So it is for some of its neighbours, and in the same direction: the motion is curved, by more than a
        subset of second order costs in noise.
    """
    apart = miss_of_neighbours(pair, fit, points, near)
    missed = np.asarray((np.abs(apart) > DISAGREES * predict_std(fit, noise) + LEAST_PX).any(axis=1))
    if not missed.any():
        return missed, missed.copy()
    apart[~missed] = 0.0
    beside = distance_to(points, near) <= pair.recipe.subset
    alike = np.einsum("nka,na->nk", gather(apart, near), apart) > 0.0
    core = (alike & beside).sum(axis=1) >= ALIKE
    # Where the motion turns from one bend into the next it misses nothing, and is curved all the same.
    return missed, core | (beside & (gather(core.astype(float), near) > 0.0)).any(axis=1)


def miss_of_neighbours(pair: Pair, fit: Fit, points: Floats, near: Index) -> Floats:
    """How far the motion of valid neighbours, carried on along their gradients, misses each point, (N, 2) px.

    NaN where the point, or all within a subset of it, are not valid. ``near`` (N, NEIGHBOURS).
    """
    out = np.full((len(points), 2), np.nan)
    valid = np.flatnonzero(fit.status == Status.OK)
    if valid.size < 5 or pair.recipe.terms < 3:
        return out
    place, params = points[valid], fit.params[valid]
    if valid.size < len(points):
        near = neighbours_of(place)
    offset = (place[:, None] - gather(place, near)) / pair.recipe.half
    around = gather(params, near)  # (n, K, 2, terms)
    carried = moved_at(around, offset)
    beside = np.sum(offset**2, axis=2) <= (pair.recipe.subset / pair.recipe.half) ** 2
    known = beside.any(axis=1)
    carried[~beside] = np.nan
    # The median of those beside: NaN are sorted behind them (numpy's own nanmedian is slow).
    ordered, many = np.sort(np.ascontiguousarray(carried.swapaxes(1, 2)), axis=2), beside.sum(axis=1)
    lower, upper = ((np.maximum(many - 1, 0) // 2)[:, None, None], (many // 2)[:, None, None])
    upper = np.minimum(upper, near.shape[1] - 1)
    pair_of = [np.take_along_axis(ordered, k, axis=2)[..., 0] for k in (lower, upper)]
    middle = 0.5 * (pair_of[0] + pair_of[1])
    out[valid[known]] = middle[known] - params[known, :, 0]
    return out


@dataclass(frozen=True, slots=True)
class Level:
    """What undisturbed subsets of a pair reach: residual variance, and the least correlation to be valid."""

    residual: float
    zncc: float

    def good(self, fit: Fit, noise: Noise) -> NDArray[np.bool_]:
        """Which subsets matched well enough, and better than chance lets so many pixels, (N,)."""
        least = np.maximum(chance_zncc(fit, noise.variance), self.zncc)
        return np.asarray((fit.status == Status.OK) & (fit.zncc >= least))


@dataclass(frozen=True, slots=True)
class Suspects:
    """Points that a plain subset may not describe.

    Where, their suspect neighbours (I, POOLED), and whether the motion bends about them.
    """

    points: Floats
    near: Index
    bent: NDArray[np.bool_]
    level: Level
    noise: Noise


def follow_curvature(
    pair: Pair,
    fit: Fit,
    points: Floats,
    index: Index,
    bent: NDArray[np.bool_],
    *,
    level: Level,
    noise: Noise,
) -> None:
    """Take the smoothest sufficient of plain, quadratic and small quadratic subsets, in place.

    ``bent`` (N,): whether the motion bends about each point.
    """
    where = points[index]
    near = neighbours_of(where, POOLED)
    near[~(distance_to(where, near) <= pair.recipe.subset)] = index.size
    plain = fit.take(index)
    second = replace(pair, recipe=replace(pair.recipe, order=2))
    full = match(second, where, _raised(plain.params, 6))
    if 2 * index.size > len(points):
        # Hardly a plain subset is undisturbed: what curvature leaves would count as correlated noise.
        noise = with_correlation(noise, second, where, full)
    suspects = Suspects(where, near, bent[index], level, noise)
    whole = _described(pair, where, full, Description.QUADRATIC)
    chosen = _worthwhile(suspects, plain, whole, plain.residual)
    fit.put(index[chosen], whole.take(chosen))
    reach = pair.recipe.subset // 3
    scale = (reach / pair.recipe.half) ** np.array([0, 1, 1, 2, 2, 2])
    sound = (whole.status == Status.OK) & (whole.zncc >= plain.zncc)
    start = np.where(sound[:, None, None], full.params, _raised(plain.params, 6)) * scale
    small = match(replace(pair, recipe=replace(pair.recipe, order=2, subset=2 * reach + 1)), where, start)
    small = replace(small, params=small.params / scale)
    fine = _described(pair, where, small, Description.QUADRATIC_SMALL)
    before = _residuals(pair, where, plain.params, reach)
    chosen = _worthwhile(suspects, fit.take(index), fine, before)
    fit.put(index[chosen], fine.take(chosen))


def _raised(params: Floats, terms: int) -> Floats:
    """Parameters of a shape function of more terms, the further ones zero."""
    out = np.zeros((*params.shape[:2], terms))
    out[:, :, : params.shape[2]] = params
    return out


def _described(pair: Pair, points: Floats, fit: Fit, kind: Description) -> Fit:
    """A fit of second order as parameters of the pair's own order, marked as what it is."""
    stats, terms = fit.stats.copy(), pair.recipe.terms
    stats[:, -1] = kind
    params = fit.params[:, :, :terms].copy()
    if terms == 1:  # what is left out moves the point, which stands beside its subset's centre
        params[:, :, 0] = displacement_of(fit.params, points, replace(pair.recipe, order=2))
    return Fit(params, stats, fit.status)


def worth(more: Index | int, count: Floats) -> Floats:
    """Share by which residuals must fall for ``more`` parameters to pay: Bayes' criterion (Schwarz 1978)."""
    count = np.maximum(count, 16.0)
    return np.asarray(more * np.log(count) / count)


def _worthwhile(suspects: Suspects, old: Fit, new: Fit, before: Floats) -> Index:
    """Points at which a finer description explains more, with its neighbours, and says something else.

    ``before`` (I,): residual variance of the old description where the new one is matched.
    """
    failed = old.status != Status.OK
    usable = ~failed & (new.status == Status.OK)
    near = suspects.near
    before = np.maximum(before, 1e-12)
    # Shares, and bounded below: a neighbour that found another place must not outweigh the others.
    gains = np.where(usable, np.maximum(1.0 - new.residual / before, WORST), np.nan)
    excess = np.where(usable, np.maximum(1.0 - suspects.level.residual / before, 0.0), np.nan)
    many, gained = _pooled(gains, near)
    # Alone, a point must convince with as many pixels as its correlated residuals are worth.
    correlated = max(1.0, *suspects.noise.correlated)
    pixels = new.pixels / np.where(many > 2, min(correlated, MOST_CORRELATED), correlated)
    needed = worth(TERMS, pixels)
    apart = np.where(usable[:, None], _disagreement(old, new, suspects.noise), np.nan)
    apart = np.stack([_pooled(apart[:, axis], near)[1] for axis in range(2)], axis=1)
    better = gained > np.maximum(needed, EXPLAINED * _pooled(excess, near)[1])
    better |= suspects.bent & (old.description == Description.PLAIN) & (gained > needed / 2)
    better &= (gains > 0.0) & (apart > DIFFERS).any(axis=1)
    good = suspects.level.good(new, suspects.noise)
    return np.flatnonzero(good & (better | failed))


def _pooled(values: Floats, near: Index) -> tuple[NDArray[np.intp], Floats]:
    """How many of a point and its neighbours have a value, and the mean of these or zero, (N,)."""
    around = np.concatenate([values[:, None], gather(values, near)], axis=1)
    many = np.isfinite(around).sum(axis=1)
    return many, np.asarray(np.nansum(around, axis=1) / np.maximum(many, 1))


def _disagreement(rough: Fit, fine: Fit, noise: Noise) -> Floats:
    """Squared difference of two descriptions over the variance of the finer one, (N, 2)."""
    spread = predict_std(fine, noise) + LEAST_PX
    return np.asarray(((rough.params[:, :, 0] - fine.params[:, :, 0]) / spread) ** 2)


def _residuals(pair: Pair, points: Floats, params: Floats, reach: int) -> Floats:
    """Residual variance (N,) of subsets within so many px of their centres."""
    half = pair.recipe.half
    middle = slice(half - reach, half + reach + 1)
    out = np.full(len(points), np.nan)
    for first in range(0, len(points), CHUNK):
        part = slice(first, first + CHUNK)
        subsets = read_subsets(pair, points[part], params[part])
        square = np.sum(subsets[:, 0, middle, middle] ** 2, axis=(1, 2))
        out[part] = square / np.maximum(np.sum(subsets[:, 3, middle, middle], axis=(1, 2)), 1.0)
    return out
