"""Photographs in world millimetres, as many pixels as a page can show, whatever the calibration."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ploughval.errors import DataError, PloughvalError
from ploughval.report.figures.layers import Extent, Picture
from ploughval.report.grey import TAILS, Grey, ToPixels, stretched
from ploughval.results import Results
from ploughval.scene import load_scene

OUTSIDE = 235
_JPEG_ENDINGS = {".jpg", ".jpeg", ".jpe"}
_JPEG_SCALES = (8, 4, 2)  # at which a JPEG is decoded from its coarse coefficients alone
_FACTORS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
_OVER = 1.18  # a photograph may be made smaller than the picture by as much, if that spares decoding it whole
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class WorldGrid:
    """Where the pixels of an upright picture of the world lie in a photograph that was made smaller.

    Attributes
    ----------
    factor : int
        Means of factor x factor pixels make a pixel of the smaller photograph.
    x, y : (h, w) float32, px
        Places in it.
    inside : (h, w) bool
        Whether the photograph reaches there.
    extent : tuple of float, mm
        x0, x1, y0, y1 of the whole grid, cut to what the photograph reaches.
    """

    factor: int
    x: NDArray[np.float32]
    y: NDArray[np.float32]
    inside: NDArray[np.bool_]
    extent: Extent

    @classmethod
    def of(cls, calibration: ToPixels, shape: tuple[int, ...], extent: Extent, width: int) -> "WorldGrid":
        """A grid over part of the world, so many pixels across; the height follows with square pixels."""
        x0, x1, y0, y1 = extent
        pitch = (x1 - x0) / width
        height = max(1, round((y1 - y0) / pitch))
        x = x0 + (np.arange(width) + 0.5) * pitch
        y = y1 - (np.arange(height) + 0.5) * (y1 - y0) / height
        px = calibration.to_px(np.stack(np.meshgrid(x, y), axis=-1))
        middle = px[height // 2, width // 2 : width // 2 + 2]
        step = float(np.hypot(*(middle[-1] - middle[0]))) if width > 1 else 1.0
        factor = max(f for f in _FACTORS if f <= max(1.0, step * (1.0 if f < 4 else _OVER)))
        inside = _inside(px, shape)
        at = ((px - (factor - 1) / 2) / factor).astype(np.float32)
        whole = slice(None), slice(None)
        rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
        part = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)) if rows.size else whole
        if rows.size:
            dx, dy = pitch, (y1 - y0) / height
            extent = (
                x0 + columns[0] * dx,
                x0 + (columns[-1] + 1) * dx,
                y1 - (rows[-1] + 1) * dy,
                y1 - rows[0] * dy,
            )
        held = tuple(float(side) for side in extent)
        return cls(factor, at[part][..., 0], at[part][..., 1], inside[part], held)  # type: ignore[arg-type]

    def picture(self, small: Grey) -> Picture:
        """The picture of a photograph that was made smaller by the factor; grey where there is none."""
        # Places are rounded to 1/32 of a pixel there: enough to look at.
        grey = cv2.remap(small, self.x, self.y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        grey = np.where(self.inside, grey, np.uint8(OUTSIDE))
        return Picture(grey=np.ascontiguousarray(grey, dtype=np.uint8), extent=self.extent)


def _inside(px: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Which of the picture's pixels lie in the photograph."""
    x, y = px[..., 0], px[..., 1]
    inside: NDArray[np.bool_] = (x >= -0.5) & (x <= shape[1] - 0.5) & (y >= -0.5) & (y <= shape[0] - 0.5)
    return inside


