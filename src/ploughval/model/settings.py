"""A scene as the march wants it: soil, rules, travel and increment."""

import math

from ploughval.errors import ConfigError, ConvergenceError, Fault
from ploughval.model.ground import surface_ahead
from ploughval.model.law import Law
from ploughval.model.march import End, March, march
from ploughval.scene import Scene, Soil

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
    """A soil under the rules of a scene's [model], before its blade; refuses faces flatter than the sand.

    A smooth blade has one block: two pay only beside friction on the face (docs/theory-model-two-blocks.md,
    section 3).
    """
    law = soil_law(soil, scene.model.outcrop, direction=scene.model.direction)
    if scene.model.mechanism == "two_blocks" and law.wall > 0.0:
        law = law._replace(bends=1.0)
    lean = scene.blade.inclination_deg
    most = 90.0 - soil.slope_of_repose_deg
    if lean != 0.0 and abs(lean) >= most:
        expected = f"less than {most:g} either way: a face steeper than the sand's slope of repose"
        remedy = "ploughval.model.incipient gives its first band."
        raise ConfigError(scene.source, [Fault("blade.inclination_deg", f"{lean:g}", expected, remedy)])
    return inclined(law, lean)


def inclined(law: Law, inclination_deg: float) -> Law:
    """A law before a face that leans; ``wall`` is then of wall friction and inclination.

    docs/theory-model-blades.md, Eq. (1).
    """
    lean = math.radians(inclination_deg)
    return law._replace(wall=law.wall + lean, face=math.tan(lean))


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
        surface = surface_ahead(scene, span, math.degrees(law.repose))
        marched: March = march(surface, law, travel, step, store)
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
