"""The photograph as the tracers see it: on a grid of world axes, the blade travelling to the right.

With a plain scale the grid is the picture's own pixels, cropped and mirrored: nothing is resampled.
Otherwise it is sampled bilinearly at one pixel's spacing (only the watcher reads it; points are mapped).
"""

from typing import Any, Protocol, TypeVar, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError

Floats = NDArray[np.float64]
Image = NDArray[np.float32]
Mask = NDArray[np.bool_]
Bytes = NDArray[np.uint8]
Levels = NDArray[np.uint8] | NDArray[np.uint16]
Place = TypeVar("Place", float, Floats)

_ON_PIXELS = 1e-4  # px: a grid this close to whole pixels is the picture itself
_EDGE_POINTS = 64


class Mapping(Protocol):
    """What the tracers ask of a calibration."""

    @property
    def mm_per_px(self) -> float: ...  # noqa: D102

    def to_mm(self, px: Floats, /) -> Floats: ...  # noqa: D102

    def to_px(self, mm: Floats, /) -> Floats: ...  # noqa: D102


class Resampled:
    """A photograph sampled bilinearly on another grid, part by part: ``resampled[rows, columns]``.

    Parameters
    ----------
    image : (H, W) uint8 or uint16
    maps : where each node lies in the image, as ``cv2.convertMaps`` gives them
    """

    def __init__(self, image: Levels, maps: tuple[NDArray[Any], NDArray[Any]]) -> None:
        self._image, self._maps = image, maps
        self.shape: tuple[int, int] = (maps[1].shape[0], maps[1].shape[1])
        self.dtype = image.dtype

    def __getitem__(self, part: slice | tuple[slice, slice]) -> Levels:
        """Nodes of the grid, chosen by slices of rows, or of rows and columns."""
        whole, parts = (np.ascontiguousarray(m[part]) for m in self._maps)
        return cast(
            Levels,
            cv2.remap(self._image, whole, parts, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE),
        )


Cut = Levels | Resampled


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
        self._maps: tuple[NDArray[Any], NDArray[Any]] | None = None  # whole pixels, and 32nd parts
        self._inverse: NDArray[np.int32] | None = None
        self._slices = self._whole_pixels()
        if self._slices is None:
            self._maps = cv2.convertMaps(*self._places(), cv2.CV_16SC2)

    def _places(self) -> tuple[Image, Image]:
        """Where in the photograph each node of the grid lies: columns and rows, (h, w) float32 each."""
        maps = (np.empty(self.shape, np.float32), np.empty(self.shape, np.float32))
        x_mm = self.x_mm(np.arange(float(self.shape[1])))
        for row in range(self.shape[0]):  # row by row: the whole grid in float64 would fill the memory
            px = self._calibration.to_px(np.column_stack([x_mm, np.full_like(x_mm, self.y_mm(float(row)))]))
            maps[0][row], maps[1][row] = px.T
        return maps

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

    def cut(self, image: Levels) -> "Cut":
        """The photograph on the grid, (h, w), in its own grey levels; parts of it are made when asked for."""
        if self._slices is not None:
            return image[self._slices]
        assert self._maps is not None
        return Resampled(image, self._maps)

    def uncut(self, grid: Bytes, outside: int) -> Bytes:
        """Values on the grid as those of the whole photograph, (H, W) uint8, ``outside`` beyond the view."""
        x0, y0, x1, y1 = self._box
        whole = np.empty(self._image_shape, np.uint8)
        if (x1 - x0, y1 - y0) != self._image_shape[::-1]:
            whole[...] = outside
        if self._slices is not None:
            whole[self._slices] = grid
            return whole
        if self._inverse is None:
            self._inverse = self._nearest_nodes()
        whole[y0:y1, x0:x1] = grid.ravel()[self._inverse]
        return whole

    def _nearest_nodes(self) -> NDArray[np.int32]:
        """Index of the grid's node next to each pixel of the view."""
        x0, y0, x1, y1 = self._box
        index = np.empty((y1 - y0, x1 - x0), np.int32)
        for row in range(y0, y1):
            px = np.column_stack([np.arange(x0, x1), np.full(x1 - x0, row)]).astype(float)
            mm = self._calibration.to_mm(px)
            col = np.clip(np.rint(self.column(mm[:, 0])), 0, self.shape[1] - 1)
            index[row - y0] = np.clip(np.rint(self.row(mm[:, 1])), 0, self.shape[0] - 1) * self.shape[1] + col
        return index

    def offset(self, shift_px: tuple[float, float]) -> tuple[float, float]:
        """Columns and rows of the grid that a small shift in the photograph amounts to, in its middle."""
        x0, y0, x1, y1 = self._box
        middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
        first, last = self._calibration.to_mm(np.stack([middle, middle + shift_px]))
        return (
            float(self.column(last[0]) - self.column(first[0])),
            float(self.row(last[1]) - self.row(first[1])),
        )

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


def moved_back(values: NDArray[Any], shift_px: tuple[int, int], border: int | None = None) -> NDArray[Any]:
    """Pixels of a picture put back by a whole shift: what stands at p + shift comes to p.

    Parameters
    ----------
    values : (H, W)
        Grey levels or codes.
    shift_px : (int, int)
        Right and down.
    border : int or None
        Value of pixels that come from outside; None: the nearest one inside.

    Returns
    -------
    (H, W), the same array where the shift is (0, 0)
    """
    x, y = shift_px
    if x == 0 and y == 0:
        return values
    height, width = values.shape
    rows = np.clip(np.arange(height) + y, 0, height - 1)
    columns = np.clip(np.arange(width) + x, 0, width - 1)
    moved = values[rows][:, columns]
    if border is not None:
        moved[np.arange(height) + y != rows] = border
        moved[:, np.arange(width) + x != columns] = border
    return moved
