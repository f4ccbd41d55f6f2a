"""The block of sand between face, band and free surface, read from the surface in a photograph."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.face import face_at_surface

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
        Between face, surface and band; height of the surface at the outcrop above the tip.
    face_mm : float
        x from the tip to where the face meets the surface: 0 before an upright face.
    by_level, by_height, by_outcrop, by_scale : (float, float)
        By a shift of the surface but for its height at the outcrop, mm; by that height, mm; by the outcrop's
        place, mm; by the relative error of the photograph's scale. A tip that lies deeper is the first two.
    """

    area_mm2: float
    height_mm: float
    face_mm: float
    by_level: tuple[float, float]
    by_height: tuple[float, float]
    by_outcrop: tuple[float, float]
    by_scale: tuple[float, float]


def block_of(
    line: Floats, u_mm: float, outcrop_mm: float, depth_mm: float, lean: float = 0.0
) -> Block | None:
    """The block in one photograph (docs/theory-mobilised.md, Eq. (2)).

    Parameters
    ----------
    line : (M, 2) float, mm
        Surface: x and y, more columns are passed over. Rows of NaN are holes.
    u_mm : float, mm
        x of the tip, from which the face goes up.
    outcrop_mm : float, mm
        x at which the band comes out.
    depth_mm : float, mm
        Of the tip: holes in the surface wider than a tenth of it leave the block unknown.
    lean : float
        Tangent of the face's inclination to the vertical; positive: its top leans ahead, over the sand.

    Returns
    -------
    Block or None
        None where the surface has a hole, or the band no length or no sand above it.
    """
    line = line[np.isfinite(line[:, :2]).all(axis=1), :2]
    line = line[np.argsort(line[:, 0], kind="stable")]
    if len(line) < 2 or not outcrop_mm > u_mm:
        return None
    x, reach, face = line[:, 0], outcrop_mm - u_mm, face_at_surface(line, u_mm, lean)
    inner = np.diff(x)[(x[1:] > face) & (x[:-1] < outcrop_mm)]
    if max(face, x[0]) > outcrop_mm or max(x[0] - face, outcrop_mm - x[-1], *inner) > _GAP_DEPTHS * depth_mm:
        return None
    area, height = _area(line, u_mm, outcrop_mm, lean)
    if not (area > 0 and height > 0):
        return None
    side = _SIDE_DEPTHS * depth_mm
    slope = float(np.diff(np.interp([outcrop_mm - side, outcrop_mm + side], x, line[:, 1]))[0]) / (2 * side)
    scaled = _area(line * (1 + _STEP), u_mm, outcrop_mm * (1 + _STEP), lean)
    return Block(
        area,
        height,
        face - u_mm,
        by_level=(outcrop_mm - face, 0.0),
        by_height=(-reach / 2, 1.0),
        by_outcrop=((height - reach * slope) / 2, slope),
        by_scale=((scaled[0] - area) / _STEP, (scaled[1] - height) / _STEP),
    )


def _area(line: Floats, u_mm: float, outcrop_mm: float, lean: float) -> tuple[float, float]:
    """Area between face, surface and band, mm2, and the surface's height at the outcrop, mm."""
    x, face = line[:, 0], face_at_surface(line, u_mm, lean)
    stations = np.concatenate([[face], x[(x > face) & (x < outcrop_mm)], [outcrop_mm]])
    heights = np.interp(stations, x, line[:, 1])
    height, wedge = float(heights[-1]), (face - u_mm) * float(heights[0]) / 2
    return float(np.trapezoid(heights, stations)) + wedge - (outcrop_mm - u_mm) * height / 2, height
