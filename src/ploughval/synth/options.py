"""What a synthetic test folder shall contain."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from ploughval.axes import Direction
from ploughval.errors import ConfigError, Fault
from ploughval.scene import Blade, Box, ModelTable, Scene, Soil, TestTable, Tracers

PAPER_SOIL = Soil(unit_weight_kN_m3=15.7, peak_friction_deg=50.0, residual_friction_deg=32.0)
"""Dense super-fine silica sand of Kashizadeh et al. (2014), section 3.3."""

_POSITIVE = (
    "mm_per_px",
    "depth_mm",
    "width_mm",
    "thickness_mm",
    "speed_mm_s",
    "displacement_mm",
    "layer_thickness_mm",
    "spacing_px",
    "rate_hz",
    "rest_s",
    "marker_radius_px",
)
_NOT_NEGATIVE = (
    "seed",
    "noise_grey",
    "markers",
    "vignetting",
    "friction_N",
    "friction_scatter",
    "moment_noise_Nm",
    "zero_offset_Nm",
    "empty_runs",
)


_MARGINS = ("above_mm", "below_mm", "ahead_mm", "behind_mm")


class Purpose(IntEnum):
    """What random numbers are for: each purpose has a generator of its own."""

    GRAINS = 1
    AVALANCHES = 2
    NOISE = 3
    LINE_OF_ACTION = 4
    LOG = 5
    KNOWN_LOADS = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class SynthOptions:
    """A whole test: scene, photographs and logs. Grey levels are on the 8-bit scale.

    Attributes
    ----------
    name : of the test
    seed : source of everything random
    frames : photographs, the first before motion, the last at ``displacement_mm``
    mm_per_px, direction : scale, and the way the blade travels in the photographs
    depth_mm, width_mm, thickness_mm, speed_mm_s, displacement_mm, box_length_mm : blade and box
    soil, told_soil : the true sand, and the one that test.toml tells (None: the same)
    tolerance : of the model that moves the sand
    layers_mm, layer_thickness_mm, dyed : heights of the layers; whether they are dyed dark
    spacing_px, diameter_px : grains, as in :func:`ploughval.synth.sand_texture`
    grain_grey : least and greatest grey of a natural grain
    air_grey, blade_grey : background and blade
    above_mm, below_mm, ahead_mm, behind_mm : what the photographs show above the highest heap, below the tip,
        ahead of the furthest moved sand and behind the blade (None: 0.25, 0.25, 0.4 and 0.4 depths)
    noise_grey : standard deviation of the camera's noise
    vignetting, gradient : loss of light in the corners; change of light from left to right, both relative
    bit_depth, image_format : of the photographs
    markers, marker_radius_px : dark dots on pale discs of twice their radius, painted on the window
    camera_creep_px : how far the picture moves from one photograph to the next, right and down
    photographs, loadcells : whether the folder holds them
    rate_hz, rest_s, empty_runs : of the logs
    spacing_mm, lower_to_tip_mm : between the cells, and from the lower one to the tip
    friction_N, friction_scatter : of the blade on the box: mean force, relative spread between runs
    moment_noise_Nm, zero_offset_Nm : standard deviations, per reading and per run
    clock_offset_s, clock_told : photograph clock minus log clock; whether test.toml tells it (else "auto")
    """

    seed: int = 0
    name: str = "synth"
    frames: int = 30
    mm_per_px: float = 0.3
    direction: Direction = Direction.RIGHT
    depth_mm: float = 30.0
    width_mm: float = 218.0
    thickness_mm: float = 5.0
    speed_mm_s: float = 1.0
    displacement_mm: float = 55.0
    box_length_mm: float | None = None
    soil: Soil = PAPER_SOIL
    told_soil: Soil | None = None
    tolerance: float = 1e-3
    layers_mm: tuple[float, ...] = (5.0, 10.0, 15.0, 20.0, 25.0)
    layer_thickness_mm: float = 1.5
    dyed: bool = True
    spacing_px: float = 1.55
    diameter_px: tuple[float, float] = (2.5, 6.0)
    grain_grey: tuple[float, float] = (105.0, 215.0)
    air_grey: float = 45.0
    blade_grey: float = 205.0
    above_mm: float | None = None
    below_mm: float | None = None
    ahead_mm: float | None = None
    behind_mm: float | None = None
    noise_grey: float = 2.0
    vignetting: float = 0.05
    gradient: float = 0.03
    bit_depth: Literal[8, 16] = 8
    image_format: Literal["png", "jpg", "tif"] = "png"
    markers: int = 0
    marker_radius_px: float = 5.0
    camera_creep_px: tuple[float, float] = (0.0, 0.0)
    photographs: bool = True
    loadcells: bool = True
    rate_hz: float = 50.0
    rest_s: float = 10.0
    empty_runs: int = 3
    spacing_mm: float = 150.0
    lower_to_tip_mm: float = 260.0
    friction_N: float = 1.5
    friction_scatter: float = 0.05
    moment_noise_Nm: float = 0.002
    zero_offset_Nm: float = 0.1
    clock_offset_s: float = 0.0
    clock_told: bool = True

    def __post_init__(self) -> None:
        faults = [
            Fault(field.name, repr(value), "a finite number")
            for field in fields(self)
            if isinstance(value := getattr(self, field.name), float) and not math.isfinite(value)
        ]
        faults += [
            Fault(name, repr(getattr(self, name)), "a number greater than 0")
            for name in (*_POSITIVE, "spacing_mm", "lower_to_tip_mm")
            if not getattr(self, name) > 0
        ]
        faults += [
            Fault(name, repr(getattr(self, name)), "0 or a greater number")
            for name in _NOT_NEGATIVE
            if not getattr(self, name) >= 0
        ]
        faults += [
            Fault(name, repr(value), "0 or a greater number, or None")
            for name in _MARGINS
            if (value := getattr(self, name)) is not None and not value >= 0
        ]
        faults += [
            Fault(place, repr(value), expected)
            for place, value, right, expected in self._choices()
            if not right
        ]
        if faults:
            raise ConfigError("synth options", faults)

    def _choices(self) -> tuple[tuple[str, object, bool, str], ...]:
        inside = all(0 < h < self.depth_mm for h in self.layers_mm)
        low, high = self.diameter_px
        jpeg16 = self.image_format == "jpg" and self.bit_depth == 16
        return (
            ("frames", self.frames, self.frames >= 2, "at least 2 photographs"),
            ("layers_mm", self.layers_mm, inside, f"heights between 0 and depth_mm = {self.depth_mm}"),
            ("diameter_px", self.diameter_px, 0 < low <= high, "two diameters greater than 0, ascending"),
            (
                "grain_grey",
                self.grain_grey,
                0 < self.grain_grey[0] <= self.grain_grey[1] <= 255,
                "two greys up to 255, ascending",
            ),
            ("bit_depth", self.bit_depth, self.bit_depth in (8, 16), "8 or 16"),
            ("bit_depth", self.bit_depth, not jpeg16, "8 with image_format 'jpg'"),
            (
                "image_format",
                self.image_format,
                self.image_format in ("png", "jpg", "tif"),
                "png, jpg or tif",
            ),
        )

    @property
    def frames_u_mm(self) -> NDArray[np.float64]:
        """Blade displacement of each photograph, mm, to 0.1 um and the travel itself at the end."""
        places = np.linspace(0.0, self.displacement_mm, self.frames).round(4)
        places[-1] = self.displacement_mm
        return places

    def rng(self, purpose: Purpose, number: int = 0) -> np.random.Generator:
        """Generator for one purpose (and frame or run): changing one option does not shift other numbers."""
        return np.random.default_rng([self.seed, purpose, number])

    @property
    def true_scene(self) -> Scene:
        """The scene whose model moves the sand: only what the model needs."""
        return Scene(
            test=TestTable(name=self.name),
            blade=Blade(
                depth_mm=self.depth_mm,
                width_mm=self.width_mm,
                thickness_mm=self.thickness_mm,
                speed_mm_s=self.speed_mm_s,
            ),
            box=Box(length_mm=self.box_length_mm),
            soil=self.soil,
            tracers=Tracers(layers_mm=self.layers_mm) if self.layers_mm else None,
            model=ModelTable(displacement_mm=self.displacement_mm, tolerance=self.tolerance),
        )


def adapt(options: SynthOptions, *, soil: Mapping[str, float | None], **changes: Any) -> SynthOptions:
    """Options with some values replaced; None leaves a value as it is.

    Another depth moves the layers in proportion, unless they are given.

    Parameters
    ----------
    options : SynthOptions
        What to start from.
    soil : mapping
        Values of [soil] by key.
    **changes
        Values of :class:`SynthOptions` by name; a direction may be given as text.

    Returns
    -------
    SynthOptions

    Raises
    ------
    ConfigError
        For values that cannot be.

    Examples
    --------
    >>> adapt(SynthOptions(), soil={"peak_friction_deg": 40.0}, seed=3, frames=None).soil.peak_friction_deg
    40.0
    """
    given = {name: value for name, value in changes.items() if value is not None}
    sand = {name: value for name, value in soil.items() if value is not None}
    try:
        if "direction" in given:
            given["direction"] = Direction(given["direction"])
        told = Soil.model_validate({**options.soil.model_dump(), **sand})
    except ValidationError as error:
        faults = [Fault(".".join(map(str, e["loc"])) or "soil", repr(sand), e["msg"]) for e in error.errors()]
        raise ConfigError("synth options", faults) from None
    except ValueError:
        raise ConfigError(
            "synth options", [Fault("direction", repr(given["direction"]), "right or left")]
        ) from None
    if "depth_mm" in given and "layers_mm" not in given:
        share = given["depth_mm"] / options.depth_mm
        given["layers_mm"] = tuple(round(share * height, 6) for height in options.layers_mm)
    return replace(options, soil=told, **given)


def options_like(scene: Scene, base: SynthOptions) -> SynthOptions:
    """Options whose photographs and logs are those that the model predicts for a scene.

    Parameters
    ----------
    scene : Scene
        Its blade, box, soil, layers, load cells, and the camera's scale and direction where it states them.
    base : SynthOptions
        Everything that a scene does not say: grains, noise, number of photographs.

    Returns
    -------
    SynthOptions

    Raises
    ------
    ConfigError
        Without [soil], or for a scene that cannot be made.
    """
    if scene.soil is None:
        raise ConfigError(
            scene.source, [Fault("soil", "nothing", "a [soil] table", "The sand is made from it.")]
        )
    _refuse_what_is_not_made(scene)
    blade, camera, cells, tracers = scene.blade, scene.camera, scene.loadcells, scene.tracers
    stated: dict[str, Any] = {
        "name": scene.test.name,
        "depth_mm": blade.depth_mm,
        "width_mm": blade.width_mm,
        "thickness_mm": blade.thickness_mm,
        "speed_mm_s": blade.speed_mm_s,
        "box_length_mm": scene.box.length_mm,
        "displacement_mm": scene.model.displacement_mm,
        "layers_mm": () if tracers is None else tracers.layers_mm,
        "dyed": tracers is not None and bool(tracers.dyed_layers_mm),
        "layer_thickness_mm": None if tracers is None else tracers.thickness_mm,
        "mm_per_px": None if camera is None else camera.mm_per_px,
        "direction": None if camera is None else camera.direction,
        "spacing_mm": None if cells is None else cells.spacing_mm,
        "lower_to_tip_mm": None if cells is None else cells.lower_to_tip_mm,
    }
    given = {name: value for name, value in stated.items() if value is not None}
    return replace(base, soil=scene.soil, told_soil=None, **given)


def _refuse_what_is_not_made(scene: Scene) -> None:
    """Blades that lean, uneven ground and two blocks: synthetic sand is level and moves along one line."""
    faults = []
    if scene.blade.inclination_deg != 0.0:
        faults.append(
            Fault("blade.inclination_deg", f"{scene.blade.inclination_deg:g}", "0: an upright blade")
        )
    if scene.model.mechanism != "one_block":
        faults.append(Fault("model.mechanism", repr(scene.model.mechanism), "'one_block'"))
    if scene.model.initial_surface_mm is not None:
        faults.append(Fault("model.initial_surface_mm", "a surface", "none: level sand"))
    if faults:
        raise ConfigError(scene.source, faults)
