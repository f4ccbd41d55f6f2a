"""JPEG 2000: the samples are those that OpenCV decodes, whichever decoder is asked."""

import io

import cv2
import numpy as np
import pytest
from PIL import Image

from ploughval.errors import DataError
from ploughval.photos.reading.decode import decode
from ploughval.photos.reading.jpeg2000 import bits_of, decode_jpeg2000

RNG = np.random.default_rng(12)
SMOOTH = cv2.GaussianBlur(RNG.integers(0, 65536, (70, 90, 4)).astype(np.uint16), (0, 0), 2.0)


def by_opencv(path):
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    return image[..., 2::-1] if image.ndim == 3 else image


@pytest.mark.parametrize("kept", [1000, 60], ids=["lossless", "lossy"])
@pytest.mark.parametrize("samples", [1, 3, 4])
@pytest.mark.parametrize("bits", [8, 16])
def test_samples_are_those_of_opencv(tmp_path, bits, samples, kept):
    path = tmp_path / "a.jp2"
    stored = (SMOOTH[..., :samples] >> (16 - bits)).astype(np.uint8 if bits == 8 else np.uint16)
    cv2.imwrite(str(path), stored, [cv2.IMWRITE_JPEG2000_COMPRESSION_X1000, kept])
    found = decode_jpeg2000(path)
    assert (bits_of(path), found.dtype) == (bits, stored.dtype)
    np.testing.assert_array_equal(found, by_opencv(path))


@pytest.mark.parametrize(
    "options",
    [{"irreversible": True}, {"tile_size": (50, 40)}, {"no_jp2": True}],
    ids=lambda o: next(iter(o)),
)
@pytest.mark.parametrize("mode", ["L", "RGB", "I;16"])
def test_kinds_of_files_are_those_of_opencv(tmp_path, mode, options):
    path = tmp_path / "a.jp2"
    stored = {"L": SMOOTH[..., 0] >> 8, "RGB": SMOOTH[..., :3] >> 8, "I;16": SMOOTH[..., 0]}[mode]
    stored = np.ascontiguousarray(stored if mode == "I;16" else stored.astype(np.uint8))
    Image.fromarray(stored).save(path, "JPEG2000", **options)
    np.testing.assert_array_equal(decode_jpeg2000(path), by_opencv(path))


def told(depth):
    """A picture of 16 bits that says another depth: in its box and in its marker."""
    buffer = io.BytesIO()
    Image.fromarray(SMOOTH[..., 0] >> 17 - depth).save(buffer, "JPEG2000")
    data = bytearray(buffer.getvalue())
    data[data.index(b"ihdr") + 14] = data[data.index(b"\xff\x51") + 40] = depth - 1
    return bytes(data)


@pytest.mark.parametrize("depth", [9, 10, 12, 14])
def test_depths_between_keep_their_levels(tmp_path, depth):
    path = tmp_path / "a.jp2"
    path.write_bytes(told(depth))
    found = decode_jpeg2000(path)
    assert found.dtype == np.uint16
    assert int(found.max()) < 1 << depth
    np.testing.assert_array_equal(found, by_opencv(path))


@pytest.mark.parametrize("channels", [1, 3])
def test_a_file_that_is_cut_off_is_refused(tmp_path, channels):
    path = tmp_path / "a.jp2"
    cv2.imwrite(str(path), np.ascontiguousarray(SMOOTH[..., :channels]))
    data = path.read_bytes()
    for part in (0.4, 0.8, 0.99):
        path.write_bytes(data[: int(part * len(data))])
        with pytest.raises(DataError, match="cannot be decoded"):
            decode(path)
