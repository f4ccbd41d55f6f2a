"""Why tracked points end: out of the picture, outside the sand, avalanched."""

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
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
    wide = cv2.dilate(sand, np.ones((2 * BORDER_PX + 1,) * 2, np.uint8))
    fit.status[living & ~outside & ok & (wide[pixel[:, 1], pixel[:, 0]] == 0)] = Status.MASKED
    depth = cv2.distanceTransform(sand, cv2.DIST_L2, 3)
    shallow = depth[pixel[:, 1], pixel[:, 0]] < SURFACE * subset
    decorrelated = np.isin(fit.status, _DECORRELATED)
    fit.status[living & decorrelated & shallow & ~sand.all()] = Status.AVALANCHED
