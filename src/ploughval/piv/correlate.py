"""Displacements of points between two pictures, by subset correlation."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ploughval.axes import Status
from ploughval.errors import CorrelationError
from ploughval.piv.guess import Greys, failed_points, flow_at, spread_by_neighbours, to_8bit
from ploughval.piv.interpolate import filtered, plain_planes, spline_coefficients
from ploughval.piv.precision import Noise, judge_noise, predict_std, with_correlation
from ploughval.piv.refine import mismatch_px, noise_level, refine
from ploughval.piv.search import mark_ambiguous, search_failed
from ploughval.piv.subsets import (
    ALL_SEEN,
    Description,
    Fit,
    Floats,
    Pair,
    Recipe,
    centres_of,
    displacement_of,
    gradient_of,
    match,
    params_from,
)
from ploughval.piv.validate import NEIGHBOURS, gather, judge_correlation, neighbours_of, outliers

ZNCC_MIN = 0.7
MOST_STD_PX = 0.5
"""A vector of a greater standard deviation is no measurement."""
MOST_MISMATCH_PX = 0.4
"""Residuals beyond noise may answer to so much motion."""
LONE = NEIGHBOURS - 1
"""A vector with so many failed ones among its neighbours is not believed."""
UNCORRELATED = (Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER, Status.AMBIGUOUS)
MIXED = 4.0
"""Residual variance over that of undisturbed subsets beyond which that is asked: less may be chance."""
OUTLIER_REACH = 3.0
"""A vector is only judged against others within so many subsets."""
LOST = 0.05
"""When more points than this share have failed, they are searched for before bands are looked for."""


@dataclass(frozen=True, slots=True)
class Tracks:
    """Displacements of N points between two pictures; NaN where not valid, and status says why."""

    points: Floats
    """Points in the reference, (N, 2) px."""
    displacement: Floats
    """(N, 2) px, x right and y down."""
    gradient: Floats
    """(N, 2, 2), [displacement axis, place axis]."""
    std: Floats
    """Predicted standard deviation, (N, 2) px."""
    zncc: Floats
    """Zero-mean normalised correlation, (N,), also of vectors that are not valid."""
    pixels: NDArray[np.int64]
    """Valid pixels of each subset, (N,)."""
    description: NDArray[np.int8]
    """How each subset was described, :class:`ploughval.piv.subsets.Description`, (N,)."""
    status: NDArray[np.int8]
    """Reason code :class:`ploughval.axes.Status`, (N,)."""

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Whether each displacement may be used, (N,)."""
        return np.asarray(self.status == Status.OK)


def correlate(  # noqa: PLR0913
    reference: NDArray[np.generic],
    current: NDArray[np.generic],
    points: ArrayLike,
    *,
    subset: int = 31,
    order: int = 1,
    spline: int = 5,
    guess: ArrayLike | None = None,
    mask: NDArray[np.bool_] | None = None,
    noise: float | None = None,
    shape: Literal["adaptive", "fixed"] = "adaptive",
    workers: int = 1,
) -> Tracks:
    """Displacement of points between two pictures.

    Parameters
    ----------
    reference, current : (H, W) uint8, uint16 or float
        Pictures.
    points : (N, 2) float, px
        Points in the reference, x first.
    subset : int, px
        Side of the square subsets, odd.
    order : 0, 1 or 2
        Order of the shape function.
    spline : 3 or 5
        Degree of the interpolating B-spline.
    guess : (N, 2) float, px, optional
        First guess; absent: found from the pictures.
    mask : (H, W) bool, optional
        Pixels of the reference that may be used (sand).
    noise : float, grey levels, optional
        Noise of one picture; absent: from the residuals.
    shape : "adaptive" or "fixed"
        Adaptive: where a subset of this side and order does not describe the motion, richer descriptions are
        tried (second order, smaller, cut along a shear band); fixed: all subsets are as given.
    workers : int
        Threads; the numbers do not depend on it.

    Returns
    -------
    Tracks

    Raises
    ------
    CorrelationError
        Shapes, types or settings that cannot be correlated.

    Notes
    -----
    Zero-mean normalised sum of squared differences, inverse-compositional Gauss-Newton.
    """
    place = check_points(points)
    check_images(reference, current, mask)
    recipe = make_recipe(subset, order, spline)
    if len(place) == 0:
        return tracks_of(Fit.empty(0, recipe.terms, Status.OK), place, recipe, Noise())
    first, usable = whole_grey(reference)
    second, seen = whole_grey(current)
    if mask is not None:
        usable = np.ascontiguousarray(mask, np.uint8) if usable is ALL_SEEN else usable * (mask != 0)
    greys = Greys(to_8bit(first), to_8bit(second, first))
    pair, start = prepare(first, second, usable, seen, greys, place, recipe, workers, guess)
    noise_found, slopes = judge_noise(pair, place, start, noise)
    recipe = replace(recipe, slopes=slopes)
    planes = filtered(pair.reference, spline, slopes)
    pair = replace(pair, reference=planes, recipe=recipe, noise_variance=noise_found.variance)
    fit = match(pair, place, params_from(start, recipe))
    reopen(fit, place, reference.shape, recipe)
    judge_correlation(fit, ZNCC_MIN, pair.noise_variance)
    spread_by_neighbours(pair, fit, place, ZNCC_MIN)
    if failed_points(fit).size > LOST * len(place):
        search_failed(pair, greys, fit, place, ZNCC_MIN)
    near = neighbours_of(place)
    noise_found = with_correlation(noise_found, pair, place, fit)
    if shape == "adaptive":
        refine(pair, fit, place, ZNCC_MIN, noise_found, near)
    if failed_points(fit).size:
        search_failed(pair, greys, fit, place, ZNCC_MIN)
    reject_outliers(pair, fit, place, near)
    mark_ambiguous(greys, fit, place, subset)
    reject_lone(fit, place, near, OUTLIER_REACH * subset)
    if fit.description.any():
        noise_found = with_correlation(noise_found, pair, place, fit)
    close(fit, place, recipe, noise_found, mask, seen, reference.shape)
    return tracks_of(fit, place, recipe, noise_found)


