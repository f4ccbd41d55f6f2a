"""The photograph as the tracers see it: on a grid of world axes, the blade travelling to the right.

With a plain scale the grid is the picture's own pixels, cropped and mirrored: nothing is resampled.
Otherwise it is sampled bilinearly at one pixel's spacing (only the watcher reads it; points are mapped).
"""

from typing import Protocol, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError

Floats = NDArray[np.float64]
Image = NDArray[np.float32]
Mask = NDArray[np.bool_]
Place = TypeVar("Place", float, Floats)

_ON_PIXELS = 1e-4  # px: a grid this close to whole pixels is the picture itself
_EDGE_POINTS = 64


class Mapping(Protocol):
    """What the tracers ask of a calibration."""

    @property
    def mm_per_px(self) -> float: ...  # noqa: D102

    def to_mm(self, px: Floats, /) -> Floats: ...  # noqa: D102

    def to_px(self, mm: Floats, /) -> Floats: ...  # noqa: D102


class View:
    """Grid of world axes over the part of the photograph that shows the test.

    Parameters
    ----------
    image_shape : (H, W) of the photographs, px
    calibration : maps px to mm
    view_px : (x0, y0, x1, y1), px, the part to look at, x1 and y1 excluded; None: all of it

    Attributes
    ----------
    shape : (h, w) of the grid; columns run with the travel, rows downwards
    step_mm : float, spacing of the grid, mm
    """

    def __init__(
        self,
        image_shape: tuple[int, int],
        calibration: Mapping,
        view_px: tuple[int, int, int, int] | None = None,
    ) -> None:
        height, width = image_shape
        x0, y0, x1, y1 = (0, 0, width, height) if view_px is None else view_px
        self._box = (max(x0, 0), max(y0, 0), min(x1, width), min(y1, height))
        if self._box[2] - self._box[0] < 16 or self._box[3] - self._box[1] < 16:
            raise CalibrationError(
                f"camera.view_px {list(view_px or ())} leaves less than 16 x 16 px of the "
                f"{width} x {height} px photographs; expected [x0, y0, x1, y1] inside them"
            )
        self._image_shape = image_shape
        self._calibration = calibration
        self.step_mm = float(calibration.mm_per_px)
        edge_mm = calibration.to_mm(_outline(self._box))
        if not np.isfinite(edge_mm).all():
            raise CalibrationError("the calibration does not cover camera.view_px: give a smaller part")
        self._left_mm, self._top_mm = float(edge_mm[:, 0].min()), float(edge_mm[:, 1].max())
        span = np.array([np.ptp(edge_mm[:, 0]), np.ptp(edge_mm[:, 1])]) / self.step_mm
        self.shape = (round(float(span[1])) + 1, round(float(span[0])) + 1)
        self._maps: tuple[Image, Image] | None = None
        self._inverse: NDArray[np.intp] | None = None
        self._slices = self._whole_pixels()
        if self._slices is None:
            grid_px = calibration.to_px(self._grid_mm()).astype(np.float32)
            self._maps = (grid_px[..., 0].copy(), grid_px[..., 1].copy())

    def _grid_mm(self) -> Floats:
        rows, cols = np.mgrid[: self.shape[0], : self.shape[1]]
        return np.stack([self.x_mm(cols), self.y_mm(rows)], axis=-1)

    def _whole_pixels(self) -> tuple[slice, slice] | None:
        """Slices that cut the grid out of the photograph, where its nodes are whole pixels."""
        height, width = self.shape
        corners = np.array([[0, 0], [width - 1, 0], [0, height - 1], [width - 1, height - 1]], float)
        middle = np.array([[(width - 1) / 2, (height - 1) / 2]])
        nodes = np.concatenate([corners, np.floor(middle)])
        px = self._calibration.to_px(np.stack([self.x_mm(nodes[:, 0]), self.y_mm(nodes[:, 1])], axis=-1))
        whole = np.rint(px)
        if np.abs(px - whole).max() > _ON_PIXELS:
            return None
        flip = whole[1, 0] < whole[0, 0]
        expected = whole[0] + nodes * [-1 if flip else 1, 1]
        if np.abs(expected - px).max() > _ON_PIXELS:
            return None
        x0, y0, x1, y1 = self._box
        return slice(y0, y1), slice(x1 - 1, x0 - 1 if x0 else None, -1) if flip else slice(x0, x1)

    def cut(self, image: NDArray[np.uint8] | NDArray[np.uint16]) -> Image:
        """The photograph on the grid, (h, w) float32, grey levels of the file."""
        if self._slices is not None:
            return np.ascontiguousarray(image[self._slices], dtype=np.float32)
        assert self._maps is not None
        return np.asarray(
            cv2.remap(
                image.astype(np.float32), *self._maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
            )
        )

    def uncut(self, mask: Mask) -> Mask:
        """A mask on the grid as a mask of the whole photograph, (H, W) bool, False outside the view."""
        whole = np.zeros(self._image_shape, dtype=bool)
        if self._slices is not None:
            whole[self._slices] = mask
            return whole
        x0, y0, x1, y1 = self._box
        if self._inverse is None:
            rows, cols = np.mgrid[y0:y1, x0:x1]
            mm = self._calibration.to_mm(np.stack([cols, rows], axis=-1).astype(float))
            col = np.clip(np.rint(self.column(mm[..., 0])), 0, self.shape[1] - 1)
            row = np.clip(np.rint(self.row(mm[..., 1])), 0, self.shape[0] - 1)
            self._inverse = (row * self.shape[1] + col).astype(np.intp)
        whole[y0:y1, x0:x1] = mask.ravel()[self._inverse]
        return whole

    def x_mm(self, column: Place) -> Place:
        """World x of a column, mm."""
        return self._left_mm + column * self.step_mm

    def y_mm(self, row: Place) -> Place:
        """World y of a row, mm."""
        return self._top_mm - row * self.step_mm

    def column(self, x_mm: Place) -> Place:
        """Column of a world x, px of the grid."""
        return (x_mm - self._left_mm) / self.step_mm

    def row(self, y_mm: Place) -> Place:
        """Row of a world y, px of the grid."""
        return (self._top_mm - y_mm) / self.step_mm


def _outline(box: tuple[int, int, int, int]) -> Floats:
    """Points along the outline of a box of pixels, (N, 2) px."""
    x = np.linspace(box[0], box[2] - 1, _EDGE_POINTS)
    y = np.linspace(box[1], box[3] - 1, _EDGE_POINTS)
    across = [np.stack([x, np.full_like(x, v)], axis=-1) for v in (y[0], y[-1])]
    down = [np.stack([np.full_like(y, v), y], axis=-1) for v in (x[0], x[-1])]
    return np.concatenate([*across, *down])
