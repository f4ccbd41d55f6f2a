"""Samples come out as they are stored, whatever the container."""

import struct
import sys
import zlib

import cv2
import numpy as np
import pytest
import tifffile
from PIL import Image

from ploughval.errors import DataError, MissingExtraError
from ploughval.photos.reading.decode import decode, decode_8bit, read_header

RNG = np.random.default_rng(7)
COLOUR = RNG.integers(0, 256, (20, 30, 3)).astype(np.uint8)
COLOUR_16 = RNG.integers(0, 65536, (20, 30, 3)).astype(np.uint16)
GREY_16 = RNG.integers(0, 65536, (20, 30)).astype(np.uint16)


def luma(samples):
    """ITU-R BT.601, from its definition."""
    return samples[..., :3].astype(float) @ [0.299, 0.587, 0.114]


@pytest.mark.parametrize("ending", ["png", "bmp", "tif"])
def test_8_bit_colour_becomes_bt601_luma_within_half_a_level(tmp_path, ending):
    path = tmp_path / f"a.{ending}"
    Image.fromarray(COLOUR).save(path)
    image = decode(path)
    assert image.dtype == np.uint8
    assert image.flags.c_contiguous
    assert np.abs(image - luma(COLOUR)).max() <= 0.51  # rounding, plus weights of 14 bits


@pytest.mark.parametrize(("channel", "index"), [("red", 0), ("green", 1), ("blue", 2)])
def test_a_channel_is_the_stored_one(tmp_path, channel, index):
    path = tmp_path / "a.png"
    Image.fromarray(COLOUR).save(path)
    image = decode(path, channel=channel)
    assert image.flags.c_contiguous
    np.testing.assert_array_equal(image, COLOUR[..., index])


def test_jpeg_luma_is_the_stored_luma_within_one_level_of_the_colours(tmp_path):
    smooth = cv2.GaussianBlur(COLOUR, (0, 0), 2.0)
    path = tmp_path / "a.jpg"
    Image.fromarray(smooth).save(path, quality=95)
    colours = np.stack([decode(path, channel=c) for c in ("red", "green", "blue")], -1)
    assert np.abs(decode(path) - luma(colours)).max() <= 1.5  # each colour is rounded before it is summed


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"compression": "zlib"},
        {"compression": "zlib", "predictor": True},
        {"byteorder": ">"},
        {"bigtiff": True},
        {"tile": (16, 16)},
    ],
)
def test_16_bit_grey_tiff_keeps_every_bit(tmp_path, options):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, GREY_16, **options)
    np.testing.assert_array_equal(decode(path), GREY_16)
    assert read_header(path).bits == 16


def test_16_bit_grey_with_lzw_keeps_every_bit(tmp_path):
    path = tmp_path / "a.tif"
    Image.fromarray(GREY_16).save(path, compression="tiff_lzw")
    np.testing.assert_array_equal(decode(path), GREY_16)


@pytest.mark.parametrize("ending", ["png", "tif"])
def test_16_bit_colour_keeps_16_bits(tmp_path, ending):
    path = tmp_path / f"a.{ending}"
    assert cv2.imwrite(str(path), COLOUR_16[..., ::-1])  # OpenCV writes LZW, blue first
    image = decode(path)
    assert image.dtype == np.uint16
    assert np.abs(image - luma(COLOUR_16)).max() <= 3  # weights of 14 bits on 16-bit samples
    np.testing.assert_array_equal(decode(path, channel="blue"), COLOUR_16[..., 2])


def test_16_bit_grey_png_keeps_every_bit(tmp_path):
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), GREY_16)
    np.testing.assert_array_equal(decode(path), GREY_16)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_tiff_orientation_does_not_turn_the_samples(tmp_path, orientation):
    plain, packed = tmp_path / "a.tif", tmp_path / "b.tif"
    tag = [(274, "H", 1, orientation, True)]
    tifffile.imwrite(plain, GREY_16, extratags=tag)
    Image.fromarray(COLOUR).save(packed, compression="tiff_lzw", tiffinfo={274: orientation})
    np.testing.assert_array_equal(decode(plain), GREY_16)
    assert np.abs(decode(packed) - luma(COLOUR)).max() <= 0.51
    assert read_header(plain).tags.orientation == read_header(packed).tags.orientation == orientation


