"""TIFF to samples as they are stored: strips or tiles, planes together or apart (TIFF 6.0, 1992)."""

import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
import tifffile
from numpy.typing import NDArray
from PIL import Image

from ploughval.errors import DataError
from ploughval.limits import PICTURE_BYTES, PICTURES, read_limited
from ploughval.photos.reading.exif import ORIENTATION, tags_of_tiff
from ploughval.photos.reading.grey import Samples
from ploughval.photos.reading.header import Header, refuse_large_shape, refuse_samples
from ploughval.photos.reading.pillow import samples_of
from ploughval.photos.reading.tiff_segments import UNPACKED, assemble

MAGIC = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _PALETTE, _CMYK, _YCBCR = 0, 1, 2, 3, 5, 6
_BY_PILLOW = frozenset({2, 3, 4, 6, 7})  # CCITT, JPEG: whole pictures to libtiff
_UNSIGNED = 1
_SAMPLES = 16  # a pixel


def tiff_header(path: Path) -> Header:
    """Header of a TIFF; its full pictures without thumbnails."""
    with tifffile.TiffFile(path) as tiff:
        pages: Any = tiff.pages
        _refuse_circles(pages)
        full = [k for k, page in enumerate(pages) if not page.is_reduced and page.imagelength]
        if not full:
            raise DataError("holds no picture", path=path)
        shape, bits = _size(pages[full[0]]), int(pages[full[0]].bitspersample)
        _refuse_samples(pages[full[0]])
        other = next((k for k in full if _size(pages[k]) != shape), None)
        if other is not None:
            raise DataError(
                f"holds pictures of different size: page {other} has {_size(pages[other])} rows and columns, "
                f"page {full[0]} has {shape}. Save the pictures as files of their own.",
                path=path,
            )
    return Header(shape, 16 if bits > 8 else 8, tuple(full), tags_of_tiff(path))


def _refuse_circles(pages: Any) -> None:
    """Raise ValueError where a directory is met again: without end, or as many pictures as one likes."""
    met: set[int] = set()
    for page in pages:
        if page.offset in met or len(met) > PICTURES:
            raise ValueError(f"its directories go in circles after {len(met)} pictures, or never end")
        met.add(page.offset)


def _size(page: Any) -> tuple[int, int]:
    return int(page.imagelength), int(page.imagewidth)


def decode_tiff(path: Path, page: int) -> Samples:
    """Samples of one page, (H, W) or (H, W, 3), uint8 or uint16; ValueError says what cannot be read."""
    with tifffile.TiffFile(path) as tiff:
        tif: Any = tiff.pages[page]
        _refuse(tif, path.stat().st_size)
        if tif.compression in _BY_PILLOW or tif.photometric in (_CMYK, _YCBCR):
            return _by_pillow(path, page, tif)
        if tif.compression == 1 and tif.bitspersample in (8, 16):
            array = tif.asarray()
            array = np.moveaxis(array, 0, -1) if tif.axes == "SYX" else array
        else:
            array = assemble(tif)
        return _colours(array, tif)


def _refuse(page: Any, size: int) -> None:
    """Raise ValueError for a page that is cut off or whose samples cannot become a grey level."""
    refuse_large_shape(int(page.imagewidth), int(page.imagelength))
    counts = zip(page.dataoffsets, page.databytecounts, strict=True)
    if not all(count and offset + count <= size for offset, count in counts):
        raise ValueError("image file is truncated")
    _refuse_samples(page)
    bits = page.bitspersample
    refuse_samples(*_size(page), int(page.samplesperpixel), 2 if bits > 8 else 1)
    if page.axes not in ("YX", "YXS", "SYX") or page.samplesperpixel > _SAMPLES:
        raise ValueError(f"axes {page.axes} of {page.samplesperpixel} samples a pixel; expected one plane")
    if page.photometric not in (_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _PALETTE, _CMYK, _YCBCR):
        raise ValueError(f"colours of the kind {_name(page.photometric)}; expected grey, RGB or a palette")
    if page.compression not in _BY_PILLOW | UNPACKED:
        raise ValueError(f"compression {_name(page.compression)}; save it with deflate, LZW or none")
    if bits > 8 and (page.compression in _BY_PILLOW or page.photometric in (_CMYK, _YCBCR)):
        raise ValueError(f"{_name(page.photometric)} of {bits} bits; expected grey or RGB at this depth")


def _refuse_samples(page: Any) -> None:
    """Raise ValueError for samples that are no whole numbers of up to 16 bits, whatever the rest is."""
    if page.sampleformat != _UNSIGNED or page.bitspersample > 16:
        name = "an unknown kind" if page.dtype is None else f"type {page.dtype}"
        raise ValueError(f"samples of {name}, axes {page.axes}; expected 8 or 16 bit, one plane")


def _name(code: Any) -> str:
    return str(getattr(code, "name", code))


def _colours(array: NDArray[Any], tif: Any) -> Samples:
    """Stored samples to grey or RGB; extra samples (alpha) are left out."""
    bits = int(tif.bitspersample)
    if bits == 1 and tif.photometric != _PALETTE:
        array, bits = array * np.uint8(255), 8
    if tif.photometric == _RGB:
        return array[..., :3]
    array = array[..., 0] if array.ndim == 3 else array
    if tif.photometric == _PALETTE:
        colours = np.asarray(tif.colormap)
        return np.asarray((colours >> 8 if colours.max() > 255 else colours).T[array], np.uint8)
    if tif.photometric == _WHITE_IS_ZERO:
        return np.asarray((1 << bits) - 1 - array, array.dtype)
    return array


def _by_pillow(path: Path, page: int, tif: Any) -> Samples:
    """A whole picture by libtiff, told that it stands upright so that nothing turns it."""
    data = bytearray(read_limited(path, PICTURE_BYTES, "Save it with deflate, LZW or none."))
    tag = tif.tags.get(ORIENTATION)
    if tag is not None:
        struct.pack_into(tif.parent.byteorder + "H", data, tag.valueoffset, 1)
    with Image.open(io.BytesIO(bytes(data))) as image:
        image.seek(page)
        return samples_of(image)
