"""Photographs in world millimetres, as many pixels as a page can show, whatever the calibration."""

import logging
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from ploughval.errors import PloughvalError
from ploughval.report.figures.layers import Extent, Picture
from ploughval.report.results import Results
from ploughval.scene import load_scene

OUTSIDE = 235.0
_log = logging.getLogger(__name__)


class ToPixels(Protocol):
    """The part of a calibration that figures use."""

    def to_px(self, mm: Any) -> NDArray[np.float64]:
        """World points (..., 2), mm, as image points (..., 2), px."""


def eight_bit(image: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Greys of any depth stretched between their 0.5 and 99.5 percentiles, (H, W) uint8."""
    grey = np.asarray(image, dtype=np.float32)
    low, high = np.percentile(grey[::4, ::4], (0.5, 99.5))
    scaled = (grey - low) / max(float(high - low), 1.0)
    grey8: NDArray[np.uint8] = (np.clip(scaled, 0, 1) * 255).astype(np.uint8)
    return grey8


def world_picture(
    image: NDArray[np.generic], calibration: ToPixels, extent: Extent, *, width: int = 900
) -> Picture:
    """A photograph resampled onto an upright grid of the world.

    Parameters
    ----------
    image : (H, W) uint8 or uint16
        The photograph.
    calibration : Calibration
        Only its ``to_px`` is used; it may mirror, turn or warp.
    extent : tuple of float, mm
        x0, x1, y0, y1: part of the world that is shown.
    width : int
        Pixels across; the height follows with square pixels.
    """
    x0, x1, y0, y1 = extent
    pitch = (x1 - x0) / width
    height = max(1, round((y1 - y0) / pitch))
    x = x0 + (np.arange(width) + 0.5) * pitch
    y = y1 - (np.arange(height) + 0.5) * (y1 - y0) / height
    px = calibration.to_px(np.stack(np.meshgrid(x, y), axis=-1))
    middle = px[height // 2, width // 2 : width // 2 + 2]
    factor = max(1, int(np.hypot(*(middle[-1] - middle[0])))) if width > 1 else 1
    small = _shrink(eight_bit(image), factor)
    at = (px - (factor - 1) / 2) / factor
    grey = map_coordinates(small, [at[..., 1], at[..., 0]], order=1, mode="constant", cval=OUTSIDE)
    return _trimmed(np.clip(np.round(grey), 0, 255).astype(np.uint8), _inside(px, image.shape), extent)


def _inside(px: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Which of the picture's pixels lie in the photograph."""
    x, y = px[..., 0], px[..., 1]
    inside: NDArray[np.bool_] = (x >= -0.5) & (x <= shape[1] - 0.5) & (y >= -0.5) & (y <= shape[0] - 0.5)
    return inside


def _trimmed(grey: NDArray[np.uint8], inside: NDArray[np.bool_], extent: Extent) -> Picture:
    """Without the margins that the photograph does not reach."""
    if not inside.any():
        return Picture(grey=grey, extent=extent)
    rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    top, bottom, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    x0, x1, y0, y1 = extent
    dx, dy = (x1 - x0) / grey.shape[1], (y1 - y0) / grey.shape[0]
    held = (x0 + left * dx, x0 + right * dx, y1 - bottom * dy, y1 - top * dy)
    return Picture(grey=grey[top:bottom, left:right], extent=held)


def _shrink(image: NDArray[np.uint8], factor: int) -> NDArray[np.float32]:
    """Means of factor x factor pixels, so that resampling does not alias the grains."""
    height, width = (side - side % factor for side in image.shape)
    blocks = image[:height, :width].astype(np.float32)
    small: NDArray[np.float32] = blocks.reshape(height // factor, factor, -1, factor).mean(axis=(1, 3))
    return small


class Photographs:
    """The photographs behind a result folder, if they can still be read."""

    def __init__(self, results: Results) -> None:
        self.missing: str = ""
        self._frames: Any = None
        self._calibration: ToPixels | None = None
        if not results.run.folder:
            self.missing = "The photographs are not shown: run.json does not say where the test folder is."
            return
        # Only here: a report without photographs needs no image library.
        from ploughval.photos import calibrate, open_frames

        try:
            scene = load_scene(results.run.folder)
            if results.run.settings_hash and scene.settings_hash != results.run.settings_hash:
                self.missing = "The photographs are not shown: test.toml has changed since the run."
                return
            if scene.camera is None:
                self.missing = "The test has no photographs."
                return
            self._frames = open_frames(scene)
            self._calibration = results.calibration or calibrate(scene, self._frames)
        except (PloughvalError, OSError) as error:
            _log.info("no photographs for the report: %s", error)
            self.missing = "The photographs are not shown: the test folder can no longer be read as it was."

    def picture(self, frame: int, extent: Extent, *, width: int) -> Picture | None:
        """One frame in world millimetres, or None where it cannot be read."""
        if self._frames is None or self._calibration is None:
            return None
        try:
            image = self._frames.read(frame)
        except (PloughvalError, OSError, IndexError) as error:
            _log.info("frame %d is not shown: %s", frame, error)
            return None
        return world_picture(image, self._calibration, extent, width=width)
