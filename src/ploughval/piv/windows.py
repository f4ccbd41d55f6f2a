"""Shiftable windows: sand near a shear band is matched on small windows that move with it."""

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ploughval.axes import Status
from ploughval.piv.guess import Greys
from ploughval.piv.refine import mismatch_px
from ploughval.piv.subsets import Description, Fit, Floats, Pair, centres_of, match

Index = NDArray[np.intp]

SIDES = (2 / 3, 0.42)
"""Sides of the windows over that of a whole subset; all are tried in this order."""
MARGIN_PX = (2.0, 6.0)
"""A window reaches so far beyond its point, least and most: nearer to a band the motion is not known."""
SWEPT = 0.3
"""A band's line turns as the blade advances, and sweeps over the sand beside it by so much of the advance."""
LIMIT_PX = 1.0
"""A window stays within this distance of a motion that its neighbours have."""
LEAST_ZNCC = 0.88
"""Least correlation of a window over that of undisturbed subsets: chance fits few pixels well."""
MOST_MISMATCH_PX = 0.3
"""Residuals beyond noise may answer to so much."""
WORTH = 0.6
"""A window is matched when its correlation before is beyond this share of that of undisturbed subsets."""
TRIES = 3
"""Windows of one side that are matched until one will do."""
WHOLE = -1
"""Number of the window of a point whose whole subset is matched."""
NEAREST = 64
"""Neighbours that are looked at: enough to see the other side of a band."""
_AT_ONCE = 1024  # points whose pixels are held together
CANDIDATES = 3
"""Displacements of neighbours that are tried for each point."""
REACH = 2.0
"""Neighbours count within so many subsets."""


@dataclass(frozen=True, slots=True)
class Shapes:
    """Small windows about a point.

    Attributes
    ----------
    sides : (W,) int, px
    shifts : (W, 2) int, px, of their centres from the point's pixel
    """

    sides: NDArray[np.int64]
    shifts: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Level:
    """What undisturbed subsets of a frame reach, residual variance and correlation, and its windows."""

    residual: float
    zncc: float
    shapes: Shapes


@dataclass(frozen=True, slots=True)
class Found:
    """Points matched on windows, and the number of the window of each (N,), WHOLE: none."""

    fit: Fit
    window: Index


def margin_of(steps: Floats) -> float:
    """How far windows must reach beyond their points, px, when these moved by steps (N, 2) px in a frame."""
    travel = np.linalg.norm(steps, axis=1)
    travel = travel[np.isfinite(travel)]
    most = float(np.percentile(travel, 95)) if travel.size else 0.0
    return float(np.clip(SWEPT * most + 1.0, *MARGIN_PX))


