"""Force of the one-block mechanism and the cheapest band (Kashizadeh et al. 2014, sections 2.1 to 2.3).

The denominator of Eq. (1) of the paper has beta + phi_w, a misprint: equilibrium of the block gives
beta + phi (docs/theory-model.md, Eqs (3) and (4)).
"""

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from ploughval.model.surface import height_at

Floats = NDArray[np.float64]


def block_force(
    weight: ArrayLike, beta_deg: ArrayLike, phi_deg: ArrayLike, wall_deg: ArrayLike = 0.0
) -> Floats:
    """Force of the blade on a block that slides up a band; infinite where the block locks.

    Parameters
    ----------
    weight : array of float
        Weight of the block; the force comes in the same unit.
    beta_deg : array of float, degrees
        Inclination of the band.
    phi_deg, wall_deg : array of float, degrees
        Friction on the band and on the blade.

    Returns
    -------
    array of float
        P of docs/theory-model.md, Eq. (3), inclined by ``wall_deg`` to the blade's normal; infinite from
        beta + phi + phi_w = 90 degrees on.
    """
    weight, beta, phi, wall = np.broadcast_arrays(
        *(np.asarray(v, float) for v in (weight, beta_deg, phi_deg, wall_deg))
    )
    steep = np.radians(beta + phi)
    force = weight * np.sin(steep) / np.cos(steep + np.radians(wall))
    return np.asarray(np.where(beta + phi + wall >= 90.0, np.inf, force))


def initial_force(
    depth_mm: float,
    unit_weight: float,
    phi_deg: float,
    wall_deg: float = 0.0,
    *,
    inclination_deg: float = 0.0,
    slope_deg: float = 0.0,
    surcharge: float = 0.0,
) -> float:
    """Least force on a blade in even sand: Coulomb's passive force (1776), or Rankine's.

    Parameters
    ----------
    depth_mm : float, mm
        Height of the sand at the blade's face above the tip.
    unit_weight : float, N/mm3
        Of the sand.
    phi_deg, wall_deg : float, degrees
        Friction in the sand and on the blade.
    inclination_deg : float, degrees
        Of the face to the vertical; positive: its top leans ahead, over the sand.
    slope_deg : float, degrees
        Of the surface; positive: rising ahead of the blade.
    surcharge : float, N/mm2
        Load on the surface, for horizontal area.

    Returns
    -------
    float
        N per mm of width; infinite where every band locks. docs/theory-model.md, Eq. (5) before an upright
        blade in level sand; docs/theory-model-blades.md, Eq. (2) before any.

    >>> round(initial_force(30.0, 16e-6, 50.0) * 1000.0, 3)
    54.35
    """
    phi, wall, lean, slope = map(math.radians, (phi_deg, wall_deg, inclination_deg, slope_deg))
    if phi + wall + lean + slope >= 0.5 * math.pi:
        return math.inf
    inclined = math.cos(wall + lean)
    root = math.sqrt(math.sin(phi + wall) * math.sin(phi + slope) / (inclined * math.cos(lean + slope)))
    reach = math.cos(lean + slope) / (math.cos(lean) * math.cos(phi + wall + lean + slope))
    coefficient = inclined * (reach * (1.0 + root)) ** 2
    load = surcharge * depth_mm / (1.0 - math.tan(slope) * math.tan(lean))
    return (0.5 * unit_weight * depth_mm**2 + load) * coefficient


def block_areas(surface: ArrayLike, tip_x: float) -> Floats:
    """Area between the surface and the line from the tip to each node (M,), by Eqs (2) and (3) of the paper.

    ``surface`` is (M, 2) mm and starts at the blade's face; the result is in mm2.
    """
    x, y = np.asarray(surface, float).T
    under = np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(x))])
    return np.asarray(under - 0.5 * (x - tip_x) * y)


@njit(cache=True, nogil=True)
def force_factor(tan_beta: float, tan_phi: float, tan_wall: float) -> float:
    """P / W from tangents, docs/theory-model.md, Eq. (3); infinite where the block locks."""
    locks = 1.0 - tan_phi * tan_wall - tan_beta * (tan_phi + tan_wall)
    if locks <= 0.0:
        return math.inf
    return (tan_beta + tan_phi) * math.sqrt(1.0 + tan_wall * tan_wall) / locks


