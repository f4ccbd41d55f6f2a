"""Made tests that whole sequences are measured on: one factor at a time about a base, and some together."""

from dataclasses import dataclass, replace

from ploughval.axes import Direction
from ploughval.scene import Soil
from ploughval.synth import EXAMPLE, SynthOptions

BASE = replace(EXAMPLE, name="base", seed=11, mm_per_px=0.125, frames=40)


@dataclass(frozen=True, slots=True)
class Case:
    """One made test.

    Attributes
    ----------
    name : str
    options : SynthOptions
    """

    name: str
    options: SynthOptions


def soil(peak_deg: float, residual_deg: float) -> Soil:
    """Sand of the example's unit weight."""
    return Soil(unit_weight_kN_m3=15.7, peak_friction_deg=peak_deg, residual_friction_deg=residual_deg)


def cases() -> tuple[Case, ...]:
    """The base, each factor by itself, and a few together."""
    small = {"depth_mm": 15.0, "displacement_mm": 27.5, "layers_mm": (2.5, 5.0, 7.5, 10.0, 12.5)}
    made = {
        "base": {},
        "seed 12": {"seed": 12},
        "leftward": {"direction": Direction.LEFT},
        "noise 0": {"noise_grey": 0.0},
        "noise 8": {"noise_grey": 8.0},
        "4 px/mm": {"mm_per_px": 0.25},
        "16 px/mm, d = 15 mm": {"mm_per_px": 0.0625, "layer_thickness_mm": 0.75, **small},
        "20 frames": {"frames": 20},
        "60 frames": {"frames": 60},
        "50/32 degrees": {"soil": soil(50, 32)},
        "36/32 degrees": {"soil": soil(36, 32)},
        "33/33 degrees": {"soil": soil(33, 33)},
        "light gradient 30 %": {"gradient": 0.3, "vignetting": 0.1},
        "dark sand": {"grain_grey": (55.0, 105.0), "air_grey": 20.0, "blade_grey": 120.0},
        "pale sand before a white wall": {
            "grain_grey": (120.0, 210.0),
            "air_grey": 240.0,
            "blade_grey": 60.0,
        },
        "16 bit": {"bit_depth": 16},
        "leftward, 36/32, noise 8, gradient": {
            "seed": 13,
            "direction": Direction.LEFT,
            "soil": soil(36, 32),
            "noise_grey": 8.0,
            "gradient": 0.3,
        },
        "4 px/mm, 20 frames, 50/32": {"seed": 14, "mm_per_px": 0.25, "frames": 20, "soil": soil(50, 32)},
        "JPEG, not dyed": {"seed": 15, "image_format": "jpg", "dyed": False},
    }
    return tuple(Case(name, replace(BASE, **changes)) for name, changes in made.items())
