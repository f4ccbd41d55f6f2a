"""What sand and air look like, learned at rest, and the mask of the sand ahead of the blade."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from ploughval.scene import Scene
from ploughval.tracers.view import Floats, Image, Mask, View

_CLEAR_PX = 3.0  # kept off every border while learning
_SKIN_SHARE = 0.15  # of the depth: the sand at rest that the look of the surface is learned from
_UNKNOWN_SAND = 0.02  # share of sand pixels that look like nothing known
_UNKNOWN_SKIN = 0.002  # ... of the uppermost sand
_UNKNOWN_AIR = 0.10  # ... and of air pixels: behind the window anything may appear
_LEVELS = 256
_PATCH_PX = 2.0  # std of the window over which a change since rest is averaged
_FLICKER = 1.5  # grey levels by which unchanged air may differ from its rest
_FINE = 8  # parts of a grey level in the table of changes


@dataclass(frozen=True, slots=True)
class Likelihood:
    """Logarithms of the likelihood of each pixel above the tip's level, (rows, columns) float32 each."""

    air: Image
    skin: Image
    sand: Image


def initial_surface_mm(scene: Scene, x_mm: Floats) -> Floats:
    """Height of the sand's surface before the blade moves, mm above the tip, at x_mm."""
    given = scene.model.initial_surface_mm
    if given is None:
        return np.full(np.shape(x_mm), scene.blade.depth_mm)
    return np.asarray(np.interp(x_mm, *np.array(sorted(given)).T))


class Appearance:
    """Grey statistics of sand, of the sand's skin and of air, read from the first photograph.

    A pixel is air if it looks like air in general or as that very pixel did at rest (the camera
    stands still); it is sand if it looks like the sand at rest, and the uppermost sand looks like
    the uppermost sand at rest: with layers of several colours that tells the surface from a
    border between two layers, and from sand that shows above it further back.

    Parameters
    ----------
    view : grid of the photographs
    scene : depth and initial surface
    image : (h, w) float32, the first frame on the grid
    """

    def __init__(self, view: View, scene: Scene, image: Image) -> None:
        self.rows = int(np.clip(round(view.row(0.0)), 8, view.shape[0]))
        skin_px = max(_SKIN_SHARE * scene.blade.depth_mm / view.step_mm, _CLEAR_PX + 1)
        low, high = np.percentile(image, [0.1, 99.9])
        self._low, self._scale = float(low), float((_LEVELS - 1) / max(high - low, 1e-6))
        level = self._levels(image)
        x_mm = view.x_mm(np.arange(view.shape[1], dtype=float))
        top = view.row(initial_surface_mm(scene, x_mm))
        row = np.arange(self.rows)[:, None]
        ahead = (np.arange(view.shape[1]) > view.column(0.0) + _CLEAR_PX)[None, :]
        air = ahead & (row < top - _CLEAR_PX)
        sand = ahead & (row > top + _CLEAR_PX) & (row < self.rows - _CLEAR_PX)
        skin = ahead & (row > top + _CLEAR_PX - 1) & (row < top + skin_px)
        self._sand = _log_histogram(level[sand], _UNKNOWN_SAND)
        self._skin = _log_histogram(level[skin], _UNKNOWN_SKIN)
        self._air = (1 - _UNKNOWN_AIR) / 2 * _histogram(level[air]) + _UNKNOWN_AIR / _LEVELS
        self._rest, self._known = level.astype(np.float32), air
        self._same = (1 - _UNKNOWN_AIR) / 2 * _bell(max(_noise(level, air) / _PATCH_PX, _FLICKER))

    def likelihood(self, image: Image) -> Likelihood:
        """How well each pixel above the tip's level fits air, skin and sand."""
        level = self._levels(image)
        air = np.log(self._air[level] + self._unchanged(level)).astype(np.float32)
        return Likelihood(air, self._skin[level], self._sand[level])

    def _unchanged(self, level: NDArray[np.uint8]) -> Floats:
        """Density of each pixel's grey, if it shows what it showed at rest.

        The difference is averaged over a patch, for noise, and freed of a change of the light.
        """
        change = level - self._rest
        if self._known.any():
            change -= np.median(change[self._known])
        change = np.abs(cv2.GaussianBlur(change, (0, 0), _PATCH_PX))
        same = self._same[np.minimum(np.rint(change * _FINE), len(self._same) - 1).astype(np.intp)]
        return np.where(self._known, same, 0.0)

    def _levels(self, image: Image) -> NDArray[np.uint8]:
        """Grey as 256 levels over the first frame's range, lightly smoothed, rows above the tip."""
        smooth = cv2.GaussianBlur(image[: self.rows], (0, 0), 0.8)
        return np.asarray(np.clip((smooth - self._low) * self._scale, 0, _LEVELS - 1), np.uint8)


def sand_mask(view: View, top_row: Floats, face: float, thickness_mm: float) -> Mask:
    """Sand ahead of the face under the surface, and below the tip's level everywhere; not the blade.

    Parameters
    ----------
    view : View
        Grid of the photographs.
    top_row : (w,) float
        Row of the surface in each column, NaN where it is not known.
    face : float
        Column of the blade's face; NaN: nothing above the tip's level.
    thickness_mm : float
        Of the blade.

    Returns
    -------
    (h, w) bool
    """
    height, width = view.shape
    column, row = np.arange(width), np.arange(height)[:, None]
    tip = float(view.row(0.0))
    mask = np.broadcast_to(row > tip, view.shape).copy()
    if np.isfinite(face):
        ahead = (column > face + 0.5)[None, :]
        mask |= ahead & (row > np.nan_to_num(top_row, nan=tip)[None, :])
        behind = (column >= face - thickness_mm / view.step_mm - 0.5) & (column <= face + 0.5)
        mask &= ~(behind[None, :] & (row <= tip + 0.5))
    return mask


def _histogram(level: NDArray[np.uint8]) -> Floats:
    """Smooth density of grey levels, (256,), sum 1; flat where nothing was seen."""
    if level.size == 0:
        return np.full(_LEVELS, 1 / _LEVELS)
    count = np.bincount(level.ravel(), minlength=_LEVELS).astype(float)
    smooth = gaussian_filter1d(count, 3.0, mode="nearest")
    return np.asarray(smooth / smooth.sum())


def _log_histogram(level: NDArray[np.uint8], unknown: float) -> Image:
    density = (1 - unknown) * _histogram(level) + unknown / _LEVELS
    return np.log(density).astype(np.float32)


def _noise(level: NDArray[np.uint8], where: Mask) -> float:
    """Standard deviation of single pixels in the air, grey levels, at least 2."""
    both = where[:, 1:] & where[:, :-1]
    if not both.any():
        return 2.0
    jump = np.abs(level[:, 1:].astype(float) - level[:, :-1])[both]
    return max(float(np.median(jump)) * 1.4826 / math.sqrt(2), 2.0)


def _bell(std: float) -> Floats:
    """Normal density of a difference of grey levels, tabulated at 1 / _FINE of a level."""
    place = np.arange(_LEVELS * _FINE) / _FINE
    return np.asarray(np.exp(-0.5 * (place / std) ** 2) / (std * math.sqrt(2 * math.pi)))
