"""Photographs as small pictures for the player, within a budget of bytes for all of them."""

import io
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from PIL import Image, features

from ploughval.report.figures.layers import Extent, Picture
from ploughval.report.photographs import Photographs

PICTURE_BYTES = 3_000_000  # of all pictures; a page writes four characters for three of them
MOST_PICTURES = 150
WIDEST_PX = 900
_QUALITIES = (45, 38, 30)
_HEADROOM = 0.92  # of a picture's share that the one tried may take: others differ by a few per cent
_NARROWER = 0.85
_NARROWEST_PX = 160


@dataclass(frozen=True, slots=True)
class Pictures:
    """Pictures by frame, as bytes of one kind and of one part of the world."""

    kind: str
    extent: Extent
    shape: tuple[int, int]
    data: dict[int, bytes]


def frame_pictures(photographs: Photographs, frames: Sequence[int], extent: Extent) -> Pictures | None:
    """Pictures of some frames; those that cannot be read are left out, None if that is all of them.

    Parameters
    ----------
    photographs : Photographs
        Frames that cannot be read are named in its ``unread``.
    frames : sequence of int
        At most MOST_PICTURES.
    extent : tuple of float, mm
        x0, x1, y0, y1: part of the world that is shown.
    """
    if photographs.missing or not frames:
        return None
    width, quality = _fitting(photographs, frames, extent)
    if not width:
        return None

    def encode(frame: int) -> bytes | None:
        picture = photographs.picture(frame, extent, width=width)
        return None if picture is None else encoded(picture, quality)

    with ThreadPoolExecutor(max_workers=min(4, os.cpu_count() or 1)) as pool:
        made = list(pool.map(encode, frames))
    grid = photographs.grid(extent, width)
    data = {frame: one for frame, one in zip(frames, made, strict=True) if one is not None}
    return Pictures(_kind(), grid.extent, grid.inside.shape, data)


def _fitting(photographs: Photographs, frames: Sequence[int], extent: Extent) -> tuple[int, int]:
    """Width, px, and quality with which a frame in the middle takes no more than its share; 0 without one."""
    width = min(WIDEST_PX, photographs.native_width(extent))
    share = _HEADROOM * PICTURE_BYTES / len(frames)
    middle = len(frames) // 2
    for _, frame in sorted((abs(place - middle), frame) for place, frame in enumerate(frames)):
        picture = photographs.picture(frame, extent, width=width)
        if picture is not None:
            break
    else:
        return 0, 0
    while True:
        for quality in _QUALITIES:
            if len(encoded(picture, quality)) <= share or width <= _NARROWEST_PX:
                return width, quality
        width = max(_NARROWEST_PX, int(width * _NARROWER))
        narrower = photographs.picture(frame, extent, width=width)
        assert narrower is not None
        picture = narrower


def encoded(picture: Picture, quality: int) -> bytes:
    """A picture as WebP, or as JPEG where Pillow was built without it."""
    buffer = io.BytesIO()
    image = Image.fromarray(picture.grey)
    if _kind() == "image/webp":
        image.save(buffer, format="WEBP", quality=quality, method=4)
    else:
        image.save(buffer, format="JPEG", quality=quality, optimize=True)
    return buffer.getvalue()


def _kind() -> str:
    return "image/webp" if features.check("webp") else "image/jpeg"
