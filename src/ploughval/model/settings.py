"""A scene as the march wants it: soil, rules, travel, increment and initial surface."""

import math

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import ConfigError, ConvergenceError, Fault
from ploughval.model.march import End, Law, March, march
from ploughval.scene import Scene, Soil

Floats = NDArray[np.float64]

STEP_PER_TOLERANCE = (
    5.0  # increment, in depths, that meets a relative tolerance (reports/speed-error/model.csv)
)
DEFAULT_TRAVEL = 3.0  # depths
LEAST_TOLERANCE = 1e-6  # below it rounding is no longer far away
MOST_INCREMENTS = 2_000_000  # a minute and some gigabytes


def soil_of(scene: Scene) -> Soil:
    """The scene's soil, or a ConfigError."""
    if scene.soil is None:
        raise ConfigError(scene.source, [Fault("soil", "nothing", "a [soil] table", "The model needs it.")])
    return scene.soil


def soil_law(soil: Soil, outcrop: str, *, direction: str = "least_force") -> Law:
    """A soil and the rules of the outcrop and of a fresh band's direction as the kernel wants them."""
    peak, residual = math.radians(soil.peak_friction_deg), math.radians(soil.residual_friction_deg)
    wall, repose = math.radians(soil.wall_friction_deg), math.radians(soil.slope_of_repose_deg)
    rides, softened = float(outcrop == "riding"), float(direction == "least_softened")
    load = 1e3 * soil.surcharge_kPa / soil.unit_weight_kN_m3
    return Law(peak, residual, soil.mobilization_length_mm, wall, repose, rides, softened, load)


def scene_law(scene: Scene, soil: Soil) -> Law:
    """A soil under the rules of a scene's [model]; refuses what the march cannot do."""
    if scene.blade.inclination_deg != 0.0:
        value, remedy = f"{scene.blade.inclination_deg:g}", "ploughval.model.incipient gives its first band."
        fault = Fault("blade.inclination_deg", value, "0: the model pushes vertical blades only", remedy)
        raise ConfigError(scene.source, [fault])
    return soil_law(soil, scene.model.outcrop, direction=scene.model.direction)


def travel_of(scene: Scene, displacement_mm: float | None) -> float:
    """The travel asked for, the scene's, or three depths; mm."""
    travel = displacement_mm if displacement_mm is not None else scene.model.displacement_mm
    travel = DEFAULT_TRAVEL * scene.blade.depth_mm if travel is None else float(travel)
    if not 0.0 < travel < math.inf:
        fault = Fault("displacement_mm", repr(displacement_mm), "a positive number of mm")
        raise ConfigError(scene.source, [fault])
    return travel


def tolerance_of(scene: Scene, tolerance: float | None) -> float:
    """The relative error asked for, or the scene's."""
    if tolerance is None:
        return scene.model.tolerance
    if not LEAST_TOLERANCE <= tolerance <= 0.1:
        fault = Fault("tolerance", repr(tolerance), f"a number from {LEAST_TOLERANCE:g} to 0.1")
        raise ConfigError(scene.source, [fault])
    return float(tolerance)


def increment_for(scene: Scene, travel: float, tolerance: float) -> float:
    """The increment that meets a tolerance, mm; ConfigError where the travel would take too many of them."""
    step = min(STEP_PER_TOLERANCE * tolerance, 0.25) * scene.blade.depth_mm
    if travel / step > MOST_INCREMENTS:
        fault = Fault(
            "model.displacement_mm",
            f"{travel:g} mm, {travel / step:.2g} increments at a tolerance of {tolerance:g}",
            f"at most {MOST_INCREMENTS:.0e} increments",
            "Ask for less travel or a coarser tolerance.",
        )
        raise ConfigError(scene.source, [fault])
    return step


def run_march(scene: Scene, law: Law, travel: float, step: float, *, store: bool) -> March:
    """March through a scene; without a box the sand is as long as the bands need."""
    span = travel + 40.0 * scene.blade.depth_mm
    for _ in range(10):
        marched: March = march(initial_surface(scene, span), law, travel, step, store)
        if marched.end == End.DONE or scene.box.length_mm is not None:
            break
        span *= 2.0
    if len(marched.rows) == 0:
        why = (
            "the first shear band passes the end of the box"
            if marched.end == End.NO_ROOM
            else "every band locks"
        )
        raise ConvergenceError(f"{scene.source}: no mechanism at u = 0: {why}. Check [box] and [soil].")
    return marched


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
