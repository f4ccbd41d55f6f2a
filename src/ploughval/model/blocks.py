"""First force of one or two blocks in level sand (Chen 1975; docs/theory-model-two-blocks.md, section 2)."""

import math
from dataclasses import dataclass

import numpy as np

from ploughval.errors import ConvergenceError
from ploughval.model.bent import Shear, least_bent
from ploughval.model.mechanism import cheapest_band, initial_force

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
    phi, wall = math.radians(phi_deg), math.radians(wall_deg)
    x, y, above = np.array([0.0, FAR]), np.ones(2), np.empty(2)
    straight = cheapest_band(x, y, 2, math.tan(phi), math.tan(wall))
    if wall > 0.0:
        strength = Shear(math.tan(phi), wall, 0.0, -math.inf)
        force, place, joint = least_bent(x, y, 2, strength, straight, True, above)
        if joint[0] > 0.0:
            scale = unit_weight * depth_mm**2
            return BentBand(scale * force, 2, _in_mm(joint, depth_mm), _in_mm((place, 1.0), depth_mm))
    return BentBand(one, 1, (0.0, 0.0), _in_mm((straight[1], 1.0), depth_mm))


def _in_mm(point: tuple[float, float], depth_mm: float) -> tuple[float, float]:
    return depth_mm * point[0], depth_mm * point[1]
