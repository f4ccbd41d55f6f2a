"""What EXIF says of a picture: its orientation, its camera and when it was taken."""

import io
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
ORIENTATION = 0x0112
_EXIF_IFD = 0x8769
_MODEL, _SERIAL = 0x0110, 0xA431
_DATE, _SUBSECOND, _OFFSET = 0x9003, 0x9291, 0x9011


@dataclass(frozen=True, slots=True)
class ExifTime:
    """DateTimeOriginal, SubSecTimeOriginal and OffsetTimeOriginal as written; empty where absent."""

    date: str = ""
    subsecond: str = ""
    offset: str = ""


@dataclass(frozen=True, slots=True)
class Tags:
    """Orientation (1: upright), time, and the camera's model and serial number; empty where absent."""

    orientation: int = 1
    time: ExifTime = ExifTime()
    camera: str = ""


def read_tags(load: Callable[[], Image.Exif]) -> Tags:
    """Tags of a block; a damaged EXIF block counts as absent, for the picture may be sound."""
    try:
        exif = load()
        ifd = exif.get_ifd(_EXIF_IFD)
        orientation = exif.get(ORIENTATION, 1)
        named = [exif.get(_MODEL, ""), ifd.get(_SERIAL, "")]
    except Exception:  # a parser of foreign bytes: Pillow lists no closed set of what it raises
        return Tags()
    texts = [str(ifd.get(tag, "")).strip("\0 ") for tag in (_DATE, _SUBSECOND, _OFFSET)]
    camera = " ".join(filter(None, (str(name).strip("\0 ") for name in named)))
    return Tags(orientation if orientation in range(1, 9) else 1, ExifTime(*texts), camera)


def tags_of_tiff(path: Path) -> Tags:
    """Tags of a TIFF, or of a RAW file built as one."""
    with path.open("rb") as file:

        def load() -> Image.Exif:
            exif = Image.Exif()
            exif.load_from_fp(file)  # type: ignore[no-untyped-call]
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
                exif.load(file.read(length))
                break
            file.seek(length + 4, io.SEEK_CUR)
    return exif
