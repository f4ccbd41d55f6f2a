"""First force of two blocks on a bent band, for rough blades (Chen 1975; docs/theory-model.md, section 9)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import ConvergenceError
from ploughval.model.mechanism import cheapest_band, initial_force

Floats = NDArray[np.float64]

FIRST_ANGLES = (-0.3, 0.0, 0.3)  # of the lower band, radians, and
LENGTHS = (0.5, 1.0)  # its lengths, depths, from which the search sets out
FAR = 1e4  # depths of level sand


@dataclass(frozen=True, slots=True)
class BentBand:
    """Least force of one or two blocks in N per mm of width, and the band: (x, y) from the tip, mm.

    Block 1 stands at the blade on the band from the tip to ``joint``, block 2 on the band from there to
    ``outcrop``; the interface runs from the joint to the top of the blade's face. Of one block the joint is
    the tip.
    """

    force: float
    blocks: int
    joint: tuple[float, float]
    outcrop: tuple[float, float]


def two_block_force(depth_mm: float, unit_weight: float, phi_deg: float, wall_deg: float) -> BentBand:
    """Least force of one and two blocks on a vertical blade in level, fresh sand; never above Coulomb's.

    Parameters
    ----------
    depth_mm : float, mm
        Depth of the tip.
    unit_weight : float, N/mm3
        Of the sand.
    phi_deg, wall_deg : float, degrees
        Friction in the sand (bands and interface) and on the blade. A smooth blade: one block, which is
        Rankine's and cannot be bettered.

    Raises
    ------
    ConvergenceError
        Sand and blade friction together reach 90 degrees.
    """
    one = initial_force(depth_mm, unit_weight, phi_deg, wall_deg)
    if not math.isfinite(one):
        raise ConvergenceError(
            f"every band locks: friction {phi_deg} + {wall_deg} degrees; less than 90 needed"
        )
    scale, best, shape = unit_weight * depth_mm**2, math.inf, np.zeros(3)
    phi, wall = math.radians(phi_deg), math.radians(wall_deg)
    if wall > 0.0:
        best, shape = _search(phi, wall)
    if scale * best < one:
        joint, out = _points(shape)
        return BentBand(scale * best, 2, _in_mm(joint, depth_mm), _in_mm((out, 1.0), depth_mm))
    _, place = cheapest_band(np.array([0.0, FAR]), np.ones(2), 2, math.tan(phi), math.tan(wall))
    return BentBand(one, 1, (0.0, 0.0), _in_mm((place, 1.0), depth_mm))


def bent_band_force(shape: Floats, phi: float, wall: float) -> float:
    """P / (unit weight d^2) by Eq. 19; infinite where the shape is impossible. Angles in radians.

    ``shape``: angles of the lower and the upper band, length of the lower one in depths.
    """
    lower, upper, length = shape
    if not (lower < upper < 0.5 * math.pi and length > 0.0 and upper > 0.0 and lower + phi > 0.0):
        return math.inf
    (x, y), out = _points(shape)
    interface = math.atan2(1.0 - y, -x)
    free = math.sin(interface - 2.0 * phi - upper)
    if y >= 1.0 or interface - 2.0 * phi - upper <= 0.0 or lower + phi + wall >= 0.5 * math.pi:
        return math.inf
    quicker = math.sin(interface - 2.0 * phi - lower) / free  # velocity of block 2 over that of block 1
    weights = 0.5 * x, 0.5 * out * (1.0 - y)
    work = weights[0] * math.sin(lower + phi) + weights[1] * math.sin(upper + phi) * quicker
    return work / math.cos(lower + phi + wall)


def _points(shape: Floats) -> tuple[tuple[float, float], float]:
    """Joint, and x of the outcrop, in depths."""
    lower, upper, length = (float(v) for v in shape)
    x, y = length * math.cos(lower), length * math.sin(lower)
    return (x, y), x + (1.0 - y) / math.tan(upper)


def _search(phi: float, wall: float) -> tuple[float, Floats]:
    """Least force of bent bands, from several starts."""
    from scipy.optimize import minimize  # slow to import, and only rough blades need it

    best, shape = math.inf, np.zeros(3)
    options = {"xatol": 1e-8, "fatol": 1e-11, "maxiter": 2000}
    for lower in FIRST_ANGLES:
        for length in LENGTHS:
            start = np.array([lower, 0.25 * math.pi - 0.5 * phi, length])
            if math.isfinite(bent_band_force(start, phi, wall)):
                found = minimize(
                    bent_band_force, start, args=(phi, wall), method="Nelder-Mead", options=options
                )
                if found.fun < best:
                    best, shape = float(found.fun), found.x
    return best, shape


def _in_mm(point: tuple[float, float], depth_mm: float) -> tuple[float, float]:
    return depth_mm * point[0], depth_mm * point[1]