@pytest.mark.parametrize("ending", ["jpg", "png"])
def test_exif_orientation_does_not_turn_the_samples(tmp_path, ending):
    path = tmp_path / f"a.{ending}"
    exif = Image.Exif()
    exif[0x0112] = 6
    image = np.tile(np.arange(0, 240, 8, dtype=np.uint8), (20, 1))
    Image.fromarray(image).save(path, exif=exif, quality=100)
    assert decode(path).shape == (20, 30)
    assert np.abs(decode(path).astype(int) - image).max() <= 1  # JPEG at quality 100
    assert read_header(path).tags.orientation == 6
    assert read_header(path).shape == (20, 30)


def test_exif_after_the_samples_of_a_png_is_found(tmp_path):
    path = tmp_path / "a.png"
    Image.fromarray(COLOUR).save(path)
    exif = Image.Exif()
    exif[0x0112] = 3
    exif[0x8769] = {0x9003: "2024:05:01 10:00:00"}
    chunk = b"eXIf" + exif.tobytes().removeprefix(b"Exif\0\0")
    data = path.read_bytes()
    added = struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk))
    path.write_bytes(data[:-12] + added + data[-12:])
    assert read_header(path).tags.orientation == 3
    assert read_header(path).tags.time.date == "2024:05:01 10:00:00"


def test_a_header_is_read_without_decoding(tmp_path, monkeypatch):
    for name in ("a.jpg", "a.png", "a.tif", "a.bmp"):
        Image.fromarray(COLOUR).save(tmp_path / name)

    def refuse(self):
        raise AssertionError("decoded")

    monkeypatch.setattr(Image.Image, "load", refuse)
    monkeypatch.setattr("PIL.ImageFile.ImageFile.load", refuse)
    for name in ("a.jpg", "a.png", "a.tif", "a.bmp"):
        assert read_header(tmp_path / name).shape == (20, 30)


def test_palette_is_looked_up(tmp_path):
    palette = RNG.integers(0, 256, (256, 3)).astype(np.uint8)
    index = RNG.integers(0, 256, (20, 30)).astype(np.uint8)
    image = Image.fromarray(index)
    image.putpalette(palette.ravel().tolist())
    for name, options in {
        "a.png": {},
        "b.png": {"transparency": bytes([0, 40, 80])},
        "c.gif": {},
        "d.bmp": {},
    }.items():
        image.save(tmp_path / name, **options)
        assert np.abs(decode(tmp_path / name) - luma(palette[index])).max() <= 0.51, name
    table = (palette.T.astype(np.uint16)) * 257
    tifffile.imwrite(tmp_path / "e.tif", index, photometric="palette", colormap=table)
    assert np.abs(decode(tmp_path / "e.tif") - luma(palette[index])).max() <= 0.51


@pytest.mark.parametrize("alpha", [0, 128, 255])
def test_alpha_changes_nothing(tmp_path, alpha):
    layer = np.full((20, 30, 1), alpha, np.uint8)
    Image.fromarray(np.concatenate([COLOUR, layer], 2)).save(tmp_path / "a.png")
    Image.fromarray(np.concatenate([COLOUR[..., :1], layer], 2)).save(tmp_path / "b.png")
    tifffile.imwrite(
        tmp_path / "c.tif", np.concatenate([COLOUR, layer], 2), photometric="rgb", extrasamples=["unassalpha"]
    )
    deep = np.concatenate([COLOUR_16, layer.astype(np.uint16) * 257], 2)
    cv2.imwrite(str(tmp_path / "d.png"), np.ascontiguousarray(deep[..., [2, 1, 0, 3]]))
    assert np.abs(decode(tmp_path / "a.png") - luma(COLOUR)).max() <= 0.51
    np.testing.assert_array_equal(decode(tmp_path / "b.png"), COLOUR[..., 0])
    assert np.abs(decode(tmp_path / "c.tif") - luma(COLOUR)).max() <= 0.51
    assert np.abs(decode(tmp_path / "d.png") - luma(COLOUR_16)).max() <= 3


