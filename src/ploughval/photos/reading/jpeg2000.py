"""JPEG 2000 to samples: by Pillow, and by OpenCV apart where Pillow would not keep all bits."""

from pathlib import Path

from PIL import Image

from ploughval.limits import PICTURE_BYTES, refuse_large
from ploughval.photos.reading.apart import decode_apart
from ploughval.photos.reading.grey import Samples
from ploughval.photos.reading.header import refuse_large_shape, refuse_samples
from ploughval.photos.reading.pillow import samples_of

MAGIC = (b"\0\0\0\x0cjP  ", b"\xff\x4f\xff\x51")
_HELD = 4
"""OpenJPEG unpacks to 32 bits whatever the depth."""
_SYCC = b"colr\x01\0\0\0\0\0\x12"
"""The box that says luma and differences of colours (ISO 15444-1, annex I.5.3.3)."""


def bits_of(path: Path) -> int:
    """8 or 16, from the image header box or the size marker."""
    return 16 if (_depth(_start(path)) & 0x7F) + 1 > 8 else 8


def _start(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(512)


def _depth(start: bytes) -> int:
    """Bits of a sample less one, and 128 where it has a sign (ISO 15444-1, annexes I and A)."""
    box = start.find(b"ihdr")
    return start[box + 14 if box >= 0 else start.find(b"\xff\x51") + 40]


def decode_jpeg2000(path: Path) -> Samples:
    """Samples as stored, without alpha.

    Returns
    -------
    (H, W) or (H, W, 3) uint8 or uint16

    Raises
    ------
    ValueError
        Damaged or cut short, of other depths than 8 to 16 bits, or more samples than are decoded.
    DataError
        A file that is too large.
    """
    start = _start(path)
    with Image.open(path) as image:
        refuse_large_shape(*image.size)
        refuse_samples(*image.size, len(image.getbands()), _HELD)
        if _SYCC not in start and _kept_by_pillow(image.mode, _depth(start)):
            return samples_of(image)
    return _by_opencv(path)


def _kept_by_pillow(mode: str, depth: int) -> bool:
    """Whether Pillow keeps the samples as they are: it makes 8 bits of colours, and scales other depths."""
    return (depth == 7 and mode in ("L", "LA", "RGB", "RGBA")) or (9 <= depth <= 15 and mode == "I;16")


def _by_opencv(path: Path) -> Samples:
    refuse_large(path, PICTURE_BYTES, "Save it anew, cropped or without what is not the picture.")
    image = decode_apart(path)
    image = image[..., 0] if image.ndim == 3 and image.shape[2] < 3 else image
    return image[..., 2::-1] if image.ndim == 3 else image
