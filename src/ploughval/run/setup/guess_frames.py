"""A few photographs of a series, made small enough to guess from, without the borders of the pictures."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.errors import PloughvalError
from ploughval.photos.reading.grey import Samples
from ploughval.photos.reading.reader import Reader

Image = NDArray[np.float32]

FRAMES = 9
"""Photographs that are decoded."""
MOST_PIXELS = 2_000_000
"""A larger photograph is averaged over squares of pixels."""
_WHITE = 0.999  # share of the pixels of 16 bits that are no brighter than white
_EVEN_GREY = 1.5  # a border's grey varies less than this
_LEAST_BORDER_PX = 3
_LEAST_SIDE_PX = 32


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Photographs that can be read, in their order, and where they stand in the series.

    Attributes
    ----------
    numbers : (K,) int
        Their places in the series, from 0.
    images : (K, h, w) float32
        Grey levels, about 0 to 255, of the view alone.
    shrink : int
        Pixels of the photograph a pixel of these.
    view_px : (x0, y0, x1, y1)
        The part of the photograph inside its borders, px.
    bordered : bool
        Whether there are borders.
    """

    numbers: NDArray[np.intp]
    images: NDArray[np.float32]
    shrink: int
    view_px: tuple[int, int, int, int]
    bordered: bool

    def column_px(self, x: float) -> float:
        """Column of the photograph, px, of one of these pictures."""
        return self.view_px[0] + (x + 0.5) * self.shrink - 0.5

    def row_px(self, y: float) -> float:
        """Row of the photograph, px, of one of these pictures."""
        return self.view_px[1] + (y + 0.5) * self.shrink - 0.5


def read_some(files: Sequence[tuple[Path, int]], bits: int) -> Frames | None:
    """Read the first photograph, the last one and some between; None: fewer than two, or too small.

    Parameters
    ----------
    files : sequence of (Path, int)
        File and picture in it, in the order of the series.
    bits : int
        Of a sample.
    """
    reader = Reader()
    wanted = np.unique(np.linspace(0, len(files) - 1, min(FRAMES, len(files))).round().astype(int))
    numbers: list[int] = []
    images: list[Image] = []
    shrink, white = 1, 255.0
    for number in wanted.tolist():
        try:
            levels = reader.read(*files[number])
        except PloughvalError:
            continue
        shrink = max(1, int(np.ceil(np.sqrt(levels.size / MOST_PIXELS))))
        small = _averaged(levels, shrink)
        if not images:
            # 10 or 12 bits in a word of 16 do not fill it
            white = 255.0 if bits <= 8 else max(float(np.quantile(small, _WHITE)), 1.0)
        small *= np.float32(255.0 / white)
        if images and small.shape != images[0].shape:
            continue
        numbers.append(number)
        images.append(small)
    if len(images) < 2 or min(images[0].shape) < _LEAST_SIDE_PX:
        return None
    stack = np.stack(images)
    x0, y0, x1, y1 = _inside(stack)
    if min(x1 - x0, y1 - y0) < _LEAST_SIDE_PX:
        return None
    height, width = stack.shape[1:]
    return Frames(
        np.array(numbers),
        np.ascontiguousarray(stack[:, y0:y1, x0:x1]),
        shrink,
        (x0 * shrink, y0 * shrink, x1 * shrink, y1 * shrink),
        (x0, y0, x1, y1) != (0, 0, width, height),
    )


def _averaged(levels: Samples, shrink: int) -> Image:
    """Means of squares of pixels, float32; what is left over at the right and below is cut off."""
    height, width = (n // shrink for n in levels.shape)
    cut = levels[: height * shrink, : width * shrink]
    small = cut if shrink == 1 else cv2.resize(cut, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32)


def _inside(stack: NDArray[np.float32]) -> tuple[int, int, int, int]:
    """The part (x0, y0, x1, y1) inside of even borders that never change."""
    first = stack[0]
    change = np.abs(stack - first)
    y0, y1 = _span(_even(first, 1) & (change.mean(axis=2).max(axis=0) < _EVEN_GREY))
    x0, x1 = _span(_even(first[y0:y1], 0) & (change[:, y0:y1].mean(axis=1).max(axis=0) < _EVEN_GREY))
    return x0, y0, x1, y1


def _even(image: Image, axis: int) -> NDArray[np.bool_]:
    return np.asarray(np.ptp(image, axis=axis) < 2 * _EVEN_GREY)


def _span(border: NDArray[np.bool_]) -> tuple[int, int]:
    """First and last + 1 of what lies between the borders; all of it where they are narrow."""
    inside = np.flatnonzero(~border)
    if not inside.size:
        return 0, len(border)
    start, end = int(inside[0]), int(inside[-1]) + 1
    return (
        start if start >= _LEAST_BORDER_PX else 0,
        end if len(border) - end >= _LEAST_BORDER_PX else len(border),
    )
