"""Picture files to samples as they are stored: no turning by EXIF, 16 bit stays 16 bit, alpha ignored."""

import io
import struct
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import tifffile
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from ploughval.errors import DataError, MissingExtraError
from ploughval.photos.grey import Channel, Samples, to_grey

RAW_ENDINGS = frozenset({".nef", ".nrw", ".cr2", ".cr3", ".arw", ".dng", ".orf", ".rw2", ".raf", ".pef"})
ENDINGS = RAW_ENDINGS | {".jpg", ".jpeg", ".jpe", ".png", ".tif", ".tiff", ".bmp", ".gif"}
_TIFF_MAGIC = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_EXIF_IFD, _ORIENTATION = 0x8769, 0x0112
_DATE, _SUBSECOND, _OFFSET = 0x9003, 0x9291, 0x9011
_BROKEN = (
    OSError,
    ValueError,
    SyntaxError,
    struct.error,
    KeyError,
    IndexError,
    EOFError,
    TypeError,
    MemoryError,
)


@dataclass(frozen=True, slots=True)
class ExifTime:
    """DateTimeOriginal, SubSecTimeOriginal and OffsetTimeOriginal as written; empty where absent."""

    date: str = ""
    subsecond: str = ""
    offset: str = ""


@dataclass(frozen=True, slots=True)
class Header:
    """What a picture file says about itself without being decoded.

    shape (H, W) as stored, EXIF orientation (1: upright), bits a sample, indices of its full pictures.
    """

    shape: tuple[int, int]
    orientation: int = 1
    bits: int = 8
    pages: tuple[int, ...] = (0,)
    exif: ExifTime = ExifTime()


