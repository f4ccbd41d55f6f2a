"""What EXIF says of a picture: its orientation, its camera, how and when it was taken."""

import io
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
ORIENTATION = 0x0112
_EXIF_IFD = 0x8769
_MAKE, _MODEL, _SERIAL = 0x010F, 0x0110, 0xA431
_LENS_MAKE, _LENS = 0xA433, 0xA434
_EXPOSURE, _APERTURE, _ISO, _FOCAL = 0x829A, 0x829D, 0x8827, 0x920A
_BLOCK_BYTES = 1 << 24
_DATE, _SUBSECOND, _OFFSET = 0x9003, 0x9291, 0x9011


@dataclass(frozen=True, slots=True)
class ExifTime:
    """DateTimeOriginal, SubSecTimeOriginal and OffsetTimeOriginal as written; empty where absent."""

    date: str = ""
    subsecond: str = ""
    offset: str = ""


@dataclass(frozen=True, slots=True)
class Shot:
    """Camera, lens and exposure of a picture (EXIF 2.3, tables 4 and 7); empty or None where absent.

    focal length in mm, aperture as the f-number, exposure in s, sensitivity as ISO speed.
    """

    make: str = ""
    model: str = ""
    lens: str = ""
    focal_mm: float | None = None
    aperture: float | None = None
    exposure_s: float | None = None
    iso: float | None = None


@dataclass(frozen=True, slots=True)
class Tags:
    """Orientation (1: upright), time, camera's model and serial number, and exposure; empty where absent."""

    orientation: int = 1
    time: ExifTime = ExifTime()
    camera: str = ""
    shot: Shot = Shot()


def read_tags(load: Callable[[], Image.Exif]) -> Tags:
    """Tags of a block; a damaged EXIF block counts as absent, for the picture may be sound."""
    try:
        exif = load()
        ifd = exif.get_ifd(_EXIF_IFD)
        orientation = exif.get(ORIENTATION, 1)
        named = [exif.get(_MODEL, ""), ifd.get(_SERIAL, "")]
        shot = _shot(exif, ifd)
    except Exception:  # a parser of foreign bytes: Pillow lists no closed set of what it raises
        return Tags()
    texts = [str(ifd.get(tag, "")).strip("\0 ") for tag in (_DATE, _SUBSECOND, _OFFSET)]
    camera = " ".join(filter(None, (str(name).strip("\0 ") for name in named)))
    return Tags(orientation if orientation in range(1, 9) else 1, ExifTime(*texts), camera, shot)


def _shot(exif: Image.Exif, ifd: dict[int, Any]) -> Shot:
    """What the tags say of camera, lens and exposure."""
    make, model = _text(exif.get(_MAKE)), _text(exif.get(_MODEL))
    lens_make, lens = _text(ifd.get(_LENS_MAKE)), _text(ifd.get(_LENS))
    if lens_make and lens and not lens.startswith(lens_make):
        lens = f"{lens_make} {lens}"
    iso = ifd.get(_ISO)
    return Shot(
        make=make,
        model=model,
        lens=lens or lens_make,
        focal_mm=_positive(ifd.get(_FOCAL)),
        aperture=_positive(ifd.get(_APERTURE)),
        exposure_s=_positive(ifd.get(_EXPOSURE)),
        iso=_positive(iso[0] if isinstance(iso, tuple) and iso else iso),
    )


def _text(value: object) -> str:
    """A tag as one line of text without what does not print."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value or "")
    return " ".join("".join(c if c.isprintable() else " " for c in text.split("\0")[0]).split())[:200]


def _positive(value: object) -> float | None:
    """A tag as a number above 0; None where it is none, or a fraction of zeros (unknown, infinite)."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return number if math.isfinite(number) and number > 0 else None


def tags_of_tiff(path: Path) -> Tags:
    """Tags of a TIFF, or of a RAW file built as one."""
    with path.open("rb") as file:

        def load() -> Image.Exif:
            exif = Image.Exif()
            exif.load_from_fp(file)
            return exif

        return read_tags(load)


def load_png(path: Path) -> Image.Exif:
    """The eXIf chunk, wherever it stands; Pillow would decode the whole picture in search of it."""
    exif = Image.Exif()
    with path.open("rb") as file:
        file.seek(len(PNG_MAGIC))
        while len(head := file.read(8)) == 8:
            length, kind = struct.unpack(">I4s", head)
            if kind == b"eXIf":
                exif.load(file.read(min(length, _BLOCK_BYTES)))
                break
            file.seek(length + 4, io.SEEK_CUR)
    return exif
