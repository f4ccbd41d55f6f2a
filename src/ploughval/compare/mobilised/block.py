"""The block of sand between face, band and free surface, read from the surface in a photograph."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_GAP_DEPTHS = 0.1  # a hole in the measured surface wider than this leaves the weight unknown
_SIDE_DEPTHS = 0.05  # to either side of the outcrop: where the slope of the surface is read
_STEP = 1e-3  # relative step of the derivative by the scale


@dataclass(frozen=True, slots=True)
class Block:
    """Sand over a band from a tip at u to an outcrop at X; derivatives are of (area, height).

    Attributes
    ----------
    area_mm2, height_mm : float
        Between surface and band; height of the surface at the outcrop above the tip.
    by_level, by_height, by_outcrop, by_scale : (float, float)
        By a shift of the surface but for its height at the outcrop, mm; by that height, mm; by the outcrop's
        place, mm; by the relative error of the photograph's scale. A tip that lies deeper is the first two.
    """

    area_mm2: float
    height_mm: float
    by_level: tuple[float, float]
    by_height: tuple[float, float]
    by_outcrop: tuple[float, float]
    by_scale: tuple[float, float]


def block_of(line: Floats, u_mm: float, outcrop_mm: float, depth_mm: float) -> Block | None:
    """The block in one photograph.

    Parameters
    ----------
    line : (M, 2) float, mm
        Surface: x and y, more columns are passed over. Rows of NaN are holes.
    u_mm : float, mm
        The blade's face, which is the x of the tip.
    outcrop_mm : float, mm
        x at which the band comes out.
    depth_mm : float, mm
        Of the tip: holes in the surface wider than a tenth of it leave the block unknown.

    Returns
    -------
    Block or None
        None where the surface has a hole, or the band no length or no sand above it.
    """
    line = line[np.isfinite(line[:, :2]).all(axis=1), :2]
    line = line[np.argsort(line[:, 0], kind="stable")]
    if len(line) < 2 or not outcrop_mm > u_mm:
        return None
    x, reach = line[:, 0], outcrop_mm - u_mm
    inner = np.diff(x)[(x[1:] > u_mm) & (x[:-1] < outcrop_mm)]
    if max(x[0] - u_mm, outcrop_mm - x[-1], *inner) > _GAP_DEPTHS * depth_mm:
        return None
    area, height = _area(line, u_mm, outcrop_mm)
    if not (area > 0 and height > 0):
        return None
    side = _SIDE_DEPTHS * depth_mm
    slope = float(np.diff(np.interp([outcrop_mm - side, outcrop_mm + side], x, line[:, 1]))[0]) / (2 * side)
    scaled = _area(line * [1 + _STEP, 1 + _STEP], u_mm, outcrop_mm * (1 + _STEP))
    return Block(
        area,
        height,
        by_level=(reach, 0.0),
        by_height=(-reach / 2, 1.0),
        by_outcrop=((height - reach * slope) / 2, slope),
        by_scale=((scaled[0] - area) / _STEP, (scaled[1] - height) / _STEP),
    )


def _area(line: Floats, u_mm: float, outcrop_mm: float) -> tuple[float, float]:
    """Area between surface and band, mm2, and the surface's height at the outcrop, mm."""
    x = line[:, 0]
    stations = np.concatenate([[u_mm], x[(x > u_mm) & (x < outcrop_mm)], [outcrop_mm]])
    heights = np.interp(stations, x, line[:, 1])
    height = float(heights[-1])
    return float(np.trapezoid(heights, stations)) - (outcrop_mm - u_mm) * height / 2, height