def reopen(fit: Fit, points: Floats, shape: tuple[int, ...], recipe: Recipe) -> None:
    """Let subsets that a first guess led out of the picture be tried again, in place."""
    half = recipe.half
    inside = ((points >= half) & (points <= np.array(shape[::-1]) - 1.0 - half)).all(axis=1)
    fit.status[inside & (fit.status == Status.EDGE)] = Status.NOT_CONVERGED


def close(
    fit: Fit,
    points: Floats,
    recipe: Recipe,
    noise: Noise,
    mask: NDArray[np.bool_] | None,
    seen: NDArray[np.uint8],
    shape: tuple[int, ...],
) -> None:
    """Refuse, in place, what cannot be vouched for although it matched.

    Points on pixels that may not be used, points that have left the picture, vectors that texture does not
    fix to ``MOST_STD_PX``, and vectors whose residuals say that ``MOST_MISMATCH_PX`` of motion is not
    described: subsets in which two things move.
    """
    arrived = points + displacement_of(fit.params, points, recipe)
    inside = ((arrived >= -0.5) & (arrived <= np.array(shape[::-1]) - 0.5)).all(axis=1)
    good = fit.status == Status.OK
    if mask is not None:
        fit.status[good & ~on_mask(mask, points)] = Status.MASKED
    fit.status[good & ~inside] = Status.EDGE
    loose = (predict_std(fit, noise) > MOST_STD_PX).any(axis=1)
    fit.status[(fit.status == Status.OK) & loose] = Status.FLAT
    level = noise_level(fit)
    mixed = (mismatch_px(fit, level) > MOST_MISMATCH_PX) & (fit.stats[:, 1] > MIXED * level)
    mixed &= ~np.isin(fit.description, (Description.BAND, Description.SIDE))
    fit.status[(fit.status == Status.OK) & mixed] = Status.LOW_CORRELATION
    if seen.size > 1:  # what the current picture does not show is no edge
        fit.status[inside & (fit.status == Status.EDGE)] = Status.MASKED


def prepare(  # noqa: PLR0913
    first: NDArray[np.generic],
    second: NDArray[np.generic],
    usable: NDArray[np.uint8],
    seen: NDArray[np.uint8],
    greys: Greys,
    points: Floats,
    recipe: Recipe,
    workers: int,
    guess: ArrayLike | None,
) -> tuple[Pair, Floats]:
    """Planes, coefficients and first guesses (N, 2) px, side by side where there are threads for it."""
    given = None if guess is None else check_guess(guess, len(points))
    if given is None and workers > 1:
        with ThreadPoolExecutor(1) as pool:
            flow = pool.submit(flow_at, greys, points)
            planes, coefficients = (
                plain_planes(first, recipe.spline),
                spline_coefficients(second, recipe.spline),
            )
            start = flow.result()
    else:
        planes, coefficients = plain_planes(first, recipe.spline), spline_coefficients(second, recipe.spline)
        start = flow_at(greys, points) if given is None else given
    if usable is ALL_SEEN:
        usable = np.ones(first.shape, np.uint8)
    return Pair(planes, usable, coefficients, seen, recipe, workers), start


def whole_grey(image: NDArray[np.generic]) -> tuple[NDArray[np.generic], NDArray[np.uint8]]:
    """The picture with its NaN filled for the filters, and what of it may be used; ALL_SEEN: everything."""
    if image.dtype.kind != "f" or np.isfinite(image).all():
        return image, ALL_SEEN
    finite = np.isfinite(image)
    filled = np.where(finite, image, np.median(image[finite]) if finite.any() else 0.0)
    # The prefilter spreads what was filled in; three pixels away a 1/10 of it is left.
    near = cv2.erode(finite.astype(np.uint8), np.ones((7, 7), np.uint8))
    return filled.astype(np.float32), np.ascontiguousarray(near, np.uint8)


