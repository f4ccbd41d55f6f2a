"""Prices of bands under a surface: the one in force, and the cheapest fresh one."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.model.advance import tip_of
from ploughval.model.bent import Shear, least_bent
from ploughval.model.law import Band, Law
from ploughval.model.mechanism import band_force, cheapest_band
from ploughval.model.softening import tan_mobilised

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, forceinline=True)
def straight_fresh(x: Floats, y: Floats, n: int, law: Law) -> tuple[float, float]:
    """P / unit weight of a fresh band of one block, and its outcrop; past the last node: sand is missing.

    The direction is that of least force, or the one of docs/theory-model-march.md, Eq. (1).
    """
    x[n], y[n] = x[n - 1] + 1e3 * y[0], y[n - 1]
    tan_peak, tan_wall, lean = math.tan(law.peak), math.tan(law.wall), law.face * y[0]
    if law.softened > 0.0 and law.peak > law.residual:
        force, place = cheapest_band(x, y, n + 1, math.tan(law.residual), tan_wall, law.load, lean)
        if math.isfinite(force):
            force = band_force(x, y, n + 1, place, tan_peak, tan_wall, law.load, lean)
    else:
        force, place = cheapest_band(x, y, n + 1, tan_peak, tan_wall, law.load, lean)
    return force, place


@njit(cache=True, nogil=True, forceinline=True)
def weigh_fresh(surface: Floats, n: int, law: Law, work: Floats) -> tuple[float, Band]:
    """P / unit weight of the cheapest fresh band of as many blocks as the law allows, and the band."""
    x, y = surface[0], surface[1]
    force, place = straight_fresh(x, y, n, law)
    joint = (0.0, 0.0)
    if law.bends is not None and math.isfinite(force):
        strength = Shear(math.tan(law.peak), law.wall, law.load, 0.0)
        force, place, joint = least_bent(x, y, n + 1, strength, (force, place), True, work[0])
    return force, Band(place, 0.0, *joint)


@njit(cache=True, nogil=True, forceinline=True)
def weigh_old(
    surface: Floats, n: int, law: Law, outcrop: float, slip: float, work: Floats
) -> tuple[float, Band]:
    """P / unit weight of a band that has slipped and keeps its outcrop, and the band with its joint."""
    x, y = surface[0], surface[1]
    tan_phi = tan_mobilised(slip, law.peak, law.residual, law.mobilization)
    force = band_force(x, y, n, outcrop, tan_phi, math.tan(law.wall), law.load, law.face * y[0])
    joint = (0.0, 0.0)
    if law.bends is not None and outcrop > tip_of(surface, law):
        strength = Shear(tan_phi, law.wall, law.load, 0.0)
        force, _, joint = least_bent(x, y, n, strength, (force, outcrop), False, work[0])
    return force, Band(outcrop, slip, *joint)
