"""What is refused although it matched: outliers, lone vectors, and what cannot be vouched for."""

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.curvature import miss_of_neighbours
from ploughval.piv.guess import carried_on, spread_by_neighbours
from ploughval.piv.precision import Noise, predict_std
from ploughval.piv.refine import mismatch_px, noise_level
from ploughval.piv.subsets import Description, Fit, Floats, Pair, centres_of, displacement_of
from ploughval.piv.validate import NEIGHBOURS, distance_to, gather, outliers

MOST_STD_PX = 0.5
"""A vector of a greater standard deviation is no measurement."""
MOST_MISMATCH_PX = 0.4
"""Residuals beyond noise may answer to so much motion."""
LONE = NEIGHBOURS - 1
"""A vector with so many failed ones among its neighbours is not believed."""
UNCORRELATED = (Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER, Status.AMBIGUOUS)
MIXED = 4.0
"""Residual variance over that of undisturbed subsets beyond which that is asked: less may be chance."""
ASTRAY_PX = 0.3
"""What two things move in also disagrees with its neighbours by so much."""
HOLE_PX = 4
"""A point in a hole has usable pixels within this distance, or is masked; a hole is widened by 3 px."""
BETWEEN_PX = 0.3
"""Beside a band a vector may lie so far beyond all its neighbours."""
OUTLIER_REACH = 3.0
"""A vector is only judged against others within so many subsets."""


def reopen(pair: Pair, fit: Fit, points: Floats) -> None:
    """Let subsets that a first guess led out of the picture be tried again, in place.

    Those that go with their valid neighbours out of it are left alone.
    """
    half, size = pair.recipe.half, np.array(pair.mask.shape[::-1]) - 1.0
    edge = np.flatnonzero((fit.status == Status.EDGE) & _inside(points, half, size))
    valid = np.flatnonzero(fit.status == Status.OK)
    led = carried_on(points[valid], fit.params[valid], points[edge], half)[:, :, 0]
    stays = ~np.isfinite(led).all(axis=1) | _inside(points[edge] + led, half, size)
    fit.status[edge[stays]] = Status.NOT_CONVERGED


def _inside(places: Floats, margin: float, size: Floats) -> NDArray[np.bool_]:
    """Whether places (N, 2) lie inside a picture with a margin to spare."""
    return np.asarray(((places >= margin) & (places <= size - margin)).all(axis=1))


def reject_outliers(pair: Pair, fit: Fit, points: Floats, near: NDArray[np.intp], zncc_min: float) -> None:
    """Mark vectors that disagree with their neighbours, after one more try from the neighbours' motion."""
    for _ in range(2):
        wrong = _disagreeing(pair, fit, points, near)
        if not wrong.any():
            return
        fit.status[wrong] = Status.OUTLIER
        spread_by_neighbours(pair, fit, points, zncc_min, rounds=1)
    fit.status[_disagreeing(pair, fit, points, near)] = Status.OUTLIER


def _disagreeing(pair: Pair, fit: Fit, points: Floats, near: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Outliers among the valid vectors, (N,).

    One that a band is known beside may be like few of its neighbours; it must lie between them.
    """
    moved = np.where((fit.status == Status.OK)[:, None], fit.params[:, :, 0], np.nan)
    wrong = outliers(points, moved, reach_px=OUTLIER_REACH * pair.recipe.subset, near=near)
    banded = np.flatnonzero(wrong & np.isin(fit.description, (Description.BAND, Description.SIDE)))
    around = gather(moved, near[banded])
    low = np.fmin.reduce(around, axis=1) - BETWEEN_PX
    high = np.fmax.reduce(around, axis=1) + BETWEEN_PX
    wrong[banded] = ~((moved[banded] >= low) & (moved[banded] <= high)).all(axis=1)
    return wrong


def reject_lone(fit: Fit, points: Floats, near: NDArray[np.intp], reach_px: float) -> None:
    """Mark vectors all about which others failed to correlate: chance fits one in many. In place."""
    failed = np.isin(fit.status, UNCORRELATED).astype(float)
    around = np.where(distance_to(points, near) <= reach_px, gather(failed, near), 0.0).sum(axis=1)
    fit.status[(fit.status == Status.OK) & (around >= LONE)] = Status.OUTLIER


def refuse_unsure(
    pair: Pair,
    fit: Fit,
    points: Floats,
    noise: Noise,
    near: NDArray[np.intp],
    usable: NDArray[np.bool_],
) -> None:
    """Mark, in place, what cannot be vouched for although it matched.

    Points on pixels that may not be used, points that have left the picture, vectors that texture does not
    fix to ``MOST_STD_PX``, and vectors whose residuals say that ``MOST_MISMATCH_PX`` of motion is not
    described and whose neighbours say so as well: subsets in which two things move. ``near``
    (N, NEIGHBOURS): neighbours; ``usable`` (N,): whether a point's pixel may be used.
    """
    arrived = points + displacement_of(fit.params, points, pair.recipe)
    last = np.array(pair.mask.shape[::-1]) - 0.5
    inside = ((arrived >= -0.5) & (arrived <= last)).all(axis=1)
    outside = ~((points >= -0.5) & (points < last)).all(axis=1)
    good = fit.status == Status.OK
    fit.status[good & ~usable] = Status.MASKED
    fit.status[good & (~inside | outside)] = Status.EDGE
    loose = (predict_std(fit, noise) > MOST_STD_PX).any(axis=1)
    fit.status[(fit.status == Status.OK) & loose] = Status.FLAT
    level = noise_level(fit)
    mixed = (mismatch_px(fit, level) > MOST_MISMATCH_PX) & (fit.residual > MIXED * level)
    mixed &= ~np.isin(fit.description, (Description.BAND, Description.SIDE))
    mixed &= fit.status == Status.OK
    if mixed.any():
        astray = np.abs(miss_of_neighbours(pair, fit, points, near)) > ASTRAY_PX
        fit.status[mixed & astray.any(axis=1)] = Status.LOW_CORRELATION
    if pair.seen.size > 1:  # what the current picture does not show is no edge
        fit.status[inside & (fit.status == Status.EDGE)] = Status.MASKED


def on_sand(pair: Pair, points: Floats, mask: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    """Whether the pixel of each point may be used, (N,); not outside the picture.

    A pixel that is not finite does not count against a point when others by its side are.
    """
    wide = np.ones((2 * HOLE_PX + 1,) * 2, np.uint8)
    usable = pair.mask if pair.mask.all() else np.asarray(cv2.dilate(pair.mask, wide), np.uint8)
    if mask is not None:
        usable = usable * (np.asarray(mask) != 0)
    column, row = centres_of(points).T
    inside = (column >= 0) & (row >= 0) & (column < usable.shape[1]) & (row < usable.shape[0])
    out = np.zeros(len(points), bool)
    out[inside] = usable[row[inside], column[inside]] != 0
    return out
