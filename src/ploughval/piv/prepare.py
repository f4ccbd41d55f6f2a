"""Two pictures made ready to be matched: planes, coefficients, first guesses, noise."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.piv.guess import Greys, flow_at, to_8bit
from ploughval.piv.interpolate import (
    filtered_slope,
    plain_slope,
    planes_of,
    spline_coefficients,
    without_product,
)
from ploughval.piv.precision import Noise, judge_noise, unjudged
from ploughval.piv.search import repeats
from ploughval.piv.subsets import ALL_SEEN, Floats, Pair, Recipe
from ploughval.piv.validate import neighbours_of


@dataclass(frozen=True, slots=True)
class Prepared:
    """A pair that knows its noise, and what its points need.

    Attributes
    ----------
    pair : Pair
    greys : Greys
    start : (N, 2) float, px, first guesses
    noise : Noise
    near : (N, NEIGHBOURS) int, neighbours of all points
    repeated : bool, whether the texture repeats itself somewhere
    """

    pair: Pair
    greys: Greys
    start: Floats
    noise: Noise
    near: NDArray[np.intp]
    repeated: bool


def side_by_side(calls: Sequence[Callable[[], Any]], workers: int) -> list[Any]:
    """Results of calls, in their order, in as many threads as allowed."""
    if workers == 1:
        return [call() for call in calls]
    with ThreadPoolExecutor(workers) as pool:
        return [future.result() for future in [pool.submit(call) for call in calls]]


def prepare(
    reference: NDArray[np.generic],
    current: NDArray[np.generic],
    points: Floats,
    recipe: Recipe,
    *,
    mask: NDArray[np.bool_] | None,
    start: Floats | None,
    noise: float | None,
    workers: int,
) -> Prepared:
    """Everything that a match needs; ``start``: first guesses (N, 2) px, where the user has them."""
    first, usable = whole_grey(reference)
    second, seen = whole_grey(current)
    if mask is not None:
        sand = np.ascontiguousarray(np.asarray(mask) != 0, np.uint8)
        usable = sand if usable is ALL_SEEN else usable * sand
    elif usable is ALL_SEEN:
        usable = np.ones(first.shape, np.uint8)
    greys = Greys(to_8bit(first), to_8bit(second, first))
    value, spline = np.ascontiguousarray(first, np.float32), recipe.spline
    # The long ones first: what two threads do ends about together.
    flow, coefficients, plain_x, plain_y, near, repeated = side_by_side(
        [
            lambda: flow_at(greys, points) if start is None else start,
            lambda: spline_coefficients(second, spline),
            lambda: plain_slope(value, spline, "x"),
            lambda: plain_slope(value, spline, "y"),
            lambda: neighbours_of(points),
            lambda: repeats(greys, points, recipe.subset),
        ],
        workers,
    )
    plain = without_product(value, plain_x, plain_y)
    pair = Pair(plain, usable, coefficients, seen, recipe, workers)
    found, slopes = judge_noise(pair, points, flow, noise) or unjudged(noise)
    slope_x, slope_y = side_by_side(
        [partial(filtered_slope, slope, slopes) for slope in (plain_x, plain_y)], workers
    )
    pair = replace(
        pair,
        reference=planes_of(plain, slope_x, slope_y),
        recipe=replace(recipe, slopes=slopes),
        noise_variance=found.variance,
    )
    return Prepared(pair, greys, flow, found, near, repeated)


def whole_grey(image: NDArray[np.generic]) -> tuple[NDArray[np.generic], NDArray[np.uint8]]:
    """The picture with its NaN filled for the filters, and what of it may be used; ALL_SEEN: everything."""
    if image.dtype.kind != "f" or np.isfinite(image).all():
        return image, ALL_SEEN
    finite = np.isfinite(image)
    filled = np.where(finite, image, np.median(image[finite]) if finite.any() else 0.0)
    # The prefilter spreads what was filled in; three pixels away a 1/10 of it is left.
    near = cv2.erode(finite.astype(np.uint8), np.ones((7, 7), np.uint8))
    return filled.astype(np.float32), np.ascontiguousarray(near, np.uint8)