def test_white_is_zero_tiff_is_turned_to_black_is_zero(tmp_path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, 65535 - GREY_16, photometric="miniswhite")
    np.testing.assert_array_equal(decode(path), GREY_16)


def test_planes_apart_are_joined(tmp_path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.moveaxis(COLOUR_16, -1, 0), photometric="rgb", planarconfig="separate")
    np.testing.assert_array_equal(decode(path, channel="green"), COLOUR_16[..., 1])


def test_pages_of_a_tiff_are_pictures_but_its_thumbnail_is_none(tmp_path):
    path = tmp_path / "a.tif"
    with tifffile.TiffWriter(path) as tiff:
        tiff.write(GREY_16)
        tiff.write(GREY_16[::2, ::2], subfiletype=1)
        tiff.write(GREY_16[::-1])
    assert read_header(path).pages == (0, 2)
    np.testing.assert_array_equal(decode(path, 2), GREY_16[::-1])


def test_frames_of_a_gif_are_pictures(tmp_path):
    frames = [Image.fromarray(np.full((20, 30), 10 * k, np.uint8)) for k in range(4)]
    frames[0].save(tmp_path / "a.gif", save_all=True, append_images=frames[1:])
    assert read_header(tmp_path / "a.gif").pages == (0, 1, 2, 3)
    assert [int(decode(tmp_path / "a.gif", k)[5, 5]) for k in (3, 0, 2)] == [30, 0, 20]


@pytest.mark.parametrize("kind", ["jpg", "png", "tif", "lzw.tif", "16.png", "bmp", "gif"])
def test_a_truncated_file_is_refused(tmp_path, kind):
    path = tmp_path / f"a.{kind}"
    if kind == "16.png":
        cv2.imwrite(str(path), COLOUR_16)
    else:
        Image.fromarray(COLOUR).save(path, **({"compression": "tiff_lzw"} if kind == "lzw.tif" else {}))
    data = path.read_bytes()
    for kept in (0.5, 0.9):
        path.write_bytes(data[: int(len(data) * kept)])
        with pytest.raises(DataError, match="a\\."):
            decode(path)


def test_what_is_no_picture_is_refused_by_name(tmp_path):
    (tmp_path / "a.jpg").write_text("not a photograph at all\n")
    (tmp_path / "b.jpg").write_bytes(b"")
    tifffile.imwrite(tmp_path / "c.tif", GREY_16.astype(np.float32))
    for name, text in {"a.jpg": "not a picture", "b.jpg": "0 bytes", "c.tif": "float32"}.items():
        with pytest.raises(DataError, match=text) as caught:
            decode(tmp_path / name)
        assert caught.value.path == str(tmp_path / name)


@pytest.mark.filterwarnings("ignore:Corrupt EXIF")
def test_a_damaged_exif_block_does_not_lose_the_picture(tmp_path):
    path = tmp_path / "a.jpg"
    Image.fromarray(COLOUR).save(path, exif=b"Exif\0\0II*\0\xff\xff\xff\x7fgarbage")
    assert read_header(path).tags.orientation == 1
    assert decode(path).shape == (20, 30)


def test_a_png_with_gamma_is_read_as_stored(tmp_path):
    path = tmp_path / "a.png"
    Image.fromarray(COLOUR).save(path)
    data = path.read_bytes()
    chunk = b"gAMA" + struct.pack(">I", 100_000)
    path.write_bytes(
        data[:33] + struct.pack(">I", 4) + chunk + struct.pack(">I", zlib.crc32(chunk)) + data[33:]
    )
    assert np.abs(decode(path) - luma(COLOUR)).max() <= 0.51