def shapes_of(subset: int, margin_px: float) -> Shapes:
    """All windows that reach a margin beyond their point: wide ones first, central ones before others."""
    sides, shifts = [], []
    for share in SIDES:
        side = max(2 * int(share * subset / 2) + 1, 9)
        far = max(side // 2 - round(margin_px), 1)
        steps = [(x, y) for y in (-far, 0, far) for x in (-far, 0, far)]
        for step in sorted(steps, key=lambda s: abs(s[0]) + abs(s[1])):
            sides.append(side)
            shifts.append(step)
    return Shapes(np.array(sides, np.int64), np.array(shifts, np.int64).reshape(-1, 2))


def motions_about(known: Floats, displacement: Floats, points: Floats, reach_px: float) -> Floats:
    """Displacements (I, CANDIDATES, 2) of known points within reach that differ from each other.

    The nearest one's, then those that differ most from the ones before, by 0.5 px at least; NaN: no more.
    """
    out = np.full((len(points), CANDIDATES, 2), np.nan)
    if len(known) < 3 or len(points) == 0:
        return out
    count = min(NEAREST, len(known))
    distance, near = cKDTree(known).query(points, k=count, distance_upper_bound=reach_px)
    for n in range(len(points)):
        moved = displacement[near[n][np.isfinite(distance[n])]]
        if len(moved) == 0:
            continue
        kept = [0]
        apart = np.abs(moved - moved[0]).max(axis=1)
        while len(kept) < CANDIDATES and apart.max() > 0.5:
            kept.append(int(np.argmax(apart)))
            apart = np.minimum(apart, np.abs(moved - moved[kept[-1]]).max(axis=1))
        out[n, : len(kept)] = moved[kept]
    return out


def rank_windows(greys: Greys, points: Floats, candidates: Floats, shapes: Shapes) -> Floats:
    """Correlation (N, K, W) of all windows at displacements (N, K, 2) as they are; -1 where there is none.

    Bilinear and 8 bit: it only tells which windows are worth a match. All sums are of whole numbers and
    exact, so that they do not depend on the order in which they are added.
    """
    parts = [slice(start, start + _AT_ONCE) for start in range(0, max(len(points), 1), _AT_ONCE)]
    return np.concatenate([_ranked(greys, points[part], candidates[part], shapes) for part in parts])


def _ranked(greys: Greys, points: Floats, candidates: Floats, shapes: Shapes) -> Floats:
    """:func:`rank_windows` of so many points that their pixels fit into memory."""
    sides, shifts = shapes.sides, shapes.shifts
    half = int((np.abs(shifts).max(axis=1) + sides // 2).max())
    axis = np.arange(-half, half + 1)
    ox, oy = (a.ravel() for a in np.meshgrid(axis, axis))
    inside = np.abs(np.stack([ox, oy], axis=1)[:, None] - shifts).max(axis=2) <= sides // 2
    # Grey levels from -128 to 127: sums of their products over 31 x 31 pixels are exact in single precision.
    kind = np.dtype(np.float32 if sides.max() <= 31 else np.float64)
    inside = inside.astype(kind)
    count = inside.sum(axis=0).astype(float)
    height, width = greys.reference.shape
    centres = centres_of(points)
    row, column = np.clip(centres[:, 1:] + oy, 0, height - 1), np.clip(centres[:, :1] + ox, 0, width - 1)
    before = greys.reference[row, column].astype(kind) - kind.type(128)
    f_sum, f_square = _sums(before, inside), _sums(before * before, inside)
    out = np.full((*candidates.shape[:2], len(sides)), -1.0)
    who, which = np.nonzero(np.isfinite(candidates[:, :, 0]))
    chunk = 32_000 // axis.size  # OpenCV's maps have fewer than 2^15 rows and columns
    for start in range(0, who.size, chunk):
        n, k = who[start : start + chunk], which[start : start + chunk]
        place = centres[n] + candidates[n, k]
        x = (place[:, :1] + ox).astype(np.float32).reshape(-1, axis.size)
        y = (place[:, 1:] + oy).astype(np.float32).reshape(-1, axis.size)
        there = cv2.remap(greys.current, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        after = there.reshape(n.size, -1).astype(kind) - kind.type(128)
        g_sum, g_square = _sums(after, inside), _sums(after * after, inside)
        product = _sums(before[n] * after, inside) - f_sum[n] * g_sum / count
        spread = (f_square[n] - f_sum[n] ** 2 / count) * (g_square - g_sum**2 / count)
        out[n, k] = product / np.sqrt(np.maximum(spread, 1e-9))
    return out


def _sums(values: NDArray[Any], inside: NDArray[Any]) -> Floats:
    """Sums (N, W) of values (N, pixels) over the pixels of every window."""
    return np.asarray(values @ inside, np.float64)


def match_windows(pair: Pair, points: Floats, candidates: Floats, ranks: Floats, level: Level) -> Found:
    """Match each point on the best of some windows from the best of some displacements.

    Parameters
    ----------
    pair : Pair
        Both pictures.
    points : (N, 2) float, px
        Material points in the reference picture.
    candidates : (N, K, 2) float, px
        Displacements to start from; NaN: none.
    ranks : (N, K, W) float
        Correlation of every window as found by :func:`rank_windows`; -1: not to be tried.
    level : Level
        What undisturbed subsets reach, and the windows.

    Returns
    -------
    Found
        Status OK, or LOW_CORRELATION where no window will do; parameters are those of the pair's recipe.
    """
    sides, shifts = level.shapes.sides, level.shapes.shifts
    best = Fit.empty(len(points), pair.recipe.terms, Status.LOW_CORRELATION)
    chosen = np.full(len(points), WHOLE, np.intp)
    for side in np.unique(sides)[::-1]:
        rank = np.where(sides == side, ranks, -1.0).reshape(len(points), ranks.shape[1] * len(sides))
        for tried in np.argsort(-rank, axis=1, kind="stable")[:, :TRIES].T:
            open_ = chosen == WHOLE
            worth = np.take_along_axis(rank, tried[:, None], axis=1)[:, 0] > WORTH * level.zncc
            who = np.flatnonzero(open_ & worth)
            if who.size == 0:
                break
            k, window = np.divmod(tried[who], len(sides))
            small = _match_some(pair, points[who] + shifts[window], candidates[who, k], int(side))
            good = small.status == Status.OK
            good &= small.zncc > LEAST_ZNCC * level.zncc
            good &= mismatch_px(small, level.residual) < MOST_MISMATCH_PX
            won = np.flatnonzero(good)
            best.put(who[won], small.take(won))
            chosen[who[won]] = window[won]
    return Found(best, chosen)


def torn_between(
    pair: Pair, points: Floats, candidates: Floats, found: Found, level: Level
) -> NDArray[np.bool_]:
    """Whether the mirrored window fits another motion as well, (N,): the band is upon the point."""
    sides, shifts = level.shapes.sides, level.shapes.shifts
    torn = np.zeros(len(points), bool)
    apart = np.abs(candidates - found.fit.params[:, None, :, 0]).max(axis=2) > LIMIT_PX
    shifted = (found.window != WHOLE) & shifts[found.window].any(axis=1)
    for side in np.unique(sides):
        who, k = np.nonzero(apart & (shifted & (sides[found.window] == side))[:, None])
        mirrored = points[who] - shifts[found.window[who]]
        other = _match_some(pair, mirrored, candidates[who, k], int(side))
        fits = (other.status == Status.OK) & (other.zncc > LEAST_ZNCC * level.zncc)
        torn[who[fits]] = True
    return torn


def _match_some(pair: Pair, places: Floats, displacement: Floats, side: int) -> Fit:
    """Match windows of one side in translation; what moves them are parameters of the pair's own recipe."""
    recipe = replace(pair.recipe, subset=side, order=0)
    centres = centres_of(places).astype(float)
    found = match(replace(pair, recipe=recipe), centres, displacement[:, :, None], limit=LIMIT_PX)
    params = np.zeros((len(places), 2, pair.recipe.terms))
    params[:, :, :1] = found.params
    found.stats[:, -1] = Description.WINDOW
    return Fit(params, found.stats, found.status)
