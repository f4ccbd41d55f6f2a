"""The initial surface of a scene, to the blade's face."""

import math

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import ConfigError, Fault
from ploughval.model.surface import avalanche
from ploughval.scene import Scene

Floats = NDArray[np.float64]


def surface_ahead(scene: Scene, span_mm: float, repose_deg: float) -> Floats:
    """Surface (2, M) ahead of the blade's face at u = 0, to the end of the box or ``span_mm`` long."""
    if scene.blade.inclination_deg == 0.0:
        return initial_surface(scene, span_mm)
    return surface_from_face(scene, span_mm, repose_deg)


def initial_surface(scene: Scene, span_mm: float) -> Floats:
    """Surface (2, M) ahead of the blade at u = 0, to the end of the box or at least ``span_mm`` long."""
    depth, given, box = scene.blade.depth_mm, scene.model.initial_surface_mm, scene.box.length_mm
    x, y = np.array(given if given is not None else [(0.0, depth)], float).T
    length = box if box is not None else max(span_mm, x[-1] + depth)
    if np.any(np.diff(x) <= 0.0):
        k = int(np.argmax(np.diff(x) <= 0.0)) + 1
        fault = Fault(
            f"model.initial_surface_mm.{k}", f"x {x[k]}", f"x above {x[k - 1]}", "Order the points by x."
        )
        raise ConfigError(scene.source, [fault])
    face = float(np.interp(0.0, x, y))
    if face <= 0.0 or length <= 0.0:
        fault = Fault("model.initial_surface_mm", f"height {face} at the blade", "a height above the tip")
        raise ConfigError(scene.source, [fault])
    inner = (x > 0.0) & (x < length)
    ends = np.interp([0.0, length], x, y)
    return np.array([[0.0, *x[inner], length], [ends[0], *y[inner], ends[1]]])


def surface_from_face(scene: Scene, span_mm: float, repose_deg: float) -> Floats:
    """Initial surface (2, M) at rest, starting where the blade's face through (0, 0) meets it."""
    given = scene.model.initial_surface_mm
    lean = math.tan(math.radians(scene.blade.inclination_deg))
    nodes = initial_surface(scene, span_mm)
    if lean < 0.0:
        back = [p for p in given or () if p[0] < 0.0]
        level = back[0] if back else (0.0, float(nodes[1, 0]))
        far = (min(level[0], 0.0) - span_mm, level[1])
        nodes = np.column_stack([np.array([far, *back]).T, nodes])
    x, y = avalanche(nodes.T, repose_deg).T
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
