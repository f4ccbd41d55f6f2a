"""A small file that says it is a huge picture is refused by what it says, not unpacked beyond its size."""

import io
import struct
import tracemalloc
import zlib

import numpy as np
import pytest
import tifffile
from PIL import Image

from ploughval.errors import DataError
from ploughval.photos.reading import grey, header, pillow
from ploughval.photos.reading.decode import decode, read_header
from ploughval.photos.reading.exif import PNG_MAGIC


def png(width, height, packed=b"", bits=8, colours=0):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, bits, colours, 0, 0, 0)
    return PNG_MAGIC + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")


def tiff(width, height, data, compression, rows, bits=8, kind=1):
    values = (width, height, bits, compression, 1, 8, 1, rows, len(data), kind)
    tags = (256, 257, 258, 259, 262, 273, 277, 278, 279, 339)
    entries = b"".join(struct.pack("<HHII", t, 4, 1, v) for t, v in zip(tags, values, strict=True))
    data += b"\0" * (len(data) % 2)
    return (
        b"II*\0" + struct.pack("<I", 8 + len(data)) + data + struct.pack("<H", len(tags)) + entries + bytes(4)
    )


@pytest.mark.parametrize(
    ("name", "data", "told"),
    [
        ("a.png", png(100_000, 100_000), "10 000 000 000 px; expected at most 160 million px"),
        ("a.png", png(32_767, 9), "32767 x 9 px; expected at most 160 million px and 32766 px a side"),
        ("a.png", png(40_000, 2, bits=16), "40000 x 2 px"),
        ("a.tif", tiff(100_000, 100_000, bytes(16), 1, 1), "100000 x 100000 px"),
    ],
)
def test_a_picture_that_says_it_is_huge_is_refused_unread(tmp_path, name, data, told):
    (tmp_path / name).write_bytes(data)
    for read in (read_header, decode):
        with pytest.raises(DataError, match=told):
            read(tmp_path / name)


def test_the_limit_stands_below_that_of_the_decoder(tmp_path):
    (tmp_path / "a.png").write_bytes(png(13_000, 13_000))
    with pytest.raises(DataError, match="13000 x 13000 px; expected at most 160 million px"):
        read_header(tmp_path / "a.png")


def test_a_picture_at_the_limit_is_read(tmp_path):
    Image.fromarray(np.zeros((3, 32_766), np.uint8)).save(tmp_path / "a.png")
    assert read_header(tmp_path / "a.png").shape == (3, 32_766)
    assert decode(tmp_path / "a.png").shape == (3, 32_766)


def test_a_tiff_that_is_packed_a_thousandfold_is_unpacked_to_its_size_alone(tmp_path):
    packed = zlib.compress(bytes(64 << 20), 9)
    (tmp_path / "a.tif").write_bytes(tiff(40, 30, packed, 8, 30))
    tracemalloc.start()
    try:
        image = decode(tmp_path / "a.tif")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert image.shape == (30, 40)
    assert peak < 4 << 20


def test_strips_without_rows_are_refused(tmp_path):
    """Found by spoiling sound files."""
    (tmp_path / "a.tif").write_bytes(tiff(40, 30, zlib.compress(bytes(1200)), 8, 0))
    with pytest.raises(DataError, match="strips or tiles of 40 x 0 px"):
        decode(tmp_path / "a.tif")


def test_a_wrong_checksum_of_a_packed_tiff_is_still_found(tmp_path):
    packed = bytearray(zlib.compress(bytes(1200)))
    packed[-1] ^= 1
    (tmp_path / "a.tif").write_bytes(tiff(40, 30, bytes(packed), 8, 30))
    with pytest.raises(DataError, match="incorrect data check"):
        decode(tmp_path / "a.tif")


def test_directories_of_a_tiff_that_go_in_circles_are_refused(tmp_path):
    data = bytearray(tiff(40, 30, bytes(1200), 1, 30))
    data[-4:] = data[4:8]
    (tmp_path / "a.tif").write_bytes(bytes(data))
    with pytest.raises(DataError, match="go in circles after 1 pictures"):
        read_header(tmp_path / "a.tif")


def test_samples_that_are_no_grey_levels_are_refused_by_the_header(tmp_path):
    buffer = io.BytesIO()
    Image.fromarray(np.ones((8, 8), np.float32)).save(buffer, "TIFF")
    (tmp_path / "a.tif").write_bytes(buffer.getvalue())
    with pytest.raises(DataError, match="samples of type float32, axes YX; expected 8 or 16 bit"):
        read_header(tmp_path / "a.tif")


def test_samples_of_16_bits_that_unpack_to_more_than_memory_should_hold_are_refused_unread(tmp_path):
    (tmp_path / "a.png").write_bytes(png(9_000, 9_200, bits=16, colours=6))
    with pytest.raises(DataError, match=r"it unpacks to 994 MB with 4 samples a pixel; expected at most 960"):
        decode(tmp_path / "a.png")


def test_a_tiff_of_many_samples_a_pixel_is_held_to_the_same_limit(tmp_path, monkeypatch):
    tifffile.imwrite(
        tmp_path / "a.tif", np.zeros((20, 30, 5), np.uint16), photometric="rgb", extrasamples=(0, 0)
    )
    assert decode(tmp_path / "a.tif").shape == (20, 30)
    monkeypatch.setattr(header, "SAMPLE_BYTES", 5999)
    with pytest.raises(DataError, match=r"it unpacks to 6 kB with 5 samples a pixel; expected at most 6 kB"):
        decode(tmp_path / "a.tif")


@pytest.mark.parametrize("mode", ["P", "CMYK", "LA", "RGBA", "1"])
def test_what_is_converted_in_parts_is_what_it_is_as_a_whole(monkeypatch, mode):
    monkeypatch.setattr(pillow, "ROWS", 7)
    colours = np.random.default_rng(1).integers(0, 255, (23, 30, 3)).astype(np.uint8)
    image = Image.fromarray(colours).convert(mode)
    whole = np.asarray(image.convert("RGBA"))[..., :3]
    found = pillow.samples_of(image)
    assert np.array_equal(found if found.ndim == 3 else np.dstack([found] * 3), whole)


def test_grey_is_made_in_parts_as_of_the_whole(monkeypatch):
    colours = np.random.default_rng(2).integers(0, 65_536, (23, 31, 3)).astype(np.uint16)
    whole = grey.to_grey(colours)
    monkeypatch.setattr(grey, "ROWS", 5)
    assert np.array_equal(grey.to_grey(colours), whole)
