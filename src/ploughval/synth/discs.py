"""Discs painted exactly: the share of each pixel that a disc covers, in closed form."""

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def disc_cover(shape: tuple[int, int], centre_px: tuple[float, float], radius_px: float) -> Floats:
    """Share of each pixel that a disc covers, exact to rounding: (H, W) float.

    Parameters
    ----------
    shape : (int, int), px
        Height and width of the picture.
    centre_px : (float, float), px
        Right and down; pixel centres at integers. The disc may reach beyond the picture.
    radius_px : float, px
        Of the disc.

    >>> round(float(disc_cover((9, 9), (4.2, 3.9), 2.5).sum() / (math.pi * 2.5**2)), 12)
    1.0
    """
    cover = np.zeros(shape)
    spans = [
        (max(math.floor(c - radius_px - 1), 0), min(math.ceil(c + radius_px + 2), size))
        for c, size in zip(centre_px, reversed(shape), strict=True)
    ]
    (left, right), (top, bottom) = spans
    if left >= right or top >= bottom:
        return cover
    x = (np.arange(left, right + 1) - 0.5 - centre_px[0]) / radius_px
    y = (np.arange(top, bottom + 1) - 0.5 - centre_px[1]) / radius_px
    corner = _area_below(x[None, :], y[:, None]) * radius_px**2
    cover[top:bottom, left:right] = np.diff(np.diff(corner, axis=0), axis=1).clip(0.0, 1.0)
    return cover


def _area_below(x: NDArray[np.floating], y: NDArray[np.floating]) -> Floats:
    """Area of the unit disc left of x and below y: the integral over X of its height there."""
    x, y = np.clip(x, -1.0, 1.0), np.clip(y, -1.0, 1.0)
    reach = np.sqrt(1.0 - y * y)
    low, high = np.minimum(x, -reach), np.clip(x, -reach, reach)
    whole = np.where(y > 0, 2 * (_half(low) - _half(-1.0) + _half(np.maximum(x, reach)) - _half(reach)), 0.0)
    return np.asarray(whole + y * (high + reach) + _half(high) - _half(-reach))


def _half(x: NDArray[np.floating] | float) -> Floats:
    """Primitive of sqrt(1 - x^2)."""
    x = np.clip(x, -1.0, 1.0)
    return np.asarray((x * np.sqrt(1.0 - x * x) + np.arcsin(x)) / 2)
