"""Where to track: a grid over the sand before the blade, and a row of points along each layer."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.scene import Piv, Scene
from ploughval.tracers.view import Floats, Mapping, Mask

_LEAST_SAND = 0.5  # share of a subset that must be sand
_BELOW = 0.5  # of the depth: sand below the tip's level that is tracked too
_COARSER = 2  # below the reach of the tip, where sand stays, the grid has this many times the spacing
_LAYER_SHARE = 1 / 3  # spacing along a layer, in spacings of the grid


@dataclass(frozen=True, slots=True, eq=False)
class PointSet:
    """Points to track.

    Attributes
    ----------
    px : (N, 2) float
        Image coordinates.
    layer_mm : (N,) float
        Initial height of the layer that a point belongs to; NaN: a point of the grid.
    """

    px: Floats
    layer_mm: Floats


def spacing_px(piv: Piv) -> float:
    """Distance of the points of the grid, px: as set, or half a subset."""
    return piv.spacing_px if piv.spacing_px is not None else (piv.subset_px - 1) / 2


def place_points(sand: NDArray[np.bool_], calibration: Mapping, scene: Scene) -> PointSet:
    """Points over the sand ahead of the blade at rest, and along the layers, in one set.

    Parameters
    ----------
    sand : (H, W) bool
        Sand in the first photograph.
    calibration : Calibration
        Maps px to mm.
    scene : Scene
        Spacing, subset, layers and depth.

    Returns
    -------
    PointSet
        The grid first, row by row, then the layers; no point outside the sand or behind the face. The grid is
        coarser where no subset reaches above the tip's level: nothing shears there.
    """
    window = (scene.piv.subset_px, scene.piv.subset_px)
    share = np.asarray(cv2.blur(sand.astype(np.float32), window, borderType=cv2.BORDER_CONSTANT), np.float32)
    step = spacing_px(scene.piv)
    margin = scene.piv.subset_px // 2
    height, width = sand.shape
    columns = np.arange(margin, width - margin, step)
    rows = np.arange(margin, height - margin, step)
    grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2).astype(float)
    place = calibration.to_mm(grid)
    coarse = np.outer(np.arange(len(rows)) % _COARSER == 0, np.arange(len(columns)) % _COARSER == 0).ravel()
    fine = place[:, 1] > -margin * calibration.mm_per_px
    wanted = (place[:, 0] > 0) & (place[:, 1] > -_BELOW * scene.blade.depth_mm) & (fine | coarse)
    px, layer = [grid[wanted]], [np.full(int(wanted.sum()), np.nan)]
    for layer_mm in scene.tracers.layers_mm if scene.tracers is not None else ():
        row = _along(layer_mm, max(step * _LAYER_SHARE, 2.0), grid, calibration)
        px.append(row)
        layer.append(np.full(len(row), layer_mm))
    points, heights = np.concatenate(px), np.concatenate(layer)
    kept = _in_sand(points, sand, share)
    return PointSet(points[kept], heights[kept])


def _along(layer_mm: float, step_px: float, grid: Floats, calibration: Mapping) -> Floats:
    """Points at one height above the tip, from the face to the far side of the grid, (K, 2) px."""
    far = float(calibration.to_mm(grid)[:, 0].max(initial=0.0))
    x_mm = np.arange(step_px / 2, far / calibration.mm_per_px, step_px) * calibration.mm_per_px
    return calibration.to_px(np.column_stack([x_mm, np.full(len(x_mm), layer_mm)]))


def _in_sand(px: Floats, sand: Mask, share: NDArray[np.float32]) -> Mask:
    """Whether a point is sand itself and its subset mostly is."""
    nearest = np.rint(px).astype(int)
    inside: Mask = np.all((nearest >= 0) & (nearest < sand.shape[::-1]), axis=1)
    col, row = np.where(inside[:, None], nearest, 0).T
    kept: Mask = inside & sand[row, col] & (share[row, col] >= _LEAST_SAND)
    return kept
