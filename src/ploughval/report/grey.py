"""Greys of photographs for the eye: eight bits, stretched; and what pictures use of a calibration."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

TAILS = (0.5, 99.5)  # percentiles between which greys are stretched

Grey = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]
Byte = NDArray[np.uint8]


class ToPixels(Protocol):
    """The part of a calibration that figures use."""

    def to_px(self, mm: Any) -> NDArray[np.float64]:
        """World points (..., 2), mm, as image points (..., 2), px."""


def eight_bit(image: Grey) -> Byte:
    """Greys of any depth stretched between their 0.5 and 99.5 percentiles, (H, W) uint8."""
    low, high = np.percentile(np.asarray(image, dtype=np.float32)[::4, ::4], TAILS)
    return stretched(image, float(low), float(high))


def stretched(image: Grey, low: float, high: float) -> Byte:
    """Greys with two levels put to black and white, (H, W) uint8."""
    scaled = (np.asarray(image, dtype=np.float32) - low) * (255.0 / max(high - low, 1.0))
    grey8: Byte = np.clip(scaled, 0, 255).astype(np.uint8)
    return grey8
