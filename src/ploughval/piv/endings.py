"""Why tracked points end: out of the picture, outside the sand, avalanched."""

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
_DECORRELATED = (Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER, Status.SHEARED)


def name_failures(
    fit: Fit, place: Floats, sand: NDArray[np.uint8], alive: NDArray[np.intp], subset: int
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
    """
    height, width = sand.shape
    ok = fit.status == Status.OK
    pixel = np.floor(np.nan_to_num(place, nan=-1.0) + 0.5).astype(int)
    outside = ((pixel < 0) | (pixel >= [width, height])).any(axis=1)
    pixel = np.clip(pixel, 0, [width - 1, height - 1])
    living = np.zeros(len(ok), bool)
    living[alive] = True
    fit.status[living & (outside | (fit.status == Status.EDGE))] = Status.OUT_OF_PICTURE
    bare = np.flatnonzero(living & ~outside & ok & (sand[pixel[:, 1], pixel[:, 0]] == 0))
    fit.status[bare[_distance(1 - sand, pixel[bare], BORDER_PX + 1) > BORDER_PX]] = Status.MASKED
    decorrelated = np.flatnonzero(living & np.isin(fit.status, _DECORRELATED))
    reach = SURFACE * subset
    fit.status[decorrelated[_distance(sand, pixel[decorrelated], reach) < reach]] = Status.AVALANCHED


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
