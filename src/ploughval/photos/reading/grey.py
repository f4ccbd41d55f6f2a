"""One rule for grey: ITU-R BT.601 luma, or a single colour channel."""

from typing import Literal, cast

import cv2
import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.uint8] | NDArray[np.uint16]
Channel = Literal["grey", "red", "green", "blue"]

ROWS = 512
"""Rows of a picture that are converted at a time."""


def to_grey(samples: Samples, channel: Channel = "grey") -> Samples:
    """Reduce decoded samples to the one plane that is correlated.

    Parameters
    ----------
    samples : (H, W) or (H, W, 3) uint8 or uint16
        Grey or red, green, blue samples as decoded.
    channel : str
        ``"grey"`` for 0.299 R + 0.587 G + 0.114 B, or one colour. A grey picture is returned as it is.

    Returns
    -------
    (H, W), dtype of `samples`, contiguous
    """
    if samples.ndim == 3 and channel == "grey":
        grey = np.empty(samples.shape[:2], samples.dtype)
        for top in range(0, len(grey), ROWS):  # colours of a large picture are not held twice
            part = cast(Samples, np.ascontiguousarray(samples[top : top + ROWS]))
            grey[top : top + ROWS] = cv2.cvtColor(part, cv2.COLOR_RGB2GRAY)
        return cast(Samples, grey)
    if samples.ndim == 3:
        samples = samples[..., ("red", "green", "blue").index(channel)]
    return cast(Samples, np.ascontiguousarray(samples))
