"""First mechanism of a scene, blades of any inclination (Coulomb 1776; docs/theory-model-blades.md)."""

import math
from dataclasses import dataclass

import numpy as np

from ploughval.errors import ConvergenceError
from ploughval.model.ground import surface_from_face
from ploughval.model.settings import inclined, soil_law, soil_of
from ploughval.model.surface import height_at
from ploughval.model.weigh import straight_fresh
from ploughval.scene import Scene

SPAN = 1000.0  # depths of sand ahead of a blade without a box


@dataclass(frozen=True, slots=True)
class Incipient:
    """Force, angle and outcrop of the band with which a scene begins.

    ``force_N`` is the inclined resultant for the blade's width; its horizontal part is force_N times the
    cosine of wall friction plus inclination.
    """

    force_N: float
    beta_deg: float
    outcrop_x_mm: float


def incipient(scene: Scene) -> Incipient:
    """The band that starts at u = 0, the tip at (0, 0): cheapest of all outcrops, exactly.

    docs/theory-model.md, Eq. (8) with the force of docs/theory-model-blades.md, Eq. (1).

    Raises
    ------
    ConfigError
        The scene has no soil, or a surface that does not meet the blade's face.
    ConvergenceError
        Every band locks, or the band would pass the end of the box.
    """
    soil = soil_of(scene)
    law = soil_law(soil, scene.model.outcrop, direction=scene.model.direction)
    law = inclined(law, scene.blade.inclination_deg)
    x, y = surface_from_face(scene, SPAN * scene.blade.depth_mm, soil.slope_of_repose_deg)
    n = len(x)
    force, place = math.inf, math.nan
    if abs(law.wall) < 0.5 * math.pi:
        room = np.empty((2, n + 1))
        room[:, :n] = x, y
        force, place = straight_fresh(room[0], room[1], n, law)
    if not math.isfinite(force):
        raise ConvergenceError(f"{scene.source}: every band locks. Check [blade] and [soil].")
    if place > x[-1]:
        raise ConvergenceError(
            f"{scene.source}: the first shear band passes the end of the box. Check [box]."
        )
    top = height_at(x, y, n, place)
    scale = 1e-6 * soil.unit_weight_kN_m3 * scene.blade.width_mm
    return Incipient(scale * force, math.degrees(math.atan2(top, place)), place)
