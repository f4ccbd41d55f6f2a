"""Looks at the photographs of a test in their order: blade, sand, free surface, dyed layers."""

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.scene import Scene, Step
from ploughval.tracers.blade import BladeFinder, BladeSight
from ploughval.tracers.dye import DyeFollower
from ploughval.tracers.masks import Appearance, sand_mask
from ploughval.tracers.surface import SurfaceTrace, trace_surface
from ploughval.tracers.view import Floats, Mapping, Mask, View

log = logging.getLogger(__name__)

_FACE_WARNING_PX = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """What one photograph shows.

    Attributes
    ----------
    blade_x_mm, blade_std_mm : float
        Travel of the blade's face from its place in the first photograph; NaN: not found.
    sand : (H, W) bool
        Sand ahead of the blade, and everything below the tip's level, in the photograph.
    surface_mm : (M, 2) float
        Free surface ahead of the blade, in order of x; without the points that are hidden.
    surface_std_mm : (M,) float
        Standard deviation of its heights.
    dyed : dict of float -> (K, 3) float
        Initial height of a dyed layer, mm -> x, y, std, mm; rows of NaN at gaps.
    """

    blade_x_mm: float
    blade_std_mm: float
    sand: NDArray[np.bool_]
    surface_mm: Floats
    surface_std_mm: Floats
    dyed: dict[float, Floats]


class Watcher:
    """Sees each readable photograph once, in order; the first one shows the test at rest.

    Parameters
    ----------
    scene : Scene
        With a [camera] table.
    calibration
        ``to_mm``, ``to_px`` and ``mm_per_px``.
    """

    def __init__(self, scene: Scene, calibration: Mapping) -> None:
        self._scene, self._calibration = scene, calibration
        self._view: View | None = None
        self._shape: tuple[int, ...] = ()

    def see(self, frame: int, image: NDArray[np.uint8] | NDArray[np.uint16]) -> Sight:
        """Blade, sand, free surface and dyed layers of one photograph.

        Parameters
        ----------
        frame : int
            Its number, for messages.
        image : (H, W) uint8 or uint16
            Its grey levels.

        Raises
        ------
        DataError
            An image of another shape than the first.
        """
        if image.ndim != 2 or (self._view is not None and image.shape != self._shape):
            raise DataError(
                f"got an image of shape {image.shape}; expected {self._shape or '(H, W), grey'}", frame=frame
            )
        if self._view is None:
            self._start(image)
        assert self._view is not None
        cut = self._view.cut(image)
        blade = self._blade.find(cut)
        face = blade.column
        if not np.isfinite(face):
            log.warning("frame %d: the blade's face was not found", frame)
            face = self._blade.predicted
        surface = trace_surface(cut, self._appearance.likelihood(cut), face)
        mask = self._sand(surface, face)
        dyed = {} if self._dye is None else self._dye.follow(cut, mask, face)
        return self._sight(blade, surface, mask, dyed)

    def _start(self, image: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
        """Learn from the first photograph, whose geometry the scene tells."""
        scene = self._scene
        self._shape = image.shape
        height, width = image.shape
        view = View((height, width), self._calibration, scene.camera.view_px if scene.camera else None)
        cut = view.cut(image)
        self._blade = BladeFinder(view, scene.blade, cut)
        if abs(self._blade.first_offset_px) > _FACE_WARNING_PX:
            log.warning(
                "the blade's face stands %.1f px from camera.tip_px in the first photograph; expected %g",
                self._blade.first_offset_px,
                _FACE_WARNING_PX,
            )
        self._appearance = Appearance(view, scene, cut)
        self._view, self._dye = view, None
        if Step.DYE in scene.steps and scene.tracers is not None:
            face = float(view.column(0.0))
            surface = trace_surface(cut, self._appearance.likelihood(cut), face)
            self._dye = DyeFollower(view, scene.tracers, cut, self._sand(surface, face))

    def _sand(self, surface: SurfaceTrace, face: float) -> Mask:
        """Mask of the sand on the grid."""
        assert self._view is not None
        column = np.arange(self._view.shape[1])
        if len(surface.column) == 0:
            top = np.full(len(column), np.nan)
        else:
            top = np.interp(column, surface.column, surface.row)
        return sand_mask(self._view, top, face, self._scene.blade.thickness_mm)

    def _sight(
        self, blade: BladeSight, surface: SurfaceTrace, mask: Mask, dyed: dict[float, Floats]
    ) -> Sight:
        view = self._view
        assert view is not None
        line = np.column_stack([view.x_mm(surface.column), view.y_mm(surface.row)])
        return Sight(
            blade_x_mm=float(view.x_mm(blade.column)),
            blade_std_mm=blade.std_px * view.step_mm,
            sand=view.uncut(mask),
            surface_mm=line,
            surface_std_mm=surface.std_px * view.step_mm,
            dyed=dyed,
        )
