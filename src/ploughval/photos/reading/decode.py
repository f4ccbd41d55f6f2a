"""Picture files to samples as they are stored: no turning by EXIF, 16 bit stays 16 bit, alpha ignored."""

import lzma
import re
import struct
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import tifffile
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from ploughval.errors import DataError
from ploughval.limits import PICTURE_PIXELS, PICTURES
from ploughval.memory import raise_shortage
from ploughval.photos.reading import gif, jpeg2000, raw, tiff, video
from ploughval.photos.reading.deep_png import decode_deep_png
from ploughval.photos.reading.exif import PNG_MAGIC, load_png, read_tags
from ploughval.photos.reading.grey import Channel, Samples, to_grey
from ploughval.photos.reading.header import Header, refuse_large_shape
from ploughval.photos.reading.pillow import samples_of

DECODING_BYTES = 10 * PICTURE_PIXELS
"""What the largest picture may need while it is decoded."""
ENDINGS = raw.ENDINGS | {".jpg", ".jpeg", ".jpe", ".mpo", ".png", ".tif", ".tiff", ".bmp", ".gif"}
ENDINGS |= video.ENDINGS | {".jp2", ".webp"}
_JPEG_MAGIC = b"\xff\xd8\xff"
_BROKEN = (
    OSError,
    ValueError,
    SyntaxError,
    struct.error,
    LookupError,
    ArithmeticError,
    AttributeError,
    EOFError,
    TypeError,
    MemoryError,
    RuntimeError,
    lzma.LZMAError,
    zlib.error,
    tifffile.TiffFileError,
    cv2.error,
)
# Pillow warns from half of the size on that is refused here
warnings.filterwarnings("ignore", category=Image.DecompressionBombWarning)


def read_header(path: Path) -> Header:
    """Read a picture's header.

    Raises
    ------
    DataError
        Empty file, not a picture, or a header that cannot be read.
    MissingExtraError
        A RAW file without the extra ``raw``.
    """
    with naming_faults(path, "read"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow warns of damaged EXIF blocks; the picture may be sound
        start = _first_bytes(path)
        header = _header(path, start)
        refuse_large_shape(header.shape[1], header.shape[0])
        if len(header.pages) > PICTURES:
            raise ValueError(f"it holds {len(header.pages)} pictures; expected at most {PICTURES}")
        return header


def _header(path: Path, start: bytes) -> Header:
    if path.suffix.lower() in raw.ENDINGS:
        return raw.raw_header(path)
    if path.suffix.lower() in video.ENDINGS:
        return video.video_header(path)
    return tiff.tiff_header(path) if start[:4] in tiff.MAGIC else _pillow_header(path, start)


def decode(path: Path, page: int = 0, *, channel: Channel = "grey") -> Samples:
    """Decode one picture of a file to the plane that is correlated.

    Parameters
    ----------
    path : Path
        JPEG, PNG, TIFF, BMP, GIF, JPEG 2000 or WebP, told by content; a video or RAW (with the extra
        ``raw``), told by the ending.
    page : int
        Which picture of a multi-page TIFF, an animated GIF or a video.
    channel : str
        See :func:`ploughval.photos.reading.grey.to_grey`.

    Returns
    -------
    (H, W) uint8 or uint16, contiguous

    Raises
    ------
    DataError
        The file cannot be decoded in full.
    """
    with naming_faults(path, "decoded"):
        return to_grey(_samples(path, _first_bytes(path), page, channel), channel)


@contextmanager
def naming_faults(path: Path, action: str) -> Iterator[None]:
    """Turn what decoders raise on a bad file into a DataError that names it."""
    try:
        yield
    except UnidentifiedImageError:
        raise DataError(_unidentified(path), path=path) from None
    except Image.DecompressionBombError as error:
        found = re.search(r"\((\d+) pixels\)", str(error))
        count = f"{int(found[1]):,} px".replace(",", " ") if found else "too many pixels"
        raise DataError(
            f"cannot be {action}: it says that it holds {count}; expected at most "
            f"{PICTURE_PIXELS // 1_000_000} million px. Crop it, or take it out",
            path=path,
        ) from None
    except _BROKEN as error:
        raise_shortage(error, DECODING_BYTES)
        raise DataError(f"cannot be {action}: {error or type(error).__name__}", path=path) from error


def decode_8bit(path: Path) -> NDArray[np.uint8]:
    """Decode the first picture of a file for a finder of boards: (H, W) uint8 grey."""
    grey = decode(path)
    if grey.dtype == np.uint8:
        return np.asarray(grey, np.uint8)
    top = max(int(grey.max()), 1)
    return np.asarray(grey.astype(np.float32) * (255 / top), np.uint8)


def _samples(path: Path, start: bytes, page: int, channel: Channel) -> Samples:
    if path.suffix.lower() in raw.ENDINGS:
        return raw.decode_raw(path)
    if path.suffix.lower() in video.ENDINGS:
        return video.VideoFile(path, channel).read(page)
    if start[:4] in tiff.MAGIC:
        return tiff.decode_tiff(path, page)
    if start.startswith(jpeg2000.MAGIC):
        return jpeg2000.decode_jpeg2000(path)
    if _png_bits(start) == 16:
        return decode_deep_png(path)
    return _decode_pillow(path, page, luma=channel == "grey")


def _unidentified(path: Path) -> str:
    if _first_bytes(path).startswith(_JPEG_MAGIC):
        return "is a JPEG that cannot be read: damaged, lossless or of 12 bits; expected 8 bits a sample"
    return "is not a picture (its first bytes fit no known format)"


def _first_bytes(path: Path) -> bytes:
    with path.open("rb") as file:
        start = file.read(32)
    if not start:
        raise DataError("is empty (0 bytes)", path=path)
    return start


def _png_bits(start: bytes) -> int:
    return start[24] if start.startswith(PNG_MAGIC) and len(start) > 24 else 0


def _pillow_header(path: Path, start: bytes) -> Header:
    with Image.open(path) as image:
        if image.format == "GIF":
            return gif.gif_header(image)
        if image.format == "JPEG2000":
            bits = jpeg2000.bits_of(path)
        else:
            bits = _png_bits(start) or (16 if image.mode.startswith("I;16") else 8)
        tags = read_tags(image.getexif if image.format != "PNG" else lambda: load_png(path))
        return Header(image.size[::-1], max(bits, 8), tags=tags)


def _decode_pillow(path: Path, page: int, *, luma: bool) -> Samples:
    with Image.open(path) as image:
        refuse_large_shape(*image.size)
        if page:
            image.seek(page)
        if luma and image.format in ("JPEG", "MPO"):
            image.draft("L", image.size)  # the stored luma itself: same rule, half the time
        return samples_of(image)
