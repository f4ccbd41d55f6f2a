"""Every kind of TIFF that a camera or a converter writes gives its stored samples, or says why not."""

import io
import lzma
import struct

import numpy as np
import pytest
import tifffile
from PIL import Image

from ploughval.errors import DataError
from ploughval.photos.reading.decode import decode, read_header

RNG = np.random.default_rng(11)
HEIGHT, WIDTH = 37, 52
GREY_8 = RNG.integers(0, 256, (HEIGHT, WIDTH)).astype(np.uint8)
GREY_16 = RNG.integers(0, 65536, (HEIGHT, WIDTH)).astype(np.uint16)
COLOUR_16 = RNG.integers(0, 65536, (HEIGHT, WIDTH, 3)).astype(np.uint16)
CODES = {"none": 1, "lzw": 5, "deflate": 8, "packbits": 32773, "lzma": 34925, "zstd": 50000}
PILLOW = {"lzw": "tiff_lzw", "deflate": "tiff_adobe_deflate", "packbits": "packbits", "zstd": "zstd"}


def squeeze(data, rows, kind):
    """A segment packed by libtiff, told that its bytes are a grey picture."""
    if kind == "none":
        return data
    if kind == "lzma":
        return lzma.compress(data)
    file = io.BytesIO()
    picture = Image.frombytes("L", (len(data) // rows, rows), data)
    try:
        picture.save(file, "TIFF", compression=PILLOW[kind], tiffinfo={278: rows})
    except OSError:
        pytest.skip(f"Pillow's libtiff does not write {kind}")
    file.seek(0)
    with tifffile.TiffFile(file) as tiff:
        page = tiff.pages[0]
        assert len(page.dataoffsets) == 1
        return file.getvalue()[page.dataoffsets[0] : page.dataoffsets[0] + page.databytecounts[0]]


def write_tiff(path, segments, tags, order="<"):
    """A TIFF from its segments and tags, byte by byte."""
    tags = {256: WIDTH, 257: HEIGHT, **tags}
    tiled = 322 in tags
    offsets, data = [], b""
    for segment in segments:
        offsets.append(8 + len(data))
        data += segment + bytes(len(segment) % 2)
    tags |= {324 if tiled else 273: offsets, 325 if tiled else 279: [len(s) for s in segments]}
    entries, extra, start = b"", b"", 8 + len(data)
    end = start + 2 + 12 * len(tags) + 4
    for tag, values in sorted(tags.items()):
        values = values if isinstance(values, list) else [values]
        packed = struct.pack(f"{order}{len(values)}I", *values)
        if len(values) > 1:
            packed, extra = struct.pack(f"{order}I", end + len(extra)), extra + packed
        entries += struct.pack(f"{order}HHI", tag, 4, len(values)) + packed
    head = (b"II" if order == "<" else b"MM") + struct.pack(f"{order}HI", 42, start)
    path.write_bytes(head + data + struct.pack(f"{order}H", len(tags)) + entries + bytes(4) + extra)


def strips(planes, rows, kind, order):
    """Each plane (H, W, samples) cut into strips of so many rows."""
    parts = [p[k : k + rows] for p in planes for k in range(0, HEIGHT, rows)]
    return [squeeze(part.astype(f"{order}u{part.itemsize}").tobytes(), len(part), kind) for part in parts]


@pytest.mark.parametrize("kind", CODES)
@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("photometric", [0, 1])
def test_16_bit_grey_keeps_every_bit_in_every_packing(tmp_path, kind, order, photometric):
    stored = GREY_16 if photometric else 65535 - GREY_16
    tags = {258: 16, 259: CODES[kind], 262: photometric, 277: 1, 278: 8}
    write_tiff(tmp_path / "a.tif", strips([stored[..., None]], 8, kind, order), tags, order)
    np.testing.assert_array_equal(decode(tmp_path / "a.tif"), GREY_16)


@pytest.mark.parametrize("kind", CODES)
@pytest.mark.parametrize("apart", [False, True])
def test_16_bit_colours_keep_every_bit_in_every_packing(tmp_path, kind, apart):
    planes = np.moveaxis(COLOUR_16, -1, 0)[..., None] if apart else [COLOUR_16]
    tags = {258: [16] * 3, 259: CODES[kind], 262: 2, 277: 3, 278: 11, 284: 2 if apart else 1}
    write_tiff(tmp_path / "a.tif", strips(planes, 11, kind, ">"), tags, ">")
    for index, channel in enumerate(("red", "green", "blue")):
        np.testing.assert_array_equal(decode(tmp_path / "a.tif", channel=channel), COLOUR_16[..., index])


@pytest.mark.parametrize("kind", ["lzw", "zstd"])
def test_differences_along_rows_are_summed_again(tmp_path, kind):
    stored = np.diff(COLOUR_16, axis=1, prepend=np.zeros((HEIGHT, 1, 3), np.uint16))
    tags = {258: [16] * 3, 259: CODES[kind], 262: 2, 277: 3, 278: 11, 317: 2}
    write_tiff(tmp_path / "a.tif", strips([stored], 11, kind, "<"), tags)
    np.testing.assert_array_equal(decode(tmp_path / "a.tif", channel="blue"), COLOUR_16[..., 2])


@pytest.mark.parametrize("kind", ["lzw", "deflate"])
def test_tiles_that_reach_over_the_edge_are_cut(tmp_path, kind):
    padded = np.pad(GREY_16, ((0, 48 - HEIGHT), (0, 64 - WIDTH)), constant_values=7)
    parts = [padded[r : r + 16, c : c + 32] for r in (0, 16, 32) for c in (0, 32)]
    tags = {258: 16, 259: CODES[kind], 262: 1, 277: 1, 322: 32, 323: 16}
    write_tiff(tmp_path / "a.tif", [squeeze(p.tobytes(), 16, kind) for p in parts], tags)
    np.testing.assert_array_equal(decode(tmp_path / "a.tif"), GREY_16)


@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
@pytest.mark.parametrize("kind", ["none", "lzw"])
def test_alpha_is_left_out_and_not_multiplied(tmp_path, depth, kind):
    bits = 8 * np.dtype(depth).itemsize
    samples = RNG.integers(0, 1 << bits, (HEIGHT, WIDTH, 4)).astype(depth)
    for count, photometric in ((4, 2), (2, 1)):
        for alpha in (1, 2):  # associated and not
            part = np.ascontiguousarray(samples[..., :count])
            tags = {258: [bits] * count, 259: CODES[kind], 262: photometric, 277: count, 278: 9, 338: alpha}
            write_tiff(tmp_path / "a.tif", strips([part], 9, kind, "<"), tags)
            np.testing.assert_array_equal(decode(tmp_path / "a.tif", channel="red"), samples[..., 0])


@pytest.mark.parametrize("bits", [4, 10, 12, 14])
@pytest.mark.parametrize("kind", ["none", "lzw"])
def test_packed_samples_are_unpacked(tmp_path, bits, kind):
    values = RNG.integers(0, 1 << bits, (HEIGHT, WIDTH))
    digits = (values[..., None] >> np.arange(bits)[::-1]) & 1
    rows = np.packbits(digits.reshape(HEIGHT, -1).astype(np.uint8), axis=1)
    packed = [squeeze(rows[k : k + 10].tobytes(), len(rows[k : k + 10]), kind) for k in range(0, HEIGHT, 10)]
    for photometric, expected in ((1, values), (0, (1 << bits) - 1 - values)):
        tags = {258: bits, 259: CODES[kind], 262: photometric, 277: 1, 278: 10}
        write_tiff(tmp_path / "a.tif", packed, tags)
        np.testing.assert_array_equal(decode(tmp_path / "a.tif"), expected)
        assert read_header(tmp_path / "a.tif").bits == (16 if bits > 8 else 8)


@pytest.mark.parametrize("bits", [1, 2, 4, 8])
def test_palettes_of_every_depth_are_looked_up(tmp_path, bits):
    index = RNG.integers(0, 1 << bits, (HEIGHT, WIDTH))
    colours = RNG.integers(0, 256, (3, 1 << bits))
    digits = (index[..., None] >> np.arange(bits)[::-1]) & 1
    rows = np.packbits(digits.reshape(HEIGHT, -1).astype(np.uint8), axis=1)
    tags = {258: bits, 259: 1, 262: 3, 277: 1, 278: HEIGHT, 320: (257 * colours).ravel().tolist()}
    write_tiff(tmp_path / "a.tif", [rows.tobytes()], tags)
    for k, channel in enumerate(("red", "green", "blue")):
        np.testing.assert_array_equal(decode(tmp_path / "a.tif", channel=channel), colours[k][index])


def test_jpeg_inside_a_tiff_is_its_luma_within_a_level(tmp_path):
    ramp = np.add.outer(np.arange(HEIGHT), 3 * np.arange(WIDTH)).astype(np.uint8)
    Image.fromarray(ramp).save(tmp_path / "a.tif", compression="jpeg", quality=100)
    assert np.abs(decode(tmp_path / "a.tif").astype(int) - ramp).max() <= 1


@pytest.mark.parametrize("compression", ["group3", "group4", "packbits"])
def test_black_and_white_is_0_and_255(tmp_path, compression):
    picture = GREY_8 > 128
    Image.fromarray(picture).save(tmp_path / "a.tif", compression=compression)
    np.testing.assert_array_equal(decode(tmp_path / "a.tif"), picture * 255)


@pytest.mark.parametrize(
    ("samples", "options", "text"),
    [
        (GREY_16.astype(np.float32), {}, "float32"),
        (GREY_16.astype(np.float32), {"compression": "zlib"}, "float32"),
        (GREY_16.astype(np.uint32), {}, "uint32"),
        (GREY_16.astype(np.int16), {}, "int16"),
        (np.stack([GREY_16, GREY_16]), {"volumetric": True, "tile": (1, 16, 16)}, "one plane"),
        (COLOUR_16.astype(np.uint8), {"photometric": "cielab"}, "CIELAB"),
        (np.dstack([COLOUR_16, GREY_16]), {"photometric": "separated"}, "SEPARATED of 16 bits"),
    ],
)
def test_samples_without_a_grey_level_are_refused_by_kind(tmp_path, samples, options, text):
    tifffile.imwrite(tmp_path / "a.tif", samples, **options)
    with pytest.raises(DataError, match=text):
        decode(tmp_path / "a.tif")


def test_a_compression_that_is_not_read_is_named(tmp_path):
    tags = {258: 8, 259: 50001, 262: 1, 277: 1, 278: HEIGHT}  # WebP
    write_tiff(tmp_path / "a.tif", [b"RIFF"], tags)
    with pytest.raises(DataError, match="compression WEBP; save it with deflate"):
        decode(tmp_path / "a.tif")


@pytest.mark.parametrize("kind", ["lzw", "packbits", "zstd"])
def test_a_damaged_strip_is_refused(tmp_path, kind):
    tags = {258: 16, 259: CODES[kind], 262: 1, 277: 1, 278: HEIGHT}
    (strip,) = strips([GREY_16[..., None]], HEIGHT, kind, "<")
    write_tiff(tmp_path / "a.tif", [strip[: len(strip) // 2]], tags)
    with pytest.raises(DataError, match=r"a\.tif"):
        decode(tmp_path / "a.tif")


@pytest.mark.parametrize("kind", ["deflate", "lzma"])  # the others hold no checksum
def test_damage_inside_a_packed_strip_is_refused(tmp_path, kind):
    strip = bytearray(strips([GREY_16[..., None]], HEIGHT, kind, "<")[0])
    middle = len(strip) // 2
    strip[middle : middle + 400] = bytes(400)
    tags = {258: 16, 259: CODES[kind], 262: 1, 277: 1, 278: HEIGHT}
    write_tiff(tmp_path / "a.tif", [bytes(strip)], tags)
    with pytest.raises(DataError, match=r"a\.tif: cannot be decoded"):
        decode(tmp_path / "a.tif")


def test_pages_of_different_size_are_refused(tmp_path):
    with tifffile.TiffWriter(tmp_path / "a.tif") as tiff:
        tiff.write(GREY_8)
        tiff.write(GREY_8[::2])
    with pytest.raises(DataError, match=r"page 1 has \(19, 52\) rows and columns, page 0 has \(37, 52\)"):
        read_header(tmp_path / "a.tif")


@pytest.mark.parametrize("orientation", range(1, 9))
def test_orientation_does_not_turn_what_libtiff_decodes(tmp_path, orientation):
    ramp = np.add.outer(np.arange(HEIGHT), 3 * np.arange(WIDTH)).astype(np.uint8)
    tags = {274: orientation}
    Image.fromarray(ramp).save(tmp_path / "a.tif", compression="jpeg", quality=100, tiffinfo=tags)
    Image.fromarray(GREY_8 > 128).save(tmp_path / "b.tif", compression="group4", tiffinfo=tags)
    assert read_header(tmp_path / "a.tif").tags.orientation == orientation
    assert np.abs(decode(tmp_path / "a.tif").astype(int) - ramp).max() <= 1
    np.testing.assert_array_equal(decode(tmp_path / "b.tif"), (GREY_8 > 128) * 255)


def test_strips_of_hardly_any_rows_are_refused_by_name(tmp_path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.zeros((20, 30), np.uint8))
    data = bytearray(path.read_bytes())
    with tifffile.TiffFile(path) as tiff:
        place = tiff.pages[0].tags["RowsPerStrip"].offset
    data[place : place + 12] = struct.pack(
        "<HHII", 278, 12, 1, len(data)
    )  # a double in the place of a number
    path.write_bytes(data + struct.pack("<d", 1e-320))
    with pytest.raises(DataError, match="cannot be read") as caught:
        read_header(path)
    assert caught.value.path == str(path)
