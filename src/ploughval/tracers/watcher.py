"""Looks at the photographs of a test in their order: blade, sand, free surface, dyed layers."""

import logging
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Region
from ploughval.changing import Changing
from ploughval.errors import DataError
from ploughval.scene import Scene, Step
from ploughval.tracers.appearance import Appearance
from ploughval.tracers.blade import BladeFinder, BladeSight
from ploughval.tracers.dye import DyeFollower
from ploughval.tracers.light import Lighting, LightMeter
from ploughval.tracers.masks import regions
from ploughval.tracers.surface import SurfaceFinder, SurfaceTrace
from ploughval.tracers.view import Bytes, Cut, Floats, Levels, Mapping, Mask, View, moved_back

log = logging.getLogger(__name__)

_FACE_WARNING_PX = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """What the dyed layers of a photograph are found from: part of it on the grid, light, surface, face.

    ``whole``: (int, int) px by which the camera's movement was taken off, ``rest``: what is left of it.
    """

    cut: Cut
    lighting: Lighting
    surface: SurfaceTrace
    face: float
    whole: tuple[int, int]
    rest: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """What one photograph shows.

    Attributes
    ----------
    blade_x_mm, blade_std_mm : float
        Travel of the blade's face from its place in the first photograph; NaN: not found.
    regions : (H, W) uint8
        Codes of :class:`ploughval.axes.Region`, in the pixels of this very photograph.
    surface_mm : (M, 2) float
        Free surface ahead of the blade, in order of x; without the points that are hidden.
    surface_std_mm : (M,) float
        Standard deviation of its heights.
    dyed : dict of float -> (K, 3) float, mm
        Initial height of a dyed layer -> x, y, std; rows of NaN at gaps.
    reasons : tuple of str
        What this photograph could not show, and why.
    looked : Looked or None
        For :meth:`Watcher.follow_dyed`, until it has been called.
    """

    blade_x_mm: float
    blade_std_mm: float
    regions: Bytes
    surface_mm: Floats
    surface_std_mm: Floats
    dyed: dict[float, Floats]
    reasons: tuple[str, ...] = ()
    looked: Looked | None = field(default=None, repr=False)

    @property
    def sand(self) -> Mask:
        """Sand ahead of the blade, and everything below the tip's level: (H, W) bool, made when asked for."""
        return np.asarray(self.regions == Region.SAND)


