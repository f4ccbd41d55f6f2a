"""Why tracked points end: out of the picture, outside the sand, avalanched, buried."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.held import Box
from ploughval.piv.subsets import Fit, Floats

SURFACE = 1.5
"""Sand that decorrelates within so many subsets of the surface or the blade has avalanched."""
BORDER_PX = 3
"""A point may stand this far outside the sand that was found."""
ENDS = (Status.MASKED, Status.BURIED, Status.SHEARED, Status.AVALANCHED, Status.OUT_OF_PICTURE)
"""Reasons that a point which is given up keeps; of the others it is lost."""
_DECORRELATED = (Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER, Status.SHEARED)


@dataclass(frozen=True, slots=True)
class Before:
    """What is known of N points from the pictures before.

    Attributes
    ----------
    place : (N, 2) float, px, where each was last measured
    sand : (H, W) uint8, sand of the last picture
    fresh : (N,) bool, points that were measured in it
    shallow : (N,) bool, whether each lay by the surface when it was last measured; set for fresh points
    """

    place: Floats
    sand: NDArray[np.uint8]
    fresh: NDArray[np.bool_]
    shallow: NDArray[np.bool_]


def name_failures(
    fit: Fit,
    place: Floats,
    sand: NDArray[np.uint8],
    alive: NDArray[np.intp],
    subset: int,
    before: Before,
) -> None:
    """Set the status of living points that ended, in place.

    Parameters
    ----------
    fit : Fit
        What was matched in this frame.
    place : (N, 2) float, px
        Where the points are, or are presumed to be.
    sand : (H, W) uint8
        Sand of this frame.
    alive : (A,) int
        Points that are not lost.
    subset : int, px
        Side of a whole subset.
    before : Before
        Tells sand that was by the surface and now is not: what has avalanched lies on it.
    """
    height, width = sand.shape
    ok = fit.status == Status.OK
    pixel = np.floor(np.nan_to_num(place, nan=-1.0) + 0.5).astype(int)
    outside = ((pixel < 0) | (pixel >= [width, height])).any(axis=1)
    pixel = np.clip(pixel, 0, [width - 1, height - 1])
    last = np.clip(np.floor(before.place + 0.5).astype(int), 0, [width - 1, height - 1])
    living = np.zeros(len(ok), bool)
    living[alive] = True
    fit.status[living & (outside | (fit.status == Status.EDGE))] = Status.OUT_OF_PICTURE
    bare = np.flatnonzero(living & ~outside & ok & (sand[pixel[:, 1], pixel[:, 0]] == 0))
    fit.status[bare[_distance(1 - sand, pixel[bare], BORDER_PX + 1) > BORDER_PX]] = Status.MASKED
    decorrelated = np.flatnonzero(living & np.isin(fit.status, _DECORRELATED))
    reach = SURFACE * subset
    shallow = _distance(sand, pixel[decorrelated], reach) < reach
    new = decorrelated[before.fresh[decorrelated]]
    before.shallow[new] = _distance(before.sand, last[new], reach) < reach
    fit.status[decorrelated[shallow]] = Status.AVALANCHED
    fit.status[decorrelated[before.shallow[decorrelated] & ~shallow]] = Status.BURIED


def _distance(mask: NDArray[np.uint8], pixel: NDArray[np.intp], reach: float) -> Floats:
    """Distance (K,) px from pixels of a mask (H, W) to the nearest one outside it; right up to ``reach``."""
    if len(pixel) == 0:
        return np.zeros(0)
    box = Box.about(pixel.astype(float), reach + 2, mask.shape)
    part = np.ascontiguousarray(mask[box.part])
    if part.all():
        return np.full(len(pixel), np.inf)
    near = cv2.distanceTransform(part, cv2.DIST_L2, 3)
    return np.asarray(near[pixel[:, 1] - box.y0, pixel[:, 0] - box.x0], np.float64)