def test_raw_without_the_extra_names_the_line_that_installs_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rawpy", None)
    (tmp_path / "a.nef").write_bytes(b"II*\0" + bytes(100))
    with pytest.raises(MissingExtraError, match=r"pip install 'ploughval\[raw\]'"):
        read_header(tmp_path / "a.nef")


def test_a_16_bit_board_picture_is_stretched_to_8_bits(tmp_path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.array([[0, 500], [1000, 250]], np.uint16))
    np.testing.assert_allclose(decode_8bit(path), [[0, 127], [255, 63]], atol=1)


def write_dng(path, levels, orientation):
    """A minimal linear DNG: (H, W) uint16 sensor values under a red-green-blue mosaic, white at 16383."""
    unit = (1, 1, 0, 1, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 1, 1)
    tags = [
        (50706, "B", 4, bytes([1, 4, 0, 0]), True),
        (50707, "B", 4, bytes([1, 1, 0, 0]), True),
        (50708, "s", 0, "Test", True),
        (33421, "H", 2, (2, 2), True),
        (33422, "B", 4, bytes([0, 1, 1, 2]), True),
        (50714, "H", 1, 0, True),
        (50717, "H", 1, 16383, True),
        (50721, "2i", 9, unit, True),
        (50778, "H", 1, 21, True),
        (50728, "2I", 3, (1, 1, 1, 1, 1, 1), True),
        (274, "H", 1, orientation, True),
    ]
    tifffile.imwrite(path, levels, photometric=32803, extratags=tags, metadata=None)


def test_raw_is_linear_16_bit_and_not_turned(tmp_path):
    pytest.importorskip("rawpy")
    levels = np.full((60, 80), 4000, np.uint16)
    levels[20:40, 30:60] = 12000
    path = tmp_path / "a.dng"
    write_dng(path, levels, 6)
    image = decode(path)
    assert read_header(path).shape == image.shape == (60, 80)
    assert read_header(path).tags.orientation == 6
    assert image.dtype == np.uint16
    assert image[30, 45] / image[5, 5] == pytest.approx(3.0, rel=1e-3)
    path.write_bytes(path.read_bytes()[:4000])
    with pytest.raises(DataError, match="cannot be decoded as RAW"):
        decode(path)


def test_an_inverted_cmyk_jpeg_is_its_luma_within_two_levels(tmp_path):
    smooth = cv2.GaussianBlur(COLOUR, (0, 0), 3.0)
    ink = 255 - np.dstack([smooth, np.full((20, 30), 255, np.uint8)])
    Image.frombytes("CMYK", (30, 20), ink.tobytes()).save(tmp_path / "a.jpg", quality=100)
    assert np.abs(decode(tmp_path / "a.jpg") - luma(smooth)).max() <= 2  # JPEG at quality 100


@pytest.mark.parametrize("options", [{"progressive": True}, {"format": "MPO", "save_all": True}])
def test_progressive_jpeg_and_mpo_are_their_first_picture(tmp_path, options):
    smooth = cv2.GaussianBlur(COLOUR, (0, 0), 3.0)
    second = {"append_images": [Image.fromarray(smooth[::2, ::2])]} if "format" in options else {}
    path = tmp_path / "a.jpg"
    Image.fromarray(smooth).save(path, quality=100, subsampling=0, **options, **second)
    assert read_header(path).pages == (0,)
    assert np.abs(decode(path) - luma(smooth)).max() <= 2
    other = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    assert np.abs(decode(path).astype(int) - other).max() <= 1


