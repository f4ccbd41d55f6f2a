"""What the mobilised friction is uncertain by: fresh in every row, or shared (JCGM 100:2008, 5.2)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.force.curve import Curve
from ploughval.compare.force.parted import parted
from ploughval.compare.mobilised.inversion import slopes
from ploughval.compare.mobilised.surface import SeenSurface
from ploughval.compare.mobilised.track import BlockTrack
from ploughval.scene import Scene, Soil

Floats = NDArray[np.float64]

SOURCES = (
    "force_zero", "force_gain", "unit_weight", "depth", "wall_friction", "scale",
    "surface", "outcrop_height", "outcrop",
)  # fmt: skip
OWN = ("surface", "outcrop_height", "outcrop")  # of one band alone; the others are common to all bands


@dataclass(frozen=True, slots=True)
class InputStds:
    """Standard uncertainties of what all rows share.

    ``force_zero_N`` does not depend on the force, ``force_gain`` is relative to it; ``surface_mm`` that of
    the surface's level, and of its height at a band's outcrop, ``outcrop_mm`` the band's own, ``scale``
    relative.
    """

    force_zero_N: float
    force_gain: float
    unit_weight: float
    depth_mm: float
    surface_mm: float
    outcrop_mm: float
    wall_friction_deg: float
    scale: float


def input_stds(
    scene: Scene, soil: Soil, force: Curve, surface: SeenSurface, outcrop_std_mm: float
) -> InputStds:
    """Standard uncertainties from a scene, a force record and what was measured.

    Parameters
    ----------
    scene, soil : Scene, Soil
        With their stated uncertainties.
    force : Curve
        Its shared part is divided into what is there at any force and what grows with it.
    surface : SeenSurface
        Tells how well its level and the scale are known.
    outcrop_std_mm : float, mm
        Of the outcrop. What is NaN, not stated, is taken as 0.

    Returns
    -------
    InputStds
    """
    zero, gain = parted(force)
    camera = scene.camera
    scale = surface.scale_std
    if not np.isfinite(scale) and camera is not None and camera.mm_per_px:
        scale = camera.mm_per_px_std / camera.mm_per_px
    return InputStds(
        force_zero_N=zero,
        force_gain=gain,
        unit_weight=soil.unit_weight_std_kN_m3 / soil.unit_weight_kN_m3,
        depth_mm=scene.blade.depth_std_mm,
        surface_mm=float(np.nan_to_num(surface.std_mm)),
        outcrop_mm=float(np.nan_to_num(outcrop_std_mm)),
        wall_friction_deg=soil.wall_friction_std_deg,
        scale=float(np.nan_to_num(scale)),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Effect of one standard uncertainty of every source on N values of the mobilised friction, degrees.

    ``fresh`` (N,) of the force's noise and of the way between photographs; ``shared`` (len(SOURCES), N) by
    source; ``photographs`` (K, N) of the surface's level in each photograph.
    """

    fresh: Floats
    shared: Floats
    photographs: Floats

    @property
    def std(self) -> Floats:
        """Standard uncertainty of each value, (N,) degrees."""
        square = self.fresh**2 + (self.shared**2).sum(axis=0) + (self.photographs**2).sum(axis=0)
        return np.asarray(np.sqrt(square))


def incline_deg(scene: Scene, soil: Soil) -> float:
    """Angle of the blade's force P below the horizontal: wall friction, and the face's inclination.

    Parameters
    ----------
    scene, soil : Scene, Soil
        Blade and friction on it.

    Returns
    -------
    float, degrees
    """
    return soil.wall_friction_deg + scene.blade.inclination_deg


def weight_of(scene: Scene, soil: Soil, track: BlockTrack) -> Floats:
    """Weight of the block with the load upon it, docs/theory-mobilised.md, Eq. (2).

    Parameters
    ----------
    scene, soil : Scene, Soil
        Width; unit weight and surcharge.
    track : BlockTrack
        The block at N travels.

    Returns
    -------
    (N,) float, N
    """
    loaded = track.reach_mm - track.face_mm
    stress = soil.unit_weight_kN_m3 * 1e-6 * track.area_mm2 + soil.surcharge_kPa * 1e-3 * loaded
    return np.asarray(stress * scene.blade.width_mm)  # kN/m3 = 1e-6 N/mm3, kPa = 1e-3 N/mm2


def respond(
    scene: Scene,
    soil: Soil,
    stds: InputStds,
    track: BlockTrack,
    force: tuple[Floats, Floats],
) -> Response:
    """Effects of every source on the mobilised friction, to first order.

    docs/theory-mobilised.md, Eq. (7), with the derivatives and the bound of docs/theory-mobilised.md,
    Eqs (5) and (6).

    Parameters
    ----------
    scene, soil : Scene, Soil
        Width, unit weight, load and wall friction.
    stds : InputStds
        Of the shared sources.
    track : BlockTrack
        The block at N travels.
    force : ((N,) float, (N,) float), N
        Horizontal force and the noise of it.

    Returns
    -------
    Response
    """
    F, noise = force
    weight = weight_of(scene, soil, track)
    by = slopes(F, weight, incline_deg(scene, soil))
    unit, load = (
        v * scene.blade.width_mm for v in (soil.unit_weight_kN_m3 * 1e-6, soil.surcharge_kPa * 1e-3)
    )
    square = track.reach_mm**2 + track.height_mm**2

    def moved(block: Floats, reach: Floats | float = 0.0) -> Floats:
        """Change of the friction with area and height (2, N) and with the reach."""
        area, height = block
        turned = np.degrees((track.reach_mm * height - track.height_mm * reach) / square)
        return np.asarray(by.weight * (unit * area + load * reach) - turned)

    level, height = moved(track.by_level), moved(track.by_height)
    sand = unit * track.area_mm2
    shared = np.stack(
        [
            by.force * stds.force_zero_N,
            by.force * F * stds.force_gain,
            by.weight * sand * stds.unit_weight,
            (level + height) * stds.depth_mm,
            by.wall * stds.wall_friction_deg,
            moved(track.by_scale, track.outcrop_mm) * stds.scale,
            level * stds.surface_mm,
            height * stds.surface_mm,
            moved(track.by_outcrop, 1.0) * stds.outcrop_mm,
        ]
    )
    bend = moved(np.stack([track.bend_mm2, np.zeros(len(F))]))
    photographs = track.share * level * stds.surface_mm
    return Response(np.hypot(by.force * noise, bend), shared, photographs)
