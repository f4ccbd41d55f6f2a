"""B-spline interpolation: prefilter, basis polynomials, slopes (Unser, Aldroubi & Eden 1993)."""

from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from math import comb, factorial

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import spline_filter1d

PAD = 40
"""Mirrored coefficients kept around the picture, px: the reach of any tap, and the rest of a vector of 32."""
TAIL = 20
"""Taps on each side of the prefilter: beyond them a quintic impulse has fallen below 1e-7."""
SLOPE_TAIL = 10
"""The same for slopes, which steer the match but do not bias it: below 3e-4."""


@lru_cache(maxsize=4)
def prefilter_taps(spline: int) -> NDArray[np.float64]:
    """Impulse response (2 TAIL + 1,) that turns grey values into coefficients of a B-spline."""
    impulse = np.zeros(257)
    impulse[128] = 1.0
    taps = spline_filter1d(impulse, order=spline, mode="mirror")[128 - TAIL : 129 + TAIL]
    taps.setflags(write=False)
    return np.asarray(taps)


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
    taps = prefilter_taps(spline)
    coefficients = _filter(np.asarray(image, np.float32), taps, taps)
    return np.asarray(
        cv2.copyMakeBorder(coefficients, PAD, PAD, PAD, PAD, cv2.BORDER_REFLECT_101), np.float32
    )


def _filter(
    image: NDArray[np.float32], along: NDArray[np.float64], down: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Correlation of an image with taps along its rows and down its columns, mirrored at the border."""
    return np.asarray(
        cv2.sepFilter2D(
            np.ascontiguousarray(image),
            cv2.CV_32F,
            along.astype(np.float32),
            down.astype(np.float32),
            borderType=cv2.BORDER_REFLECT_101,
        ),
        np.float32,
    )


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


@lru_cache(maxsize=4)
def centred_polynomials(spline: int) -> NDArray[np.float32]:
    """The first half of the basis polynomials in powers of u = t - 1/2, ((spline + 1) / 2, spline + 1).

    Node ``spline - k`` has the polynomial of node k with u reversed, so that one evaluation of the even and
    the odd part serves both.
    """
    table = basis_polynomials(spline)
    out = np.zeros_like(table)
    for power in range(spline + 1):
        for q in range(power + 1):
            out[:, q] += table[:, power] * comb(power, q) * 0.5 ** (power - q)
    return np.ascontiguousarray(out[: (spline + 1) // 2], np.float32)


class SlopeFilter(StrEnum):
    """What the slopes of the reference are smoothed by; its grey values never are."""

    PLAIN = "plain"
    """Nothing: slopes of the interpolating spline."""
    NARROW = "narrow"
    """Low pass at 0.30 cycles a px: what the pixels alias does not steer the match. For clean pictures."""
    WIDE = "wide"
    """Low pass at 0.35 cycles a px: keeps more of the texture, for pictures with noise."""
    SOFT = "soft"
    """Gaussian of 1 px: keeps noise out of the slopes where it is stronger than the texture."""


@lru_cache(maxsize=8)
def filter_taps(slopes: SlopeFilter) -> NDArray[np.float64]:
    """Taps of a filter along one axis; they add up to one."""
    if slopes in (SlopeFilter.NARROW, SlopeFilter.WIDE):
        band = 0.6 if slopes is SlopeFilter.NARROW else 0.7
        taps = np.sinc(band * np.arange(-6, 7)) * np.hamming(13)
    elif slopes is SlopeFilter.SOFT:
        taps = np.exp(-0.5 * np.arange(-3, 4) ** 2)
    else:
        taps = np.ones(1)
    return np.asarray(taps / taps.sum())


@lru_cache(maxsize=8)
def slope_taps(spline: int) -> NDArray[np.float64]:
    """Taps (for correlation) of the slope of the interpolating spline at a pixel."""
    prefilter = prefilter_taps(spline)[TAIL - SLOPE_TAIL : TAIL + SLOPE_TAIL + 1]
    return np.convolve(prefilter, basis_polynomials(spline)[:-1, 1])


@lru_cache(maxsize=16)
def slope_noise(spline: int, slopes: SlopeFilter) -> float:
    """Mean product of filtered and plain slope in unit white noise, summed over both axes."""
    plain, taps = slope_taps(spline), filter_taps(slopes)
    filtered_taps = np.convolve(plain, taps)
    reach = (len(filtered_taps) - len(plain)) // 2
    return float(2.0 * np.sum(filtered_taps * np.pad(plain, reach)) * taps[len(taps) // 2])


@dataclass(frozen=True, slots=True)
class Planes:
    """A reference picture as the kernel reads it, each (H, W) float32.

    Attributes
    ----------
    value : grey levels
    slope_x, slope_y : slopes of the smoothed picture, grey levels a px
    product : smoothed slope times plain slope, summed over both axes; (1, 1) where slopes are plain
    """

    value: NDArray[np.float32]
    slope_x: NDArray[np.float32]
    slope_y: NDArray[np.float32]
    product: NDArray[np.float32]


def plain_slope(value: NDArray[np.float32], spline: int, axis: str) -> NDArray[np.float32]:
    """Slope of a picture (H, W) at its pixels along axis "x" or "y", grey levels a px."""
    taps, one = slope_taps(spline), np.ones(1)
    return _filter(value, taps, one) if axis == "x" else _filter(value, one, taps)


def filtered_slope(plain: NDArray[np.float32], slopes: SlopeFilter) -> NDArray[np.float32]:
    """A plain slope (H, W) behind the filter, along both axes."""
    taps = filter_taps(slopes)
    return _filter(plain, taps, taps)


def planes_of(plain: Planes, slope_x: NDArray[np.float32], slope_y: NDArray[np.float32]) -> Planes:
    """Planes with filtered slopes, from the plain ones."""
    product = np.asarray(cv2.multiply(slope_x, plain.slope_x), np.float32)
    cv2.accumulateProduct(slope_y, plain.slope_y, product)
    return Planes(plain.value, slope_x, slope_y, product)


def plain_planes(image: NDArray[np.generic], spline: int) -> Planes:
    """Values and plain slopes of a picture (H, W) at its pixels."""
    value = np.ascontiguousarray(image, np.float32)
    return without_product(value, plain_slope(value, spline, "x"), plain_slope(value, spline, "y"))


def without_product(
    value: NDArray[np.float32], slope_x: NDArray[np.float32], slope_y: NDArray[np.float32]
) -> Planes:
    """Planes (H, W) of a picture whose slopes are the plain ones, so that no product is needed."""
    return Planes(value, slope_x, slope_y, np.zeros((1, 1), np.float32))


def filtered(plain: Planes, slopes: SlopeFilter) -> Planes:
    """The planes of a picture with its slopes filtered; ``plain``: what :func:`plain_planes` gave."""
    if slopes is SlopeFilter.PLAIN:
        return plain
    return planes_of(plain, filtered_slope(plain.slope_x, slopes), filtered_slope(plain.slope_y, slopes))