def on_mask(mask: NDArray[np.bool_], points: Floats) -> NDArray[np.bool_]:
    """Whether the pixel of each point may be used, (N,); not outside the picture."""
    column, row = centres_of(points).T
    inside = (column >= 0) & (row >= 0) & (column < mask.shape[1]) & (row < mask.shape[0])
    out = np.zeros(len(points), bool)
    out[inside] = np.asarray(mask)[row[inside], column[inside]] != 0
    return out


def reject_outliers(pair: Pair, fit: Fit, points: Floats, near: NDArray[np.intp]) -> None:
    """Mark vectors that disagree with their neighbours, after one more try from the neighbours' motion."""
    reach = OUTLIER_REACH * pair.recipe.subset
    for _ in range(2):
        moved = np.where((fit.status == Status.OK)[:, None], fit.params[:, :, 0], np.nan)
        wrong = outliers(points, moved, reach_px=reach, near=near)
        if not wrong.any():
            return
        fit.status[wrong] = Status.OUTLIER
        spread_by_neighbours(pair, fit, points, ZNCC_MIN, rounds=1)
    moved = np.where((fit.status == Status.OK)[:, None], fit.params[:, :, 0], np.nan)
    fit.status[outliers(points, moved, reach_px=reach, near=near)] = Status.OUTLIER


def reject_lone(fit: Fit, points: Floats, near: NDArray[np.intp], reach_px: float) -> None:
    """Mark vectors all about which others failed to correlate: chance fits one in many. In place."""
    distance = np.linalg.norm(gather(points, near) - points[:, None], axis=2)
    failed = np.isin(fit.status, UNCORRELATED).astype(float)
    around = np.where(distance <= reach_px, gather(failed, near), 0.0).sum(axis=1)
    fit.status[(fit.status == Status.OK) & (around >= LONE)] = Status.OUTLIER


def tracks_of(fit: Fit, points: Floats, recipe: Recipe, noise: Noise) -> Tracks:
    """Public result of matched subsets: what is not valid becomes NaN."""
    bad = fit.status != Status.OK
    displacement = displacement_of(fit.params, points, recipe)
    gradient = gradient_of(fit.params) / max(recipe.half, 1)
    std = predict_std(fit, noise)
    for values in (displacement, gradient, std):
        values[bad] = np.nan
    pixels = fit.stats[:, 4].astype(np.int64)
    return Tracks(
        points, displacement, gradient, std, fit.zncc.copy(), pixels, fit.description, fit.status.copy()
    )


def check_points(points: ArrayLike) -> Floats:
    """Points as an (N, 2) float array, or CorrelationError."""
    place = np.array(points, np.float64)
    if place.size == 0:
        return np.zeros((0, 2))
    if place.ndim != 2 or place.shape[1] != 2:
        raise CorrelationError(f"points has the shape {place.shape}; expected (N, 2), x first, in px")
    wrong = np.flatnonzero(~np.isfinite(place).all(axis=1) | (np.abs(place) > 1e6).any(axis=1))
    if wrong.size:
        raise CorrelationError(f"points[{wrong[0]}] is {place[wrong[0]].tolist()}; expected finite px")
    return place


def check_guess(guess: ArrayLike, count: int) -> Floats:
    """A first guess as a finite (N, 2) array, or CorrelationError."""
    moved = np.array(guess, np.float64)
    if moved.shape != (count, 2) or not np.isfinite(moved).all():
        raise CorrelationError(f"guess has the shape {moved.shape}; expected finite ({count}, 2) px")
    return moved


def check_images(reference: Any, current: Any, mask: Any = None) -> None:
    """Raise CorrelationError unless both pictures are finite grey pictures of one shape."""
    for name, image in (("reference", reference), ("current", current)):
        if not isinstance(image, np.ndarray) or image.ndim != 2 or min(image.shape) < 16:
            shape = getattr(image, "shape", type(image).__name__)
            raise CorrelationError(
                f"{name} is {shape}; expected a grey picture (H, W) of at least 16 x 16 px"
            )
        if image.dtype.kind not in "uif":
            raise CorrelationError(f"{name} has the type {image.dtype}; expected uint8, uint16 or float")
    if reference.shape != current.shape:
        raise CorrelationError(
            f"reference is {reference.shape} and current {current.shape}; expected one shape"
        )
    if mask is not None and np.shape(mask) != reference.shape:
        raise CorrelationError(f"mask is {np.shape(mask)}; expected the pictures' shape {reference.shape}")


def make_recipe(subset: int, order: int, spline: int) -> Recipe:
    """Checked settings of the subsets, or CorrelationError."""
    if not (isinstance(subset, int | np.integer) and 5 <= subset <= 401 and subset % 2 == 1):
        raise CorrelationError(f"subset is {subset!r}; expected an odd number of px from 5 to 401")
    if order not in (0, 1, 2):
        raise CorrelationError(f"order is {order!r}; expected 0, 1 or 2")
    if spline not in (3, 5):
        raise CorrelationError(f"spline is {spline!r}; expected 3 or 5")
    return Recipe(int(subset), int(order), int(spline))
