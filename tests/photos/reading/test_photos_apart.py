"""A decoder in a process of its own may break: what it read is refused, and the run goes on."""

import cv2
import numpy as np
import pytest

from ploughval.errors import DataError
from ploughval.photos.reading import apart
from ploughval.photos.reading.decode import decode

DEEP = np.random.default_rng(2).integers(0, 65536, (64, 80, 3)).astype(np.uint16)


@pytest.fixture
def picture(tmp_path):
    path = tmp_path / "a picture's place.jp2"
    cv2.imwrite(str(path), DEEP, [cv2.IMWRITE_JPEG2000_COMPRESSION_X1000, 1000])
    return path


@pytest.fixture
def program(tmp_path, monkeypatch):
    """What stands in the place of the decoder's program."""

    def put(text):
        path = tmp_path / "program.py"
        path.write_text(text)
        monkeypatch.setattr(apart, "_PROGRAM", str(path))

    return put


def test_samples_come_whole_through_the_pipe(picture, monkeypatch):
    monkeypatch.setattr(apart, "_PART_BYTES", 1000)
    np.testing.assert_array_equal(apart.decode_apart(picture), DEEP)


def test_a_picture_of_one_sample_is_a_plane(tmp_path):
    cv2.imwrite(str(tmp_path / "a.jp2"), DEEP[..., 0], [cv2.IMWRITE_JPEG2000_COMPRESSION_X1000, 1000])
    np.testing.assert_array_equal(apart.decode_apart(tmp_path / "a.jp2"), DEEP[..., 0])


def test_a_decoder_that_breaks_costs_its_picture_alone(picture, program):
    program("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    with pytest.raises(
        DataError, match=r"cannot be decoded: damaged: its decoder broke off \(signal 11\)"
    ) as e:
        decode(picture)
    assert e.value.path == str(picture)


@pytest.mark.parametrize("said", ["", "64 80 3 2\nfew", "64 80\n"])
def test_too_few_samples_are_refused(picture, program, said):
    program(f"print({said!r}, end='')\n")
    with pytest.raises(DataError, match="truncated or damaged"):
        decode(picture)


@pytest.mark.parametrize(
    "ended", ["import sys\nsys.exit(4)\n", "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)\n"]
)
def test_a_decoder_without_memory_or_killed_is_no_fault_of_the_picture(picture, program, ended):
    program(ended)
    with pytest.raises(MemoryError):
        apart.decode_apart(picture)


def test_what_the_decoder_refuses_is_refused_without_a_word_of_its_own(picture, capfd):
    picture.write_bytes(picture.read_bytes()[:5000])
    with pytest.raises(DataError, match="truncated or damaged"):
        decode(picture)
    assert capfd.readouterr() == ("", "")
