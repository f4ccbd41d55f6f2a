"""What a fit varies: soil parameters on a searched scale, and quantities known with an uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import ConfigError, Fault
from ploughval.model.settings import soil_of
from ploughval.scene import Scene, Soil

Floats = NDArray[np.float64]

PARAMETERS = ("peak_friction_deg", "residual_friction_deg", "mobilization_length_mm")
FITTED = (*PARAMETERS, "wall_friction_deg", "repose_deg", "unit_weight_kN_m3")
ANGLES = {"peak_friction_deg", "residual_friction_deg", "wall_friction_deg", "repose_deg"}
LEAST_ANGLE = 10.0  # degrees, searched for friction angles
FURTHEST = 5.0  # standard uncertainties that a known quantity may move by
WIDTHS = {True: 1.0, False: 0.1}  # of a difference: an angle spans tens of degrees, a logarithm a few units


@dataclass(frozen=True, slots=True, eq=False)
class Space:
    """The soil variables of a fit: those fitted, then those known with a standard uncertainty.

    Attributes
    ----------
    scene : Scene
        The test; what is neither fitted nor uncertain keeps its values.
    fitted : tuple of str
        Fields of [soil]; angles are searched in degrees, lengths and weights by their logarithm.
    known : tuple of str
        Fields of [soil], and depth_mm of [blade]; searched in standard uncertainties from the scene's value.
    low, high : (V,) float
        Range searched, on the searched scale.
    """

    scene: Scene
    fitted: tuple[str, ...]
    known: tuple[str, ...]
    low: Floats
    high: Floats

    @property
    def angles(self) -> list[bool]:
        """Which variables have the width of an angle, for differences."""
        return [name in ANGLES for name in self.fitted] + [False] * len(self.known)

    def physical(self, searched: Floats) -> dict[str, float]:
        """Fitted and known quantities in their units; a residual angle above the peak lifts the peak."""
        values = {n: in_units(n, v) for n, v in zip(self.fitted, searched, strict=False)}
        for name, shift in zip(self.known, searched[len(self.fitted) :], strict=True):
            centre, std = _told(self.scene, name)
            values[name] = max(centre + float(shift) * std, 0.02 * centre)
        peak = values.get("peak_friction_deg", soil_of(self.scene).peak_friction_deg)
        residual = values.get("residual_friction_deg", soil_of(self.scene).residual_friction_deg)
        if residual > peak:
            values["peak_friction_deg"] = residual
        return values

    def std_of(self, name: str) -> float:
        """Standard uncertainty of a known quantity, in its unit."""
        return _told(self.scene, name)[1]

    def scene_with(self, searched: Floats) -> tuple[Scene, Soil]:
        """The scene and its soil with these values."""
        values = self.physical(searched)
        depth = values.pop("depth_mm", None)
        soil = soil_of(self.scene).model_copy(update=values)
        return (self.scene if depth is None else deeper(self.scene, depth)), soil


def in_units(name: str, searched: float) -> float:
    """A fitted parameter in its unit, from the searched scale."""
    return float(searched) if name in ANGLES else float(np.exp(searched))


def deeper(scene: Scene, depth_mm: float) -> Scene:
    """The scene with its tip at another depth; a surface that is given rises above the tip with it."""
    blade = scene.blade.model_copy(update={"depth_mm": depth_mm})
    surface = scene.model.initial_surface_mm
    if surface is None:
        return scene.model_copy(update={"blade": blade})
    more = depth_mm - scene.blade.depth_mm
    raised = tuple((x, y + more) for x, y in surface)
    model = scene.model.model_copy(update={"initial_surface_mm": raised})
    return scene.model_copy(update={"blade": blade, "model": model})


def space_of(scene: Scene, parameters: Sequence[str]) -> Space:
    """The variables of a fit to a scene.

    Parameters
    ----------
    scene : Scene
        With [soil]; its standard uncertainties count for what is not fitted.
    parameters : sequence of str
        Fields of [soil] to fit.

    Returns
    -------
    Space

    Raises
    ------
    ConfigError
        Unknown or doubled parameters, or no [soil].
    """
    names = tuple(parameters)
    wrong = [Fault("parameters", repr(n), f"one of {', '.join(FITTED)}") for n in names if n not in FITTED]
    if len(set(names)) != len(names) or not names:
        wrong.append(Fault("parameters", repr(names), "different names, at least one"))
    if wrong:
        raise ConfigError(scene.source, wrong)
    soil_of(scene)
    known = tuple(n for n in ("depth_mm", *FITTED) if n not in names and _told(scene, n)[1] > 0.0)
    limits = [_range(scene, names, name) for name in names] + [(-FURTHEST, FURTHEST)] * len(known)
    low, high = np.array(limits, float).T
    return Space(scene, names, known, low, high)


def _range(scene: Scene, names: tuple[str, ...], name: str) -> tuple[float, float]:
    """Range of a fitted parameter on its searched scale."""
    soil, depth = soil_of(scene), scene.blade.depth_mm
    rough = "wall_friction_deg" in names
    both = {"peak_friction_deg", "residual_friction_deg"} <= set(names)
    least = LEAST_ANGLE if both else max(LEAST_ANGLE, soil.residual_friction_deg)
    most = 65.0 if rough else min(70.0, 89.0 - soil.wall_friction_deg)
    peak = most if "peak_friction_deg" in names else soil.peak_friction_deg
    ranges = {
        "peak_friction_deg": (least, most),
        "residual_friction_deg": (LEAST_ANGLE, peak),
        "mobilization_length_mm": (np.log(1e-3 * depth), np.log(2.0 * depth)),
        "wall_friction_deg": (0.0, min(35.0, 89.0 - peak)),
        "repose_deg": (5.0, 80.0),
        "unit_weight_kN_m3": (np.log(5.0), np.log(40.0)),
    }
    return ranges[name]


def _told(scene: Scene, name: str) -> tuple[float, float]:
    """A quantity as the scene tells it, with its standard uncertainty (0: exact)."""
    if name == "depth_mm":
        return scene.blade.depth_mm, float(getattr(scene.blade, "depth_std_mm", 0.0) or 0.0)
    stem, _, unit = name.partition("_kN_m3") if name.endswith("_kN_m3") else name.rpartition("_")
    std = f"{stem}_std_kN_m3" if name.endswith("_kN_m3") else f"{stem}_std_{unit}"
    value = getattr(soil_of(scene), name)
    return float(value if value is not None else 0.0), float(getattr(soil_of(scene), std, 0.0) or 0.0)
