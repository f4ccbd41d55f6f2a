"""First mechanism of a scene, blades of any inclination (Coulomb 1776; docs/theory-model.md, section 8)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import ConfigError, ConvergenceError, Fault
from ploughval.model.march import fresh_band
from ploughval.model.settings import initial_surface, soil_law, soil_of
from ploughval.model.surface import avalanche, height_at
from ploughval.scene import Scene

Floats = NDArray[np.float64]
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
    """The band that starts at u = 0, the tip at (0, 0): cheapest of all outcrops, exactly (Eqs 6 and 16).

    Raises
    ------
    ConfigError
        The scene has no soil, or a surface that does not meet the blade's face.
    ConvergenceError
        Every band locks, or the band would pass the end of the box.
    """
    soil, lean = soil_of(scene), math.radians(scene.blade.inclination_deg)
    law = soil_law(soil, scene.model.outcrop, direction=scene.model.direction)
    law = law._replace(wall=law.wall + lean)
    x, y = surface_from_face(scene)
    n = len(x)
    force, place = math.inf, math.nan
    if abs(law.wall) < 0.5 * math.pi:
        room = np.empty((2, n + 1))
        room[:, :n] = x, y
        force, place = fresh_band(room[0], room[1], n, law, x[0])
    if not math.isfinite(force):
        raise ConvergenceError(f"{scene.source}: every band locks. Check [blade] and [soil].")
    if place > x[-1]:
        raise ConvergenceError(
            f"{scene.source}: the first shear band passes the end of the box. Check [box]."
        )
    top = height_at(x, y, n, place)
    scale = 1e-6 * soil.unit_weight_kN_m3 * scene.blade.width_mm
    return Incipient(scale * force, math.degrees(math.atan2(top, place)), place)


def surface_from_face(scene: Scene) -> Floats:
    """Initial surface (2, M) at rest, starting where the blade's face through (0, 0) meets it."""
    depth, given = scene.blade.depth_mm, scene.model.initial_surface_mm
    lean = math.tan(math.radians(scene.blade.inclination_deg))
    nodes = initial_surface(scene, SPAN * depth)
    if lean < 0.0:
        back = [p for p in given or () if p[0] < 0.0]
        level = back[0] if back else (0.0, float(nodes[1, 0]))
        far = (min(level[0], 0.0) - SPAN * depth, level[1])
        nodes = np.column_stack([np.array([far, *back]).T, nodes])
    x, y = avalanche(nodes.T, soil_of(scene).slope_of_repose_deg).T
    ahead = x - lean * y
    k = int(np.argmax(ahead > 0.0))
    if lean == 0.0:
        return np.array([x, y])
    if k == 0:
        fault = Fault(
            "blade.inclination_deg", f"{scene.blade.inclination_deg:g}", "a face that meets the sand"
        )
        raise ConfigError(scene.source, [fault])
    share = ahead[k - 1] / (ahead[k - 1] - ahead[k])
    face = y[k - 1] + share * (y[k] - y[k - 1])
    return np.array([[lean * face, *x[k:]], [face, *y[k:]]])
