"""What the synthetic camera sees: its frame, the blade painted exactly, light, noise and rounding."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Direction
from ploughval.synth.motion import Floats, Motion
from ploughval.synth.options import SynthOptions

_WORD_PER_GREY = {8: 1.0, 16: 257.0}


@dataclass(frozen=True, slots=True)
class View:
    """Frame of the photographs while the blade still travels to the right in them.

    Attributes
    ----------
    shape : (int, int), px, height and width
    tip_px : (float, float), px, blade face at tip level before motion
    mm_per_px : float
    """

    shape: tuple[int, int]
    tip_px: tuple[float, float]
    mm_per_px: float

    def to_px(self, points_mm: Floats) -> Floats:
        """World (N, 2) mm to image (N, 2) px."""
        points_px: Floats = points_mm * np.array([1.0, -1.0]) / self.mm_per_px + np.array(self.tip_px)
        return points_px

    def to_mm(self, points_px: Floats) -> Floats:
        """Image (N, 2) px to world (N, 2) mm."""
        points_mm: Floats = (points_px - np.array(self.tip_px)) * np.array([1.0, -1.0]) * self.mm_per_px
        return points_mm

    def stated_tip_px(self, direction: Direction) -> tuple[float, float]:
        """The tip as test.toml states it: mirrored where the blade travels to the left."""
        x, y = self.tip_px
        return (x, y) if direction is Direction.RIGHT else (self.shape[1] - 1 - x, y)

    def moved(self, shift_px: tuple[float, float]) -> "View":
        """The same frame when the camera has moved so that all it shows stands elsewhere in the picture."""
        return replace(self, tip_px=(self.tip_px[0] + shift_px[0], self.tip_px[1] + shift_px[1]))

    def marker_places_px(self, count: int, radius_px: float) -> Floats:
        """Where markers are painted (count, 2), px: by turns below the tip and along the upper edge."""
        height, width = self.shape
        margin = 2.5 * radius_px + 2
        number = np.arange(count)
        across = (number // 2 + 0.5 + 0.25 * (number % 2)) / max((count + 1) // 2, 1)
        x = margin + across * (width - 1 - 2 * margin) + 0.37 * number % 1.0
        y = np.where(number % 2 == 0, height - 1 - margin, margin) + 0.61 * number % 1.0
        return np.column_stack([x, y])

    def blade_cover(self, u_mm: float, thickness_mm: float) -> NDArray[np.float32]:
        """Share of each pixel that the blade covers, exact: (H, W) float32."""
        face = self.tip_px[0] + u_mm / self.mm_per_px
        across = _overlap(face - thickness_mm / self.mm_per_px, face, self.shape[1])
        down = _overlap(-1.0, self.tip_px[1], self.shape[0])
        return np.outer(down, across).astype(np.float32)


def _overlap(start: float, end: float, size: int) -> Floats:
    """Length of [start, end] in each of ``size`` pixels whose centres are at integers."""
    left = np.arange(size) - 0.5
    cover: Floats = np.maximum(np.minimum(left + 1, end) - np.maximum(left, start), 0.0)
    return cover


def frame_view(motion: Motion, options: SynthOptions) -> View:
    """The frame that shows the test from below the tip to above the highest heap, widened by margins."""
    depth, scale = options.depth_mm, options.mm_per_px
    raised = [s[s[:, 1] > 1.003 * depth, 0].max(initial=0.0) for s in motion.surfaces]
    right = max(float(motion.outcrop_x_mm.max()), *raised) + _margin(options.ahead_mm, 0.4 * depth)
    top = max(float(s[:, 1].max()) for s in motion.surfaces) + _margin(options.above_mm, 0.25 * depth)
    left_px = round((options.thickness_mm + _margin(options.behind_mm, 0.4 * depth)) / scale, 1)
    top_px = round(top / scale, 1)
    below_mm = _margin(options.below_mm, 0.25 * depth)
    shape = (int(top_px + below_mm / scale) + 1, int(left_px + right / scale) + 1)
    return View(shape, (left_px, top_px), scale)


def _margin(stated_mm: float | None, usual_mm: float) -> float:
    return usual_mm if stated_mm is None else stated_mm


def light_field(shape: tuple[int, int], *, vignetting: float, gradient: float) -> NDArray[np.float32]:
    """Relative light: 1 in the middle, less in the corners, changing slowly from left to right."""
    height, width = shape
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    field = (1 - vignetting * (x * x + y * y) / 2) * (1 + gradient * x / 2)
    return np.asarray(field, dtype=np.float32)


def expose(
    picture: NDArray[np.float32], rng: np.random.Generator, *, noise_grey: float, bit_depth: int
) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Add the camera's noise and round to 8 or 16 bit (257 levels for each level of the 8-bit scale)."""
    noisy = picture + np.float32(noise_grey) * rng.standard_normal(picture.shape, dtype=np.float32)
    per_grey = _WORD_PER_GREY[bit_depth]
    levels = np.clip(np.rint(noisy * np.float32(per_grey)), 0, 255 * per_grey)
    return levels.astype(np.uint8) if bit_depth == 8 else levels.astype(np.uint16)
