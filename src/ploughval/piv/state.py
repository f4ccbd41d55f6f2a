"""What a tracker remembers of every point."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ploughval.piv.movement import UNMOVED, CameraMovement
from ploughval.piv.subsets import Floats


@dataclass(frozen=True, slots=True)
class FramePoints:
    """Tracked points in one frame.

    Attributes
    ----------
    position_px : (N, 2) float, px, NaN where not measured
    std_px : (N,) float, px, standard deviation of a coordinate, with what the renewed references gathered
    zncc : (N,) float, NaN where nothing was correlated
    status : (N,) int8, :class:`ploughval.axes.Status`
    """

    position_px: Floats
    std_px: Floats
    zncc: Floats
    status: NDArray[np.int8]


@dataclass(slots=True)
class State:
    """What is known of N points after a frame."""

    start: Floats  # (N, 2) in frame 0
    position: Floats  # (N, 2) last measured, or where a point that failed is presumed to be
    last: Floats  # (N, 2) last measured
    motion: Floats  # (N, 2) px a frame, last measured
    reference: NDArray[np.intp]  # (N,) frame of the reference picture
    params: Floats  # (N, 2, terms) from that reference
    first_zncc: Floats  # (N,) correlation when the reference was taken, NaN before the first frame
    failures: NDArray[np.intp]  # (N,) frames in a row; beyond RETRIES: lost
    window: NDArray[np.intp]  # (N,) number of the small window, WHOLE for a whole subset
    worn: NDArray[np.intp]  # (N,) frames in a row in which its correlation was low for the reference
    share: Floats  # (N,) correlation over what was usual in the last frame
    past: list[Floats]  # positions (N, 2) after the last frames, NaN: failed
    ended: NDArray[np.int8]  # (N,) why a point was given up
    shallow: NDArray[np.bool_]  # (N,) whether a point that fails lay by the surface before
    sand: NDArray[np.uint8]  # (H, W) of the last picture of use
    missed: int = 0  # frames skipped, or of no use, since `grey` was seen
    unused: int = 0  # pictures of no use since then
    camera: CameraMovement = UNMOVED  # since the first picture
    camera_before: CameraMovement = UNMOVED  # the same in the last one of use
    used: int = 0  # frame of the last picture of use, whose `grey` and `sand` these are
    grey: NDArray[np.uint8] = field(default_factory=lambda: np.zeros((1, 1), np.uint8))
