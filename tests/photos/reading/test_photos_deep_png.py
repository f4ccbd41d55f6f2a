"""PNG of 16 bits: every kind of colours keeps every bit, and what is damaged is refused."""

import struct
import zlib

import cv2
import numpy as np
import pytest

from ploughval.errors import DataError
from ploughval.photos.reading.decode import decode, read_header

RNG = np.random.default_rng(11)
PASSES = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
"""First column and row, and steps, of each pass of Adam7 (PNG, 8.2)."""
COLOURS = {0: 1, 2: 3, 4: 2, 6: 4}


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def filtered(samples):
    """Rows of bytes, each after its filter: none, left, up in turn (PNG, 9.2)."""
    rows = np.ascontiguousarray(samples.astype(">u2")).view(np.uint8).reshape(len(samples), -1)
    step, above, out = 2 * samples.shape[2], np.zeros(rows.shape[1], np.uint8), b""
    for k, row in enumerate(rows):
        left = np.concatenate([np.zeros(step, np.uint8), row[:-step]])
        out += bytes([k % 3]) + (row - (0 * row, left, above)[k % 3]).tobytes()
        above = row
    return out


def png(samples, colours, *, interlaced=False, packed=lambda data: data):
    height, width = samples.shape[:2]
    parts = [samples[y::down, x::across] for x, y, across, down in PASSES] if interlaced else [samples]
    data = packed(zlib.compress(b"".join(filtered(part) for part in parts if part.size)))
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, colours, 0, 0, interlaced))
    half = len(data) // 2
    body = chunk(b"IDAT", data[:half]) + chunk(b"IDAT", data[half:])
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"tEXt", b"a\0b") + body + chunk(b"IEND", b"")


def made(colours, height=21, width=33):
    return RNG.integers(0, 65536, (height, width, COLOURS[colours])).astype(np.uint16)


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize("colours", COLOURS)
@pytest.mark.parametrize("shape", [(21, 33), (1, 1), (600, 3)])
def test_every_kind_of_colours_keeps_every_bit(tmp_path, colours, interlaced, shape):
    path, samples = tmp_path / "a.png", made(colours, *shape)
    path.write_bytes(png(samples, colours, interlaced=interlaced))
    assert (read_header(path).bits, read_header(path).shape) == (16, shape)
    for k, channel in enumerate(("red", "green", "blue")):
        expected = samples[..., k if COLOURS[colours] > 2 else 0]
        np.testing.assert_array_equal(decode(path, channel=channel), expected)
    assert decode(path).dtype == np.uint16


def test_no_decoder_of_opencv_is_asked(tmp_path, monkeypatch):
    (tmp_path / "a.png").write_bytes(png(made(2), 2))
    cv2.imwrite(str(tmp_path / "b.jp2"), RNG.integers(0, 256, (64, 64)).astype(np.uint8))
    monkeypatch.setattr(cv2, "imdecode", None)
    assert decode(tmp_path / "a.png").shape == (21, 33)
    assert decode(tmp_path / "b.jp2").shape == (64, 64)


def refused(tmp_path, data, match):
    path = tmp_path / "a.png"
    path.write_bytes(data)
    with pytest.raises(DataError, match=match) as caught:
        decode(path)
    assert caught.value.path == str(path)


@pytest.mark.parametrize("kept", [0.3, 0.6, 0.99])
def test_a_file_that_is_cut_off_is_refused(tmp_path, kept):
    data = png(made(2), 2)
    refused(tmp_path, data[: int(len(data) * kept)], "truncated")


def test_a_file_without_its_end_is_refused(tmp_path):
    refused(tmp_path, png(made(0), 0)[:-12], "truncated")


def test_a_length_beyond_the_file_is_refused_before_it_is_read(tmp_path):
    data = png(made(0), 0)
    place = data.index(b"IDAT") - 4
    refused(tmp_path, data[:place] + b"\xff\xff\xff\xff" + data[place + 4 :], "truncated")


def test_a_changed_byte_is_refused_by_the_chunks_checksum(tmp_path):
    data = bytearray(png(made(6), 6))
    data[data.index(b"IDAT") + 100] ^= 1
    refused(tmp_path, bytes(data), "checksum of a chunk 'IDAT'")


def test_a_changed_byte_is_refused_by_the_checksum_of_the_samples(tmp_path):
    def spoiled(data):
        return data[:100] + bytes([data[100] ^ 1]) + data[101:]

    refused(tmp_path, png(made(4), 4, packed=spoiled), "cannot be decoded")


def test_too_few_samples_are_refused(tmp_path):
    short = zlib.compress(b"\0" * 50)
    refused(tmp_path, png(made(2), 2, packed=lambda _: short), "cannot be decoded")


@pytest.mark.parametrize(("place", "value"), [(9, 3), (9, 9), (10, 1), (12, 2)])
def test_a_header_that_no_deep_png_has_is_refused(tmp_path, place, value):
    data = bytearray(png(made(0), 0))
    data[16 + place] = value
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    refused(tmp_path, bytes(data), "no header of a PNG of 16 bits")