def shrunk(image: Grey, factor: int) -> Grey:
    """Means of factor x factor pixels, so that resampling does not alias the grains."""
    if factor == 1:
        return image
    height, width = (max(side // factor, 1) for side in image.shape)
    whole = image[: height * factor, : width * factor]
    small: Grey = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)  # type: ignore[assignment]
    return small


class Photographs:
    """The photographs behind a result folder, if they can still be read.

    Attributes
    ----------
    missing : str
        Why none is shown; empty where they can be.
    unread : dict of int to str
        Frames that were asked for and could not be read, and why.
    """

    def __init__(self, results: Results) -> None:
        self.missing: str = ""
        self.unread: dict[int, str] = {}
        self._frames: Any = None
        self._calibration: ToPixels | None = None
        self._channel = "grey"
        self._grids: dict[tuple[Extent, int], WorldGrid] = {}
        self._levels: dict[int, tuple[float, float]] = {}
        if not results.run.folder:
            self.missing = "The photographs are not shown: run.json does not say where the test folder is."
            return
        # Only here: a report without photographs needs no image library.
        from ploughval.photos import calibrate, open_frames

        try:
            scene = load_scene(results.run.folder)
            same = scene.settings_hash == results.run.settings_hash
            if results.run.settings_hash and not (
                same or same_pictures(scene.model_dump(mode="json"), results.run.settings)
            ):
                self.missing = "The photographs are not shown: test.toml has changed since the run."
                return
            if scene.camera is None:
                self.missing = "The test has no photographs."
                return
            self._channel = scene.camera.channel
            self._frames = open_frames(scene)
            self._calibration = results.calibration or calibrate(scene, self._frames)
        except (PloughvalError, OSError) as error:
            _log.info("no photographs for the report: %s", error)
            self.missing = "The photographs are not shown: the test folder can no longer be read as it was."

    def native_width(self, extent: Extent) -> int:
        """Pixels of the photographs across a part of the world; 0 without photographs."""
        if self._calibration is None:
            return 0
        x0, x1, y0, y1 = extent
        middle = np.array([[(x0 + x1) / 2 - 0.5, (y0 + y1) / 2], [(x0 + x1) / 2 + 0.5, (y0 + y1) / 2]])
        first, second = self._calibration.to_px(middle)
        return max(1, round(float(np.hypot(*(second - first))) * (x1 - x0)))

    def picture(self, frame: int, extent: Extent, *, width: int) -> Picture | None:
        """One frame in world millimetres, or None where it cannot be read.

        All frames are stretched between the same two greys, so that a series of them does not flicker.
        """
        if self._frames is None or self._calibration is None:
            return None
        grid = self.grid(extent, width)
        small = self._small(frame, grid.factor)
        if small is None:
            return None
        return grid.picture(stretched(small, *self.levels(grid.factor)))

    def grid(self, extent: Extent, width: int) -> WorldGrid:
        """The grid of a picture, computed once."""
        if (extent, width) not in self._grids:
            assert self._calibration is not None
            self._grids[extent, width] = WorldGrid.of(self._calibration, self._frames.shape, extent, width)
        return self._grids[extent, width]

    def levels(self, factor: int) -> tuple[float, float]:
        """Greys that become black and white, from the first, the middle and the last frame."""
        if factor not in self._levels:
            count = len(self._frames)
            sample = [self._small(frame, factor) for frame in sorted({0, count // 2, count - 1})]
            greys = [small[::2, ::2].ravel().astype(np.float32) for small in sample if small is not None]
            low, high = np.percentile(np.concatenate(greys), TAILS) if greys else (0.0, 255.0)
            self._levels[factor] = float(low), float(high)
        return self._levels[factor]

    def _small(self, frame: int, factor: int) -> Grey | None:
        try:
            if self._coarse(frame, factor):
                return self._jpeg(frame, factor)
            return shrunk(self._frames.read(frame), factor)
        except (PloughvalError, OSError, IndexError) as error:
            _log.info("frame %d is not shown: %s", frame, error)
            self.unread[frame] = _reason(error)
            return None

    def _coarse(self, frame: int, factor: int) -> bool:
        """Whether a frame can be decoded at a fraction of its size."""
        frames = self._frames
        known = 0 <= frame < len(frames) and frame not in frames.faults
        one = known and not (frames.pages and frames.pages[frame])
        if not one or factor == 1 or self._channel != "grey":
            return False
        return frames.paths[frame].suffix.lower() in _JPEG_ENDINGS

    def _jpeg(self, frame: int, factor: int) -> Grey:
        """A JPEG's luma decoded at the coarsest fraction that the factor is a multiple of."""
        path: Path = self._frames.paths[frame]
        scale = next((one for one in _JPEG_SCALES if factor % one == 0), 1)
        with Image.open(path) as image:
            height, width = self._frames.shape
            if image.format != "JPEG" or image.size != (width, height) or scale == 1:
                return shrunk(self._frames.read(frame), factor)
            image.draft("L", (width // scale, height // scale))
            if image.mode != "L" or image.size[0] > -(-width // scale):
                return shrunk(self._frames.read(frame), factor)
            return shrunk(np.asarray(image), factor // scale)


def _reason(error: Exception) -> str:
    """What an error says, without where the file lies on this machine."""
    if not isinstance(error, DataError):
        return f"the file cannot be read ({type(error).__name__})"
    place = ", ".join(part for part in (error.path, f"frame {error.frame}") if part)
    return str(error).removeprefix(f"{place}: ").removeprefix(f"{error.path}: ")


def same_pictures(now: Mapping[str, Any], then: Mapping[str, Any]) -> bool:
    """Whether settings show the photographs of a run as it saw them: name and notes may be others."""
    words: dict[str, Any] = {"test": {}}
    return unchanged({**now, **words}, {**then, **words})


def unchanged(now: Mapping[str, Any], then: Mapping[str, Any]) -> bool:
    """Whether settings are those of a run, but for keys that came later and are empty.

    >>> unchanged({"depth_mm": 30.0, "lens": ""}, {"depth_mm": 30.0})
    True
    >>> unchanged({"depth_mm": 30.0, "lens": "50 mm"}, {"depth_mm": 30.0})
    False
    """
    if not set(then) <= set(now):
        return False
    for key, value in now.items():
        before = then.get(key)
        if isinstance(value, Mapping) and isinstance(before, Mapping):
            if not unchanged(value, before):
                return False
        elif value != before and not (key not in then and value in ("", [], {})):
            return False
    return True


def open_photographs(results: Results) -> Photographs | None:
    """The photographs of a test, None where its run had none."""
    return Photographs(results) if results.run.frames else None