class Watcher(Changing):
    """Sees each readable photograph once, in order; the first one shows the test at rest.

    A snapshot holds what :meth:`look` learns; what :meth:`follow_dyed` learns has ``dye`` for itself, since
    photographs are looked at before the layers of earlier ones are followed.

    Parameters
    ----------
    scene : Scene
        With a [camera] table.
    calibration : Calibration
        ``to_mm``, ``to_px`` and ``mm_per_px``.
    """

    CHANGES = ("_face", "_blade", "_surface")

    def __init__(self, scene: Scene, calibration: Mapping) -> None:
        self._scene, self._calibration = scene, calibration
        self._view: View | None = None
        self._shape: tuple[int, ...] = ()
        self._face = np.nan
        self._dye: DyeFollower | None = None

    @property
    def dye(self) -> DyeFollower | None:
        """What follows the dyed layers; None before the first photograph, or without such layers."""
        return self._dye

    def see(
        self,
        frame: int,
        image: NDArray[np.uint8] | NDArray[np.uint16],
        shift_px: tuple[float, float] = (0.0, 0.0),
        carried: dict[float, Floats] | None = None,
    ) -> Sight:
        """Everything that one photograph shows: :meth:`look`, then :meth:`follow_dyed`."""
        return self.follow_dyed(self.look(frame, image, shift_px), carried)

    def look(
        self,
        frame: int,
        image: NDArray[np.uint8] | NDArray[np.uint16],
        shift_px: tuple[float, float] = (0.0, 0.0),
    ) -> Sight:
        """Blade, sand and free surface of one photograph, its dyed layers still to be followed.

        Parameters
        ----------
        frame : int
            Its number, for messages.
        image : (H, W) uint8 or uint16
            Its grey levels.
        shift_px : (float, float)
            Where the camera has been knocked to: what stood still at p in the first photograph stands
            at p + shift_px in this one, px, right and down. What is given in mm is freed of it.

        Raises
        ------
        DataError
            An image of another shape than the first.
        """
        if image.ndim != 2 or (self._view is not None and image.shape != self._shape):
            raise DataError(
                f"got an image of shape {image.shape}; expected {self._shape or '(H, W), grey'}", frame=frame
            )
        whole = (round(shift_px[0]), round(shift_px[1]))
        back = moved_back(image, whole)
        if self._view is None:
            self._start(back)
        assert self._view is not None
        rest = self._view.offset((shift_px[0] - whole[0], shift_px[1] - whole[1]))
        cut = self._view.cut(back)
        lighting = self._light.compare(cut)
        blade, face = self._face_in(frame, cut, lighting)
        surface = self._surface.find(cut, lighting, face, face - self._face)
        self._face = face
        parts = self._view.uncut(self._regions(surface, face), Region.OUTSIDE)
        parts = moved_back(parts, (-whole[0], -whole[1]), Region.OUTSIDE)
        return self._sight(blade, Looked(cut, lighting, surface, face, whole, rest), parts)

    def follow_dyed(self, sight: Sight, carried: dict[float, Floats] | None = None) -> Sight:
        """A sight with its dyed layers, each photograph in its order.

        Parameters
        ----------
        sight : Sight
            From :meth:`look`.
        carried : dict of float -> (K, 2) float, or None
            Where tracked points of each dyed layer stand in this photograph, px: by initial height, mm.
        """
        seen, view = sight.looked, self._view
        if seen is None or view is None or self._dye is None:
            return replace(sight, looked=None)
        told = None if carried is None else self._on_grid(carried, seen.whole)
        surface = seen.surface
        found = self._dye.follow(
            seen.cut, seen.lighting, surface.top, seen.face, hidden=surface.hidden, carried=told
        )
        moved = [-seen.rest[0] * view.step_mm, seen.rest[1] * view.step_mm, 0.0]
        dyed = {height: points + moved for height, points in found.items()}
        absent = [
            f"layer {height:g} mm: {self._why_not(height)}"
            for height, points in dyed.items()
            if not np.isfinite(points[:, 0]).any()
        ]
        return replace(sight, dyed=dyed, reasons=(*sight.reasons, *absent), looked=None)

    def _face_in(self, frame: int, cut: Cut, lighting: Lighting) -> tuple[BladeSight, float]:
        """The blade as it is seen, and the column of its face: where it is expected if it is not seen."""
        expected = self._blade.predicted
        blade = self._blade.find(cut, lighting)
        if np.isfinite(blade.column):
            return blade, blade.column
        log.warning("frame %d: the blade's face was not found", frame)
        return blade, expected

    def _start(self, image: Levels) -> None:
        """Learn from the first photograph, whose geometry the scene tells."""
        scene = self._scene
        self._shape = image.shape
        height, width = image.shape
        view = View((height, width), self._calibration, scene.camera.view_px if scene.camera else None)
        cut = view.cut(image)
        self._light = LightMeter(cut)
        look = Appearance(view, scene, cut)
        self._blade = BladeFinder(view, scene.blade, cut, look.light)
        if abs(self._blade.first_offset_px) > _FACE_WARNING_PX:
            log.warning(
                "the blade's face stands %.1f px from camera.tip_px in the first photograph; expected %g",
                self._blade.first_offset_px,
                _FACE_WARNING_PX,
            )
        self._surface = SurfaceFinder(look, scene.blade.depth_mm / view.step_mm)
        self._face = float(view.column(0.0))
        self._view = view
        if Step.DYE in scene.steps and scene.tracers is not None:
            self._dye = DyeFollower(view, scene.tracers, cut, look)

    def _regions(self, surface: SurfaceTrace, face: float) -> Bytes:
        """Regions of the grid."""
        assert self._view is not None
        back = face - self._scene.blade.thickness_mm / self._view.step_mm
        return regions(self._view.shape, surface.top, float(self._view.row(0.0)), (back, face))

    def _on_grid(self, carried: dict[float, Floats], whole: tuple[int, int]) -> dict[float, Floats]:
        """Points of the photograph as columns and rows of the grid, (K, 2) each."""
        view = self._view
        assert view is not None
        mm = {h: self._calibration.to_mm(np.asarray(px, float) - whole) for h, px in carried.items()}
        return {h: np.column_stack([view.column(p[:, 0]), view.row(p[:, 1])]) for h, p in mm.items()}

    def _why_not(self, height: float) -> str:
        """Why a dyed layer is absent."""
        if self._dye is not None and not self._dye.stands_out(height):
            return "its grey does not differ from that of the sand beside it at rest"
        return "no dyed sand was found where it is expected"

    def _sight(self, blade: BladeSight, seen: Looked, parts: Bytes) -> Sight:
        view, surface = self._view, seen.surface
        assert view is not None
        across, down = seen.rest
        line = np.column_stack([view.x_mm(surface.column - across), view.y_mm(surface.row - down)])
        reasons = (
            [] if seen.lighting.agrees else ["light: it cannot be compared with that of the first photograph"]
        )
        if not np.isfinite(blade.column):
            reasons.append("blade: the face was not found")
        if len(surface.hidden) < len(surface.causes):
            reasons.append(f"surface: {surface.causes[0]}")
        for (first, last), cause in zip(surface.hidden, surface.causes, strict=False):
            start, end = view.x_mm(first - across), view.x_mm(last - across)
            reasons.append(f"surface: not seen from x = {start:.1f} to {end:.1f} mm: {cause}")
        if surface.cut_off:
            reasons.append("surface: the moving heap reaches the end of the picture")
        return Sight(
            blade_x_mm=float(view.x_mm(blade.column - across)),
            blade_std_mm=blade.std_px * view.step_mm,
            regions=parts,
            surface_mm=line,
            surface_std_mm=surface.std_px * view.step_mm,
            dyed={},
            reasons=tuple(reasons),
            looked=seen,
        )