def read_header(path: Path) -> Header:
    """Read a picture's header.

    Raises
    ------
    DataError
        Empty file, not a picture, or a header that cannot be read.
    MissingExtraError
        A RAW file without the extra ``raw``.
    """
    try:
        start = _first_bytes(path)
        if path.suffix.lower() in RAW_ENDINGS:
            return _raw_header(path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow warns of damaged EXIF blocks; the picture may be sound
            return _tiff_header(path) if start[:4] in _TIFF_MAGIC else _pillow_header(path, start)
    except UnidentifiedImageError:
        raise DataError("is not a picture (its first bytes fit no known format)", path=path) from None
    except (*_BROKEN, Image.DecompressionBombError) as error:
        raise DataError(f"cannot be read: {error or type(error).__name__}", path=path) from error


def decode(path: Path, page: int = 0, *, channel: Channel = "grey") -> Samples:
    """Decode one picture of a file to the plane that is correlated.

    Parameters
    ----------
    path : Path
        JPEG, PNG, TIFF, BMP, GIF, or RAW with the extra ``raw``; told by content.
    page : int
        Which picture of a multi-page TIFF or an animated GIF.
    channel : str
        See :func:`ploughval.photos.grey.to_grey`.

    Returns
    -------
    (H, W) uint8 or uint16, contiguous

    Raises
    ------
    DataError
        The file cannot be decoded in full.
    """
    try:
        start = _first_bytes(path)
        if path.suffix.lower() in RAW_ENDINGS:
            samples = _decode_raw(path)
        elif start[:4] in _TIFF_MAGIC:
            samples = _decode_tiff(path, page)
        elif _png_bits(start) == 16:
            samples = _decode_opencv(path.read_bytes(), 0)
        else:
            samples = _decode_pillow(path, page, luma=channel == "grey")
    except UnidentifiedImageError:
        raise DataError("is not a picture (its first bytes fit no known format)", path=path) from None
    except (*_BROKEN, cv2.error, Image.DecompressionBombError) as error:
        raise DataError(f"cannot be decoded: {error or type(error).__name__}", path=path) from error
    return to_grey(samples, channel)


def decode_8bit(path: Path) -> NDArray[np.uint8]:
    """Decode the first picture of a file for a finder of boards: (H, W) uint8 grey."""
    grey = decode(path)
    if grey.dtype == np.uint8:
        return np.asarray(grey, np.uint8)
    top = max(int(grey.max()), 1)
    return np.asarray(grey.astype(np.float32) * (255 / top), np.uint8)


def _first_bytes(path: Path) -> bytes:
    with path.open("rb") as file:
        start = file.read(32)
    if not start:
        raise DataError("is empty (0 bytes)", path=path)
    return start


def _png_bits(start: bytes) -> int:
    return start[24] if start[:8] == _PNG_MAGIC and len(start) > 24 else 0


def _pillow_header(path: Path, start: bytes) -> Header:
    with Image.open(path) as image:
        pages = range(int(getattr(image, "n_frames", 1))) if image.format == "GIF" else (0,)
        bits = _png_bits(start) or (16 if image.mode.startswith("I;16") else 8)
        tags = image.getexif if image.format != "PNG" else lambda: _png_exif(path)
        orientation, exif = _exif(tags)
        return Header(image.size[::-1], orientation, max(bits, 8), tuple(pages), exif)


def _png_exif(path: Path) -> Image.Exif:
    """The eXIf chunk, wherever it stands; Pillow would decode the whole picture in search of it."""
    exif = Image.Exif()
    with path.open("rb") as file:
        file.seek(len(_PNG_MAGIC))
        while len(head := file.read(8)) == 8:
            length, kind = struct.unpack(">I4s", head)
            if kind == b"eXIf":
                exif.load(file.read(length))
                break
            file.seek(length + 4, io.SEEK_CUR)
    return exif


def _tiff_header(path: Path) -> Header:
    with tifffile.TiffFile(path) as tiff:
        pages: Any = tiff.pages
        full = [k for k, page in enumerate(pages) if not page.is_reduced and page.imagelength]
        if not full:
            raise DataError("holds no picture", path=path)
        first = pages[full[0]]
        shape, bits = (int(first.imagelength), int(first.imagewidth)), int(first.bitspersample)
    orientation, exif = _file_exif(path)
    return Header(shape, orientation, 16 if bits > 8 else 8, tuple(full), exif)


def _file_exif(path: Path) -> tuple[int, ExifTime]:
    with path.open("rb") as file:

        def load() -> Image.Exif:
            exif = Image.Exif()
            exif.load_from_fp(file)  # type: ignore[no-untyped-call]
            return exif

        return _exif(load)


def _exif(load: Any) -> tuple[int, ExifTime]:
    """Orientation and time tags; a damaged EXIF block counts as absent, for the picture may be sound."""
    try:
        exif = load()
        ifd = exif.get_ifd(_EXIF_IFD)
        orientation = exif.get(_ORIENTATION, 1)
    except Exception:  # a parser of foreign bytes: Pillow lists no closed set of what it raises
        return 1, ExifTime()
    texts = [str(ifd.get(tag, "")).strip("\0 ") for tag in (_DATE, _SUBSECOND, _OFFSET)]
    return orientation if orientation in range(1, 9) else 1, ExifTime(*texts)


def _decode_pillow(path: Path, page: int, *, luma: bool) -> Samples:
    with Image.open(path) as image:
        if page:
            image.seek(page)
        if luma and image.format in ("JPEG", "MPO"):
            image.draft("L", image.size)  # the stored luma itself: same rule, half the time
        if image.mode in ("I", "F"):
            raise ValueError(f"samples of mode {image.mode}; expected 8 or 16 bit")
        if image.mode.startswith("I;16"):
            return np.asarray(image).astype(np.uint16)
        if image.mode in ("L", "RGB"):
            return np.asarray(image)
        if image.mode in ("1", "LA", "La"):
            return np.asarray(image.convert("LA"))[..., 0]
        return np.asarray(image.convert("RGBA"))[..., :3]


def _decode_opencv(data: bytes, page: int) -> Samples:
    buffer = np.frombuffer(data, np.uint8)
    if page:
        _, pages = cv2.imdecodemulti(buffer, cv2.IMREAD_UNCHANGED, range=(page, page + 1))
        image = pages[0] if pages else None
    else:
        image = cv2.imdecode(buffer, cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype not in (np.uint8, np.uint16):
        raise ValueError("truncated or damaged, or samples that are not 8 or 16 bit")
    image = image[..., 0] if image.ndim == 3 and image.shape[2] < 3 else image
    return image[..., 2::-1] if image.ndim == 3 else image  # type: ignore[return-value]


def _decode_tiff(path: Path, page: int) -> Samples:
    with tifffile.TiffFile(path) as tiff:
        tif: Any = tiff.pages[page]
        if not _is_complete(tif, path.stat().st_size):
            raise ValueError("image file is truncated")
        try:
            array = tif.asarray() if int(tif.photometric) not in (5, 6) else None
        except ValueError as error:
            if "imagecodecs" not in str(error):
                raise
            array = None
        return _decode_other_tiff(path, page, tif) if array is None else _tiff_colours(array, tif)


def _is_complete(page: Any, size: int) -> bool:
    counts = zip(page.dataoffsets, page.databytecounts, strict=True)
    return all(count and offset + count <= size for offset, count in counts)


def _tiff_colours(array: NDArray[Any], tif: Any) -> Samples:
    """Samples as the TIFF stores them to grey or RGB; extra samples (alpha) are left out."""
    if array.dtype == np.bool_:
        array = array.astype(np.uint8) * 255
    if tif.axes.startswith("S"):
        array = np.moveaxis(array, 0, -1)
    if array.dtype not in (np.uint8, np.uint16) or array.ndim not in (2, 3):
        raise ValueError(f"samples of type {array.dtype}, axes {tif.axes}; expected 8 or 16 bit, one plane")
    if int(tif.photometric) == 2:
        return array[..., :3]
    array = array[..., 0] if array.ndim == 3 else array
    if int(tif.photometric) == 3:
        colours = np.asarray(tif.colormap)
        return np.asarray((colours >> 8 if colours.max() > 255 else colours).T[array], np.uint8)
    if int(tif.photometric) == 0:
        return np.asarray((1 << max(int(tif.bitspersample), 8)) - 1 - array, array.dtype)
    return array


def _decode_other_tiff(path: Path, page: int, tif: Any) -> Samples:
    """Compressed as tifffile alone cannot: by libtiff, told that it stands upright so that none turns it."""
    data = bytearray(path.read_bytes())
    tag = tif.tags.get(_ORIENTATION)
    if tag is not None:
        struct.pack_into(tif.parent.byteorder + "H", data, tag.valueoffset, 1)
    if int(tif.bitspersample) > 8:
        return _decode_opencv(bytes(data), page)
    with Image.open(io.BytesIO(bytes(data))) as image:
        image.seek(page)
        if image.mode == "L":
            return np.asarray(image)
        return np.asarray(image.convert("RGBA"))[..., :3]


def _rawpy(path: Path) -> Any:
    try:
        import rawpy
    except ImportError:
        raise MissingExtraError("rawpy", "raw", f"Reading the RAW photograph {path.name}") from None
    return rawpy


def _raw_header(path: Path) -> Header:
    rawpy = _rawpy(path)
    try:
        with rawpy.imread(str(path)) as raw:
            shape = (int(raw.sizes.height), int(raw.sizes.width))
    except rawpy.LibRawError as error:
        raise DataError(f"cannot be read as RAW: {_raw_reason(error)}", path=path) from error
    orientation, exif = _file_exif(path)
    return Header(shape, orientation, 16, (0,), exif)


def _decode_raw(path: Path) -> Samples:
    rawpy = _rawpy(path)
    try:
        with rawpy.imread(str(path)) as raw:
            image = raw.postprocess(
                output_bps=16,
                user_flip=0,  # as the sensor stands
                gamma=(1, 1),
                user_wb=[1, 1, 1, 1],  # the camera's own balance may change from frame to frame
                no_auto_bright=True,
                adjust_maximum_thr=0.0,
            )
            return np.asarray(image, np.uint16)
    except rawpy.LibRawError as error:
        raise DataError(f"cannot be decoded as RAW: {_raw_reason(error)}", path=path) from error


def _raw_reason(error: Exception) -> str:
    reason = error.args[0] if error.args else error
    return reason.decode(errors="replace") if isinstance(reason, bytes) else str(reason)
