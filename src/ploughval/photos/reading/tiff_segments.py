"""Strips and tiles unpacked one by one: LZW, PackBits, Zstandard, LZMA, and samples of 1 to 16 bits."""

import io
import lzma
import struct
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ploughval.photos.reading.header import refuse_large_shape

UNPACKED = frozenset(
    {1, 5, 8, 32946, 32773, 34925, 50000}
)  # none, LZW, deflate twice, PackBits, LZMA, Zstandard
_BY_PYTHON: dict[int, Callable[[bytes, int], bytes]] = {
    1: lambda packed, most: packed[:most],
    8: lambda packed, most: zlib.decompressobj().decompress(packed, most),
    32946: lambda packed, most: zlib.decompressobj().decompress(packed, most),
    34925: lambda packed, most: lzma.LZMADecompressor().decompress(packed, most),
}
"""Compressions that libtiff is not asked for: it passes over some faults in them.

What is unpacked beyond the bytes of a segment is never made: a small file can hold very many.
"""
_NO_PREDICTOR, _DIFFERENCES = 1, 2


def assemble(page: Any) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """The picture of a page from its strips or tiles.

    Parameters
    ----------
    page : tifffile.TiffPage
        Of unsigned samples of 1 to 16 bits, one plane.

    Returns
    -------
    (H, W) or (H, W, samples) uint8 or uint16

    Raises
    ------
    ValueError
        A predictor that is not known, or a segment that is shorter than it says.
    """
    bits, predictor = int(page.bitspersample), int(page.predictor)
    if predictor not in (_NO_PREDICTOR, _DIFFERENCES) or (predictor == _DIFFERENCES and bits not in (8, 16)):
        raise ValueError(f"predictor {predictor} on samples of {bits} bits; save it without")
    apart = page.planarconfig == 2 and page.samplesperpixel > 1
    samples = 1 if apart else int(page.samplesperpixel)
    height, width = int(page.imagelength), int(page.imagewidth)
    tall, wide = (
        (int(page.tilelength), int(page.tilewidth)) if page.is_tiled else (int(page.rowsperstrip), width)
    )
    if tall < 1 or wide < 1:
        raise ValueError(f"strips or tiles of {wide} x {tall} px")
    refuse_large_shape(wide, tall if page.is_tiled else 1)
    across, down = -(-width // wide), -(-height // tall)
    planes = int(page.samplesperpixel) if apart else samples
    picture = np.empty((height, width, planes), np.uint8 if bits <= 8 else np.uint16)
    for k, (offset, count) in enumerate(zip(page.dataoffsets, page.databytecounts, strict=True)):
        plane, place = divmod(k, across * down)
        row, column = (place // across) * tall, (place % across) * wide
        rows = tall if page.is_tiled else min(tall, height - row)
        page.parent.filehandle.seek(offset)
        packed = page.parent.filehandle.read(count)
        data = _unpack(packed, page, -(-wide * samples * bits // 8), rows)
        part = _values(data, wide * samples, bits, page.parent.byteorder).reshape(rows, wide, samples)
        if predictor == _DIFFERENCES:
            np.cumsum(part, axis=1, dtype=part.dtype, out=part)
        part = part[: height - row, : width - column]
        target = picture[row : row + rows, column : column + wide]
        if apart:
            target[..., plane] = part[..., 0]
        else:
            target[...] = part
    return picture[..., 0] if planes == 1 else picture


def _unpack(packed: bytes, page: Any, row_bytes: int, rows: int) -> NDArray[np.uint8]:
    """The bytes of a segment, (rows, row_bytes); by libtiff as a grey picture of bytes."""
    code = int(page.compression)
    if code in _BY_PYTHON:
        data = np.frombuffer(
            _BY_PYTHON[code](packed, rows * row_bytes + 1), np.uint8
        )  # one more: to the checksum
        if page.fillorder == 2:
            data = np.packbits(np.unpackbits(data, bitorder="little"))
        if data.size < rows * row_bytes:
            raise ValueError(f"a segment of {data.size} bytes; expected {rows * row_bytes}")
        return data[: rows * row_bytes].reshape(rows, row_bytes)
    tags = (
        (256, row_bytes),
        (257, rows),
        (258, 8),
        (259, code),
        (262, 1),
        (266, int(page.fillorder)),
        (273, 0),
        (277, 1),
        (278, rows),
        (279, len(packed)),
    )
    start = 8 + 2 + 12 * len(tags) + 4
    directory = b"".join(
        struct.pack("<HHII", tag, 4, 1, start if tag == 273 else value) for tag, value in tags
    )
    head = struct.pack("<2sHIH", b"II", 42, 8, len(tags)) + directory + bytes(4)
    try:
        with Image.open(io.BytesIO(head + packed)) as image:
            return np.asarray(image)
    except OSError as error:
        name = getattr(page.compression, "name", code)
        raise ValueError(f"damaged, or packed as Pillow's libtiff cannot read ({name})") from error


def _values(data: NDArray[np.uint8], count: int, bits: int, order: str) -> NDArray[Any]:
    """Samples (rows, count) from rows of bytes; packed samples begin at the highest bit (TIFF 6.0)."""
    if bits == 8:
        return data.copy()
    if bits == 16:
        return np.ascontiguousarray(data).view(np.dtype(f"{order}u2")).astype(np.uint16)
    start = np.arange(count) * bits
    first, rest = start // 8, start % 8
    padded = np.pad(data, ((0, 0), (0, 2)))
    word = (
        padded[:, first].astype(np.uint32) << 16
        | padded[:, first + 1].astype(np.uint32) << 8
        | padded[:, first + 2]
    )
    values = word >> (24 - bits - rest).astype(np.uint32) & np.uint32((1 << bits) - 1)
    return values.astype(np.uint8 if bits <= 8 else np.uint16)