@pytest.mark.parametrize("samples", [COLOUR, COLOUR_16, GREY_16], ids=["colour", "deep", "grey"])
def test_jpeg_2000_keeps_its_bits(tmp_path, samples):
    path = tmp_path / "a.jp2"
    samples = np.concatenate([samples] * 5)  # its writer refuses pictures of few rows
    samples = np.concatenate([samples] * 4, axis=1)
    stored = samples[..., ::-1] if samples.ndim == 3 else samples
    assert cv2.imwrite(str(path), stored, [cv2.IMWRITE_JPEG2000_COMPRESSION_X1000, 1000])
    image, header = decode(path), read_header(path)
    expected = luma(samples) if samples.ndim == 3 else samples
    assert image.dtype == samples.dtype
    assert header.bits == 8 * samples.itemsize
    assert np.abs(image - expected).max() <= (0.51 if samples.dtype == np.uint8 else 3)


def test_lossless_webp_and_black_and_white_png_keep_their_samples(tmp_path):
    Image.fromarray(COLOUR).save(tmp_path / "a.webp", lossless=True)
    assert np.abs(decode(tmp_path / "a.webp") - luma(COLOUR)).max() <= 0.51
    Image.fromarray(COLOUR[..., 0] > 128).save(tmp_path / "b.png")
    np.testing.assert_array_equal(decode(tmp_path / "b.png"), (COLOUR[..., 0] > 128) * 255)


def test_a_jpeg_of_12_bits_is_refused_by_name(tmp_path):
    Image.fromarray(COLOUR).save(tmp_path / "a.jpg")
    data = bytearray((tmp_path / "a.jpg").read_bytes())
    data[data.index(b"\xff\xc0") + 4] = 12  # precision in the frame header
    (tmp_path / "a.jpg").write_bytes(data)
    with pytest.raises(DataError, match="expected 8 bits a sample"):
        decode(tmp_path / "a.jpg")


def write_png(path, head, data):
    """A PNG from its header (width, height, bits, colours, 0, 0, interlaced) and its filtered rows."""
    chunks = (b"IHDR", struct.pack(">IIBBBBB", *head)), (b"IDAT", zlib.compress(data)), (b"IEND", b"")
    packed = [struct.pack(">I", len(b)) + n + b + struct.pack(">I", zlib.crc32(n + b)) for n, b in chunks]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(packed))


def write_interlaced(path, samples):
    """A PNG whose rows come in the seven passes of Adam7 (PNG specification, section 8)."""
    data = b""
    for y, x, down, across in (
        (0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2), (0, 1, 2, 2), (1, 0, 2, 1),
    ):  # fmt: skip
        for line in samples[y::down, x::across] if samples[y::down, x::across].size else ():
            data += b"\0" + line.astype(line.dtype.newbyteorder(">")).tobytes()
    height, width = samples.shape[:2]
    write_png(path, (width, height, 8 * samples.itemsize, 2 if samples.ndim == 3 else 0, 0, 0, 1), data)


@pytest.mark.parametrize("samples", [COLOUR, COLOUR_16, GREY_16, COLOUR[..., 0]])
def test_interlaced_png_keeps_its_samples(tmp_path, samples):
    write_interlaced(tmp_path / "a.png", samples)
    wanted = samples[..., 1] if samples.ndim == 3 else samples
    np.testing.assert_array_equal(decode(tmp_path / "a.png", channel="green"), wanted)
    assert read_header(tmp_path / "a.png").bits == 8 * samples.itemsize


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_png_of_few_bits_spans_the_scale(tmp_path, bits):
    levels = RNG.integers(0, 1 << bits, (20, 32))
    digits = (levels[..., None] >> np.arange(bits)[::-1]) & 1
    rows = np.packbits(digits.reshape(20, -1).astype(np.uint8), axis=1)
    data = b"".join(b"\0" + row.tobytes() for row in rows)
    write_png(tmp_path / "a.png", (32, 20, bits, 0, 0, 0, 0), data)
    np.testing.assert_array_equal(decode(tmp_path / "a.png"), levels * (255 // ((1 << bits) - 1)))