@njit(cache=True, nogil=True)
def band_force(
    x: Floats,
    y: Floats,
    n: int,
    outcrop: float,
    tan_phi: float,
    tan_wall: float,
    load: float,
    lean: float,
) -> float:
    """P / unit weight of the band from the tip at x[0] - lean to a place; see ``cheapest_band``."""
    reach = outcrop - (x[0] - lean)
    if reach <= 0.0:
        return math.inf
    area = 0.0
    top = height_at(x, y, n, outcrop)
    i = 0
    while i + 1 < n and x[i + 1] < outcrop:
        area += 0.5 * (y[i] + y[i + 1]) * (x[i + 1] - x[i])
        i += 1
    area += 0.5 * (y[i] + top) * (outcrop - x[i]) - 0.5 * reach * top
    weight = area + 0.5 * lean * y[0] + load * (outcrop - x[0])
    force: float = weight * force_factor(top / reach, tan_phi, tan_wall)
    return force


@njit(cache=True, nogil=True)
def _stationary(area: float, gain: float, top0: float, top1: float, low0: float, low1: float) -> float:
    """Where (area + gain t)(top0 + top1 t) / (low0 + low1 t) is least, low1 > 0; infinite: at an end."""
    # in z = low0 + low1 t it is (f0 + f1 z)(g0 + g1 z) / z
    f1, g1 = gain / low1, top1 / low1
    f0, g0 = area - f1 * low0, top0 - g1 * low0
    if f1 * g1 <= 0.0 or f0 * g0 <= 0.0:
        return math.inf
    return (math.sqrt(f0 * g0 / (f1 * g1)) - low0) / low1


@njit(cache=True, nogil=True)
def cheapest_band(
    x: Floats, y: Floats, n: int, tan_phi: float, tan_wall: float, load: float = 0.0, lean: float = 0.0
) -> tuple[float, float]:
    """Least P / unit weight over all outcrops on the surface, and the outcrop's x; exact on every segment.

    With the tip at x[0] - ``lean``, area, numerator and denominator of P are linear in the place along a
    segment, so that P = a/z + b + c z there (docs/theory-model.md, Eqs (6) to (8)): its least value has a
    closed form. Only outcrops that the tip sees under the surface are candidates. ``load``: surcharge / unit
    weight, mm; ``tan_wall``: of wall friction plus inclination (docs/theory-model-blades.md, Eq. (1)).
    """
    tip = x[0] - lean
    scale = math.sqrt(1.0 + tan_wall * tan_wall)
    keep, lose = 1.0 - tan_phi * tan_wall, tan_phi + tan_wall
    best, place = math.inf, x[n - 1]
    area, seen = 0.0, math.inf  # area up to the segment; least tan(beta) of the nodes so far
    for i in range(n - 1):
        x0, y0, width = x[i] - tip, y[i], x[i + 1] - x[i]
        slope = (y[i + 1] - y0) / width
        gain, low1 = 0.5 * (y0 - slope * x0), keep - lose * slope
        if x0 > 0.0:
            seen = min(seen, y0 / x0)
        if low1 > 0.0:  # else every band to the segment locks
            start, stop = 0.0, width
            if x0 > 0.0:  # seen from where the segment comes down to the line of sight
                start = max(start, (y0 - seen * x0) / (seen - slope)) if seen > slope else width
            if slope < 0.0:
                stop = min(stop, -y0 / slope)  # below the tip no band can end
            if start < stop:
                top0, top1, low0 = y0 + tan_phi * x0, slope + tan_phi, keep * x0 - lose * y0
                weight, more = area + load * (x[i] - x[0]), gain + load
                here = _stationary(weight, more, top0, top1, low0, low1)
                for at in (start, min(max(here, start), stop), stop):
                    low = low0 + low1 * at
                    if low > 0.0:  # else it locks, or lies behind the tip of a blade that leans back
                        force = (weight + more * at) * (top0 + top1 * at) * scale / low
                        if force < best:
                            best, place = force, x[i] + at
        area += gain * width
    return best, place
