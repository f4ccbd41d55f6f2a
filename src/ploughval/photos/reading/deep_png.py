"""PNG of 16 bits a sample, of which Pillow's own reader keeps 8 in colours: unpacked by its decoder."""

import struct
import zlib
from pathlib import Path
from typing import BinaryIO, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ploughval.limits import PICTURE_BYTES, refuse_large
from ploughval.photos.reading.exif import PNG_MAGIC
from ploughval.photos.reading.grey import ROWS, Samples
from ploughval.photos.reading.header import refuse_large_shape, refuse_samples

_GREY, _RGB, _GREY_ALPHA, _RGBA = 0, 2, 4, 6
_SAMPLES = {_GREY: 1, _RGB: 3, _GREY_ALPHA: 2, _RGBA: 4}
"""Samples a pixel of each type of colours that may have 16 bits (PNG, table 11.1)."""
_HELD = 3
"""Bytes that are held of a sample while it is unpacked: two of it, one of Pillow's."""
_HEADER = ">IIBBBBB"
_CUT_OFF = "image file is truncated"


class _Layout(NamedTuple):
    """What the first chunk tells."""

    width: int
    height: int
    bits: int
    colours: int
    packing: int
    filters: int
    interlaced: int


def decode_deep_png(path: Path) -> Samples:
    """Samples of a PNG of 16 bits, without alpha.

    Returns
    -------
    (H, W) or (H, W, 3) uint16

    Raises
    ------
    ValueError
        Damaged or cut short, or more samples than are decoded.
    DataError
        A file that is too large.
    """
    refuse_large(path, PICTURE_BYTES, "Save it anew, cropped or without what is not the picture.")
    with path.open("rb") as file:
        file.seek(len(PNG_MAGIC))
        kind, first = _chunk(file, path.stat().st_size)
        layout = _layout(kind, first)
        refuse_large_shape(layout.width, layout.height)
        refuse_samples(layout.width, layout.height, _SAMPLES[layout.colours], _HELD)
        packed = _packed(file, path.stat().st_size)
    return _unpacked(layout, packed)


def _layout(kind: bytes, first: bytes) -> _Layout:
    if kind == b"IHDR" and len(first) == struct.calcsize(_HEADER):
        layout = _Layout(*struct.unpack(_HEADER, first))
        if layout.colours in _SAMPLES and layout[4:6] == (0, 0) and layout.interlaced <= 1:
            return layout
    raise ValueError("damaged: its first chunk is no header of a PNG of 16 bits")


def _packed(file: BinaryIO, size: int) -> bytearray:
    """The chunks of samples, joined."""
    joined, kind = bytearray(), b""
    while kind != b"IEND":
        kind, data = _chunk(file, size)
        if kind == b"IDAT":
            joined += data
    return joined


def _chunk(file: BinaryIO, size: int) -> tuple[bytes, bytes]:
    """Kind and bytes of the next chunk; those that a picture can do without are passed over."""
    head = file.read(8)
    length, kind = struct.unpack(">I4s", head) if len(head) == 8 else (size, b"")
    if length + 4 > size - file.tell():
        raise ValueError(_CUT_OFF)
    if kind[0] & 0x20:  # ancillary (PNG, 5.4)
        file.seek(length + 4, 1)
        return kind, b""
    data = file.read(length)
    if zlib.crc32(data, zlib.crc32(kind)) != struct.unpack(">I", file.read(4))[0]:
        raise ValueError(
            f"damaged: the checksum of a chunk {kind.decode('latin-1')!r} is not that of its bytes"
        )
    return kind, data


def _unpacked(layout: _Layout, packed: bytearray) -> Samples:
    """Samples by Pillow, which gives the high or the low bytes of colours: each in a turn of its own."""
    shape = (layout.height, layout.width)
    if layout.colours == _GREY:
        grey = np.empty((*shape, 1), np.uint16)
        _into(grey, layout, packed, ("I;16", "I;16B"))
        return cast(Samples, grey[..., 0])
    if layout.colours == _GREY_ALPHA:  # as if of 8 bits: high and low byte of grey, then of alpha
        both = np.empty((*shape, 2), np.uint8)
        _into(both, layout, packed, ("RGBA", "RGBA"))
        return cast(Samples, both.view(">u2")[..., 0].astype(np.uint16))
    mode = "RGB" if layout.colours == _RGB else "RGBA"
    samples = np.empty((*shape, 3), np.uint16)
    _into(samples, layout, packed, (mode, f"{mode};16B"))
    samples <<= 8
    _into(samples, layout, packed, (mode, f"{mode};16L"), add=True)
    return samples


def _into(
    target: NDArray[np.uint8] | NDArray[np.uint16],
    layout: _Layout,
    packed: bytearray,
    modes: tuple[str, str],
    *,
    add: bool = False,
) -> None:
    """Put the picture's first samples, read as Pillow's mode and raw mode, into an array, or add them."""
    mode, raw = modes
    size = (layout.width, layout.height)
    image = Image.frombytes(mode, size, packed, "zip", raw, layout.interlaced)
    for top in range(0, layout.height, ROWS):  # a large picture is not held in both forms
        part = np.asarray(image.crop((0, top, layout.width, min(top + ROWS, layout.height))))
        part = part.reshape(*part.shape[:2], -1)[..., : target.shape[2]]
        if add:
            target[top : top + ROWS] |= part
        else:
            target[top : top + ROWS] = part
