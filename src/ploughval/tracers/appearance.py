"""What sand, its skin and air look like, learned at rest; how well a band of a photograph fits them."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from ploughval.scene import Scene
from ploughval.tracers.light import Lighting
from ploughval.tracers.view import Bytes, Cut, Floats, Image, View

_CLEAR_PX = 3.0  # kept off every border while learning
_SKIN_SHARE = 0.15  # of the depth: the sand at rest that the look of the surface is learned from
_UNKNOWN_SAND = 0.02  # share of sand pixels that look like nothing known
_UNKNOWN_SKIN = 0.002  # ... of the uppermost sand
_UNKNOWN_AIR = 0.10  # ... and of air pixels: behind the window anything may appear
_LEVELS = 256
_BLUR_PX = 0.8  # std of the smoothing of what is compared with the histograms
_PATCH_PX = 2.0  # std of the window over which a change since rest is averaged
_HALO_PX = 8  # rows read beyond a band, which the smoothing needs
_FLICKER = 1.5  # grey levels by which unchanged air may differ from its rest
_FINE = 8  # parts of a grey level in the table of changes
_CHUNK = 256  # rows looked at together while learning
_STREAK_SHARE = 0.01  # of the width: std of the smoothing of the light along the sand at rest
_LEAST_LIGHT = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Tables:
    """Logarithms of densities of grey levels, (256,) float32; that of air is not yet a logarithm.

    ``same``: density of a change of grey since rest, by its magnitude in 1/8 of a level.
    """

    air: Image
    skin: Image
    sand: Image
    same: Image


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """Rows of a photograph, evened in light.

    Attributes
    ----------
    first_row : int, row of the grid
    grey : (rows, w) float32, grey levels of the file
    level : (rows, w) uint8, the same smoothed lightly, over the range of the first photograph
    change : (rows, w) uint16, magnitude of the change since rest, in 1/8 of a level
    """

    first_row: int
    grey: Image
    level: Bytes
    change: NDArray[np.uint16]


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
    border between two layers, and from sand that shows above it further back. All levels are
    evened by how bright the sand at rest is in each column: light from one side, and streaks of
    reflected light, do not widen the statistics.

    Parameters
    ----------
    view : grid of the photographs
    scene : depth and initial surface
    image : (h, w) uint8 or uint16, the first frame on the grid
    """

    def __init__(self, view: View, scene: Scene, image: Cut) -> None:
        self.rows = int(np.clip(round(view.row(0.0)), 8, view.shape[0]))
        self.still = Lighting(image.shape)
        skin_px = max(_SKIN_SHARE * scene.blade.depth_mm / view.step_mm, _CLEAR_PX + 1)
        x_mm = view.x_mm(np.arange(view.shape[1], dtype=float))
        self.top = np.asarray(view.row(initial_surface_mm(scene, x_mm)))
        self._first = int(np.clip(math.ceil(view.column(0.0) + _CLEAR_PX + 1), 0, view.shape[1] - 1))
        self.light = self._along_the_sand(image)
        thin = image[: self.rows : 4, ::4] / self.light[::4]
        low, high = np.percentile(thin, [0.1, 99.9])
        self._low, self._scale = float(low), float((_LEVELS - 1) / max(high - low, 1e-6))
        self._known = np.where(
            np.arange(view.shape[1]) >= self._first, np.ceil(self.top - _CLEAR_PX), 0
        ).clip(0, self.rows)
        self._rest = np.zeros((int(self._known.max()), view.shape[1]), np.uint8)
        self.tables = self._learn(image, skin_px)
        self.unknown_air = _UNKNOWN_AIR / _LEVELS
        self.unknown_sand = _UNKNOWN_SAND / _LEVELS

    @property
    def known_rows(self) -> NDArray[np.int64]:
        """Rows of each column, from the top, whose look at rest counts as air: (w,)."""
        return np.asarray(self._known.astype(np.int64))

    def band(self, image: Cut, lighting: Lighting, first: int, last: int) -> Band:
        """Rows first to last - 1 above the tip's level, ready to be compared with the tables."""
        upper, lower = max(first - _HALO_PX, 0), min(last + _HALO_PX, image.shape[0])
        wide = np.array(image[upper:lower], dtype=np.float32, order="C")
        lighting.even(wide, upper, 0)
        wide *= (1 / self.light).astype(np.float32)
        level = self._levels(wide)
        change = np.full(level.shape, _LEVELS * _FINE - 1, np.uint16)
        known = min(lower, len(self._rest)) - upper
        if known > 0:
            rest = self._rest[upper : upper + known]
            off = level[:known].astype(np.float32)
            off -= rest
            off = np.abs(cv2.GaussianBlur(off, (0, 0), _PATCH_PX), out=off)
            np.minimum(off * _FINE + 0.5, _LEVELS * _FINE - 1, out=off)
            change[:known] = off
        part = slice(first - upper, first - upper + last - first)
        return Band(first, wide[part], level[part], change[part])

    def _along_the_sand(self, image: Cut) -> Floats:
        """Light in each column relative to the whole, (w,): how bright the sand at rest is there."""
        width = image.shape[1]
        side = 8
        starts = np.arange(self._first, width - side + 1, side)
        lower = self.rows - int(_CLEAR_PX)
        places, values = [], []
        for start in starts:
            upper = int(self.top[start : start + side].max() + _CLEAR_PX) + 1
            if lower - upper >= 4:
                places.append(start + side / 2)
                values.append(float(np.mean(image[max(upper, 0) : lower : 2, start : start + side])))
        if len(places) < 8 or max(values) <= 0:
            return np.ones(width)
        smooth = gaussian_filter1d(values, max(_STREAK_SHARE * width / side, 1.0), mode="nearest")
        light = np.interp(np.arange(width), places, smooth / np.median(smooth))
        return np.asarray(np.maximum(light, _LEAST_LIGHT))

    def _learn(self, image: Cut, skin_px: float) -> Tables:
        """Histograms of air, skin and sand at rest, a few rows at a time."""
        count = np.zeros((3, _LEVELS))
        jumps = np.zeros(_LEVELS)
        part = slice(self._first, None)
        top = self.top[part]
        for first in range(0, self.rows, _CHUNK):
            last = min(first + _CHUNK, self.rows)
            upper, lower = max(first - _HALO_PX, 0), min(last + _HALO_PX, image.shape[0])
            wide = image[upper:lower] / self.light.astype(np.float32)
            level = self._levels(wide.astype(np.float32))[first - upper :][: last - first]
            rest = self._rest[first:last]
            rest[...] = level[: len(rest)]
            level, row = level[:, part], np.arange(first, last)[:, None]
            air = row < top - _CLEAR_PX
            sand = (row > top + _CLEAR_PX) & (row < self.rows - _CLEAR_PX)
            skin = (row > top + _CLEAR_PX - 1) & (row < top + skin_px)
            for which, mask in enumerate((air, skin, sand)):
                count[which] += np.bincount(level[mask], minlength=_LEVELS)
            both = air[:, 1:] & air[:, :-1]
            jump = np.abs(level[:, 1:].astype(np.int16) - level[:, :-1])[both]
            jumps += np.bincount(jump, minlength=_LEVELS)
        noise = max(_median_of(jumps) * 1.4826 / math.sqrt(2), 2.0)
        half = (1 - _UNKNOWN_AIR) / 2
        return Tables(
            air=(half * _density(count[0]) + _UNKNOWN_AIR / _LEVELS).astype(np.float32),
            skin=_logarithm(count[1], _UNKNOWN_SKIN),
            sand=_logarithm(count[2], _UNKNOWN_SAND),
            same=(half * _bell(max(noise / _PATCH_PX, _FLICKER))).astype(np.float32),
        )

    def _levels(self, grey: Image) -> Bytes:
        """Grey as 256 levels over the first frame's range, lightly smoothed."""
        smooth = cv2.GaussianBlur(grey, (0, 0), _BLUR_PX)
        level = np.subtract(smooth, self._low, dtype=np.float32)
        np.multiply(level, self._scale, out=level)
        return np.clip(level, 0, _LEVELS - 1, out=level).astype(np.uint8)


def _density(count: Floats) -> Floats:
    """Smooth density of grey levels, (256,), sum 1; flat where nothing was seen."""
    if not count.any():
        return np.full(_LEVELS, 1 / _LEVELS)
    smooth = gaussian_filter1d(count, 3.0, mode="nearest")
    return np.asarray(smooth / smooth.sum())


def _logarithm(count: Floats, unknown: float) -> Image:
    return np.log((1 - unknown) * _density(count) + unknown / _LEVELS).astype(np.float32)


def _median_of(count: Floats) -> float:
    """Median of whole numbers that were counted."""
    if not count.any():
        return 0.0
    return float(np.searchsorted(np.cumsum(count), count.sum() / 2))


def _bell(std: float) -> Floats:
    """Normal density of a difference of grey levels, tabulated at 1 / _FINE of a level."""
    place = np.arange(_LEVELS * _FINE) / _FINE
    return np.asarray(np.exp(-0.5 * (place / std) ** 2) / (std * math.sqrt(2 * math.pi)))
