"""B-spline interpolation: prefilter, basis polynomials, derivative taps (Unser, Aldroubi & Eden 1993)."""

from functools import lru_cache
from math import comb, factorial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import spline_filter

PAD = 16
"""Mirrored coefficients kept around the picture, px: the reach of any tap, and the rest of a vector of 8."""


def spline_coefficients(image: NDArray[np.generic], spline: int) -> NDArray[np.float32]:
    """Coefficients of the B-spline that interpolates an image, mirrored at the border.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float
        Grey levels.
    spline : 3 or 5
        Degree of the spline.

    Returns
    -------
    (H + 2 PAD, W + 2 PAD) float32
        Coefficient of pixel (row, column) at ``[row + PAD, column + PAD]``.
    """
    coefficients = spline_filter(
        np.asarray(image, np.float32), order=spline, output=np.float32, mode="mirror"
    )
    return np.ascontiguousarray(np.pad(coefficients, PAD, mode="reflect"))


@lru_cache(maxsize=4)
def basis_polynomials(spline: int) -> NDArray[np.float64]:
    """Polynomials of the ``spline + 1`` basis functions that meet between two nodes.

    Returns
    -------
    (spline + 1, spline + 1) float64
        Row k, column j: factor of t**j for the node at ``floor(x) - spline // 2 + k``, t = x - floor(x).
    """
    degree = spline
    table = np.zeros((degree + 1, degree + 1))
    for k in range(degree + 1):
        # beta(t + s) with s the distance of the node, as a sum of truncated powers (Unser 1999, eq. 11).
        start = degree // 2 - k + (degree + 1) / 2
        for j in range(degree + 2):
            shift = start - j
            if shift < 0:
                break
            factor = (-1) ** j * comb(degree + 1, j) / factorial(degree)
            for power in range(degree + 1):
                table[k, power] += factor * comb(degree, power) * shift ** (degree - power)
    table.setflags(write=False)
    return table


def node_taps(spline: int, smooth_px: float = 0.0) -> NDArray[np.float64]:
    """Weights that turn coefficients into value and slope at a pixel, for correlation (not convolution).

    Slopes may be taken from a picture smoothed by a Gaussian: the values stay as they are.

    Returns
    -------
    (4, 2 reach + 1) float64
        Value; smoothing across the slope; smoothed slope (per px); slope without smoothing.
    """
    table = basis_polynomials(spline)
    value, slope = table[:-1, 0], table[:-1, 1]
    reach = int(np.ceil(3.0 * smooth_px))
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(smooth_px, 1e-9)) ** 2)
    bell /= bell.sum()
    plain, flank = np.pad(value, reach), np.pad(slope, reach)
    return np.stack([plain, np.convolve(value, bell), np.convolve(slope, bell), flank])
