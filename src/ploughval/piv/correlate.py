"""Displacements of points between two pictures, by subset correlation."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ploughval.axes import Status
from ploughval.errors import CorrelationError
from ploughval.piv.guess import failed_points, spread_by_neighbours
from ploughval.piv.precision import Noise, predict_std, with_correlation
from ploughval.piv.prepare import prepare
from ploughval.piv.refine import refine
from ploughval.piv.refuse import (
    OUTLIER_REACH,
    on_sand,
    refuse_unsure,
    reject_lone,
    reject_outliers,
    reopen,
)
from ploughval.piv.search import mark_ambiguous, search_failed
from ploughval.piv.subsets import (
    Fit,
    Floats,
    Recipe,
    displacement_of,
    gradient_of,
    match,
    params_from,
)
from ploughval.piv.validate import judge_correlation

ZNCC_MIN = 0.7
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
        Pictures; pixels that are not finite are left out.
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
    Zero-mean normalised sum of squared differences, inverse-compositional Gauss-Newton (Baker & Matthews
    2004); docs/theory-correlation.md derives all of it.
    """
    place = check_points(points)
    check_images(reference, current, mask)
    check_settings(noise, shape, workers)
    recipe = make_recipe(subset, order, spline)
    if len(place) == 0:
        return tracks_of(Fit.empty(0, recipe.terms, Status.OK), place, recipe, Noise())
    given = None if guess is None else check_guess(guess, len(place))
    ready = prepare(reference, current, place, recipe, mask=mask, start=given, noise=noise, workers=workers)
    pair, greys, found = ready.pair, ready.greys, ready.noise
    fit = match(pair, place, params_from(ready.start, pair.recipe))
    reopen(pair, fit, place)
    judge_correlation(fit, ZNCC_MIN, pair.noise_variance)
    spread_by_neighbours(pair, fit, place, ZNCC_MIN)
    if failed_points(fit).size > LOST * len(place):
        search_failed(pair, greys, fit, place, ZNCC_MIN)
    found = with_correlation(found, pair, place, fit)
    if shape == "adaptive":
        refine(pair, fit, place, ZNCC_MIN, found, ready.near)
    reopen(pair, fit, place)
    if failed_points(fit).size:
        search_failed(pair, greys, fit, place, ZNCC_MIN)
    reject_outliers(pair, fit, place, ready.near, ZNCC_MIN)
    if ready.repeated:
        mark_ambiguous(greys, fit, place, subset)
    reject_lone(fit, place, ready.near, OUTLIER_REACH * subset)
    if fit.description.any():
        found = with_correlation(found, pair, place, fit)
    refuse_unsure(pair, fit, place, found, ready.near, on_sand(pair, place, mask))
    return tracks_of(fit, place, pair.recipe, found)


def tracks_of(fit: Fit, points: Floats, recipe: Recipe, noise: Noise) -> Tracks:
    """Public result of matched subsets: what is not valid becomes NaN."""
    bad = fit.status != Status.OK
    displacement = displacement_of(fit.params, points, recipe)
    gradient = gradient_of(fit.params) / max(recipe.half, 1)
    std = predict_std(fit, noise)
    for values in (displacement, gradient, std):
        values[bad] = np.nan
    pixels = fit.pixels.astype(np.int64)
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
        raise CorrelationError(
            f"points[{wrong[0]}] is {place[wrong[0]].tolist()}; expected finite px within a million"
        )
    return place


def check_guess(guess: ArrayLike, count: int) -> Floats:
    """A first guess as a finite (N, 2) array, or CorrelationError."""
    moved = np.array(guess, np.float64)
    if moved.shape != (count, 2) or not np.isfinite(moved).all():
        raise CorrelationError(f"guess has the shape {moved.shape}; expected finite ({count}, 2) px")
    return moved


def check_images(reference: Any, current: Any, mask: Any = None) -> None:
    """Raise CorrelationError unless both pictures are grey pictures of one shape."""
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


def check_settings(noise: float | None, shape: str, workers: int) -> None:
    """Raise CorrelationError for settings that mean nothing."""
    if noise is not None and not (np.isfinite(noise) and noise >= 0):
        raise CorrelationError(f"noise is {noise!r}; expected grey levels of at least 0, or None")
    if shape not in ("adaptive", "fixed"):
        raise CorrelationError(f"shape is {shape!r}; expected 'adaptive' or 'fixed'")
    if not (isinstance(workers, int | np.integer) and workers >= 1):
        raise CorrelationError(f"workers is {workers!r}; expected a number of threads, at least 1")


def make_recipe(subset: int, order: int, spline: int) -> Recipe:
    """Checked settings of the subsets, or CorrelationError."""
    if not (isinstance(subset, int | np.integer) and 5 <= subset <= 401 and subset % 2 == 1):
        raise CorrelationError(f"subset is {subset!r}; expected an odd number of px from 5 to 401")
    if order not in (0, 1, 2):
        raise CorrelationError(f"order is {order!r}; expected 0, 1 or 2")
    if spline not in (3, 5):
        raise CorrelationError(f"spline is {spline!r}; expected 3 or 5")
    return Recipe(int(subset), int(order), int(spline))
