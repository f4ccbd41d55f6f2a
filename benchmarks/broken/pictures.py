"""Broken folders: photographs that are cut short, empty, no pictures, or far larger than they look."""

import io
import struct
import zlib
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from broken.base import PHOTOGRAPH, Case, Spoil, changed, setting, together, written
from ploughval.photos.reading.exif import PNG_MAGIC

_MEASURED = ("force.csv", "tracks.nc", "surface.csv", "blade.csv", "run.json")
_ONE_LOST = ("frame 2", "0002")


def chunk(kind: bytes, data: bytes) -> bytes:
    """A chunk of a PNG."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width: int, height: int, packed: bytes, bits: int = 8, colour: int = 0) -> bytes:
    """A PNG that says it is this large, whatever it holds."""
    head = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
    return PNG_MAGIC + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")


@lru_cache
def bomb(megabytes: int) -> bytes:
    """So many megabytes of zeros, packed a thousandfold."""
    packer = zlib.compressobj(9)
    block = bytes(1 << 20)
    return b"".join(packer.compress(block) for _ in range(megabytes)) + packer.flush()


def tiff(width: int, height: int, data: bytes, compression: int = 1, rows: int | None = None) -> bytes:
    """A grey TIFF of one strip that says it is this large."""
    tags = [
        (256, width),
        (257, height),
        (258, 8),
        (259, compression),
        (262, 1),
        (273, 8),
        (277, 1),
        (278, rows or height),
        (279, len(data)),
    ]
    directory = struct.pack("<H", len(tags)) + b"".join(struct.pack("<HHII", t, 4, 1, v) for t, v in tags)
    pad = len(data) % 2
    return b"II*\0" + struct.pack("<I", 8 + len(data) + pad) + data + bytes(pad) + directory + bytes(4)


def jpeg_of_size(width: int, height: int) -> bytes:
    """A small JPEG whose header says that it is large."""
    data = encoded("jpg", np.full((16, 16), 100, np.uint8))
    place = data.index(b"\xff\xc0") + 5
    return data[:place] + struct.pack(">HH", height, width) + data[place + 4 :]


def gif_of_size(width: int, height: int) -> bytes:
    """A small GIF whose screen is large."""
    data = encoded("gif", np.full((16, 16), 100, np.uint8))
    return data[:6] + struct.pack("<HH", width, height) + data[10:]


def bmp_of_size(width: int, height: int) -> bytes:
    """A small BMP whose header says that it is large."""
    data = encoded("bmp", np.full((16, 16), 100, np.uint8))
    return data[:18] + struct.pack("<ii", width, height) + data[26:]


def webp_of_size(width: int, height: int) -> bytes:
    """A lossless WebP of nothing that says it is large."""
    bits = struct.pack("<I", (width - 1) | (height - 1) << 14)
    body = b"VP8L" + struct.pack("<I", 6) + b"\x2f" + bits + b"\0"
    return b"RIFF" + struct.pack("<I", 4 + len(body)) + b"WEBP" + body


def jpeg2000_of_size(width: int, height: int) -> bytes:
    """A small JPEG 2000 whose headers say that it is large."""
    data = cv2.imencode(".jp2", np.full((64, 64), 100, np.uint8))[1].tobytes()
    place = data.index(b"ihdr") + 4
    data = data[:place] + struct.pack(">II", height, width) + data[place + 8 :]
    size = data.index(b"\xff\x51") + 6
    return data[:size] + struct.pack(">II", width, height) + data[size + 8 :]


def encoded(ending: str, image: np.ndarray) -> bytes:
    """A picture as a file of one kind."""
    buffer = io.BytesIO()
    kind = {"jpg": "JPEG", "tif": "TIFF"}.get(ending, ending.upper())
    Image.fromarray(image).save(buffer, kind)
    return buffer.getvalue()


def as_kind(ending: str, *, spoil: Spoil | None = None) -> Spoil:
    """All photographs as files of another kind, one of them spoiled."""

    def make(folder: Path) -> None:
        for path in sorted((folder / "photos").iterdir()):
            with Image.open(path) as image:
                data = encoded(ending, np.asarray(image))
            path.unlink()
            path.with_suffix(f".{ending}").write_bytes(data)
        for name in ("test.toml", "photos.csv"):
            text = (folder / name).read_text()
            (folder / name).write_text(text.replace(".png", f".{ending}"))
        if spoil is not None:
            spoil(folder)

    return make


def every(change: Spoil) -> Spoil:
    """The same done to each photograph, which is ``photos/0002.png`` to the change."""

    def make(folder: Path) -> None:
        change(folder)
        data = (folder / PHOTOGRAPH).read_bytes()
        for path in (folder / "photos").iterdir():
            path.write_bytes(data)

    return make


def _resized(width: int, height: int) -> Spoil:
    return written(PHOTOGRAPH, encoded("png", np.full((height, width), 90, np.uint8)))


def _series_of(width: int, height: int) -> Spoil:
    """All photographs of another size, each with noise of its own."""

    def make(folder: Path) -> None:
        for k, path in enumerate(sorted((folder / "photos").iterdir())):
            rng = np.random.default_rng(k)
            path.write_bytes(encoded("png", rng.integers(0, 255, (height, width), np.uint8)))

    return make


def _one(name: str, data: bytes, *told: str) -> Case:
    """A photograph replaced by these bytes under the same name: it alone is lost."""
    return Case(f"picture: {name}", written(PHOTOGRAPH, data), (*_ONE_LOST, *told), (1,), _MEASURED)


def _zeros(name: str, data: bytes) -> Case:
    """A photograph that decodes to zeros: it is read, and nothing is found in it."""
    return Case(f"picture: {name}", written(PHOTOGRAPH, data), ("frame 2",), (1,), _MEASURED)


def _cut(ending: str, *told: str) -> list[Case]:
    """A photograph of a kind cut off within its header, in its middle, and just before its end."""
    name = f"photos/0002.{ending}"
    parts = {"8 bytes": lambda d: d[:8], "half": lambda d: d[: len(d) // 2], "end": lambda d: d[:-40]}
    return [
        Case(
            f"picture: {ending} cut off at {where}",
            as_kind(ending, spoil=changed(name, cut)),
            (*_ONE_LOST, *told),
            (1,),
            _MEASURED,
        )
        for where, cut in parts.items()
    ]


def _bombs() -> list[Case]:
    limit = ("expected at most", "px")
    return [
        _one("png that says 100 000 x 100 000", png(100_000, 100_000, zlib.compress(b"\0")), *limit),
        _one("png of 16 bits that says 2 000 000 x 1", png(2_000_000, 1, zlib.compress(b"\0"), 16), *limit),
        _one("png that says 2147483647 x 1", png(2**31 - 1, 1, zlib.compress(b"\0")), *limit),
        _zeros("png of the right size, packed bomb", png(255, 73, bomb(100))),
        Case(
            "picture: png of 16 bits, packed bomb",
            written(PHOTOGRAPH, png(255, 73, bomb(100), 16)),
            ("bits a sample",),
        ),
        _one("png with a packed text bomb", _text_bomb()),
        _one("tiff that says 100 000 x 100 000", tiff(100_000, 100_000, b"\0" * 16), *limit),
        _one("tiff that says 4294967295 x 1", tiff(2**32 - 1, 1, b"\0"), *limit),
        _zeros("tiff of the right size, packed bomb", tiff(255, 73, bomb(100), 8)),
        _zeros("tiff with rows a strip of 4294967295", tiff(255, 73, bomb(1), 8, 2**32 - 1)),
        _one("jpeg that says 65500 x 65500", jpeg_of_size(65500, 65500), *limit),
        _one("gif that says 65535 x 65535", gif_of_size(65535, 65535), *limit),
        _one("bmp that says 100 000 x 100 000", bmp_of_size(100_000, 100_000), *limit),
        _one("webp that says 16383 x 16383", webp_of_size(16383, 16383), *limit),
        _one("jpeg 2000 that says 2 000 000 000 wide", jpeg2000_of_size(2_000_000_000, 2), *limit),
        _one("directories of a tiff that go in circles", _circle()),
    ]


def _circle() -> bytes:
    data = bytearray(tiff(255, 73, bytes(255 * 73)))
    data[-4:] = data[4:8]
    return bytes(data)


def _text_bomb() -> bytes:
    text = chunk(b"zTXt", b"Comment\0\0" + bomb(100))
    sound = png(255, 73, zlib.compress(bytes(256 * 73)))
    return sound[:33] + text + sound[33:]


def _no_pictures() -> list[Case]:
    text = b"time_s,force_N\n0,1\n1,2\n"
    jpeg = encoded("jpg", np.full((73, 255), 90, np.uint8))
    return [
        _one("zero bytes", b"", "empty (0 bytes)"),
        _one("a text", text, "not a picture"),
        _one("HTML of a page that was not found", b"<!doctype html><h1>404</h1>", "not a picture"),
        _one("random bytes", np.random.default_rng(1).bytes(5000), "not a picture"),
        _one("zeros, as after a full disk", bytes(5000), "not a picture"),
        _one("a ZIP", b"PK\x03\x04" + bytes(100), "not a picture"),
        _one("a float TIFF", _float_tiff(), "float", "8 or 16 bit"),
        _one("png with a wrong checksum", _wrong_checksum(), "0002.png"),
        _one("png of no rows", png(255, 0, zlib.compress(b"\0")), "0002.png"),
        Case(
            "picture: a text named .jpg",
            together(as_kind("jpg"), written("photos/0002.jpg", text)),
            (*_ONE_LOST, "not a picture"),
            (1,),
            _MEASURED,
        ),
        Case(
            "picture: a JPEG named .png is read as what it is",
            written(PHOTOGRAPH, jpeg),
            (),
            (0, 1),
            _MEASURED,
        ),
        Case("picture: all of zero bytes", every(written(PHOTOGRAPH, b"")), ("none of 4", "0 bytes")),
        Case("picture: all are texts", every(written(PHOTOGRAPH, text)), ("none of 4", "not a picture")),
        Case(
            "picture: a pattern that takes the logs",
            setting("camera.photos", '"*.csv"'),
            ("no photograph matches '*.csv'", ".csv", "convert"),
        ),
        Case(
            "picture: a video of text",
            together(setting("camera.photos", '"photos/*.mp4"'), written("photos/a.mp4", text)),
            ("a.mp4", "not a video that can be read"),
        ),
        Case(
            "picture: a RAW of text",
            together(setting("camera.photos", '"photos/*.nef"'), written("photos/a.nef", text)),
            ("a.nef",),
        ),
        Case(
            "picture: the first of zero bytes",
            written("photos/0000.png", b""),
            ("0000.png",),
            (1,),
            ("force.csv",),
        ),
    ]


def _float_tiff() -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(np.ones((73, 255), np.float32)).save(buffer, "TIFF")
    return buffer.getvalue()


def _wrong_checksum() -> bytes:
    data = bytearray(png(255, 73, zlib.compress(bytes(256 * 73))))
    data[-20] ^= 0xFF
    return bytes(data)


def _sizes() -> list[Case]:
    changes = ("size changes", "0002.png", "expected 255 x 73 px", "Take it out")
    return [
        Case("size: one of 1 x 1", _resized(1, 1), ("got 1 x 1 px", *changes)),
        Case("size: one larger by a column", _resized(256, 73), ("got 256 x 73 px", *changes)),
        Case("size: one turned", _resized(73, 255), ("got 73 x 255 px", *changes)),
        Case("size: one of 30 000 x 20", _resized(30_000, 20), ("got 30000 x 20 px", *changes)),
        Case("size: all of 1 x 1", _series_of(1, 1), ("1 x 1 px", "test.toml", "tip_px")),
        Case("size: all of 2 x 2", _series_of(2, 2), ("2 x 2 px", "tip_px")),
        Case("size: all of 30 000 x 20", _series_of(30_000, 20), ("30000 x 20", "tip_px")),
        Case(
            "size: all of 30 000 x 73, noise",
            _series_of(30_000, 73),
            ("blade",),
            (1,),
            ("force.csv",),
            slow=True,
        ),
        Case("size: all of 20 x 30 000", _series_of(20, 30_000), ("20 x 30000", "tip_px")),
        Case("size: all of 40 000 x 73", _series_of(40_000, 73), ("40000 x 73 px", "expected at most")),
        Case("size: one of 16 bits", _deep(), ("bits a sample changes", "0002.png", "got 16", "expected 8")),
    ]


def _deep() -> Spoil:
    return written(PHOTOGRAPH, encoded("png", np.full((73, 255), 9000, np.uint16)))


def cases() -> list[Case]:
    """All of them."""
    cut = [case for ending in ("png", "jpg", "tif", "webp", "gif", "bmp") for case in _cut(ending)]
    return [*cut, *_no_pictures(), *_bombs(), *_sizes()]
