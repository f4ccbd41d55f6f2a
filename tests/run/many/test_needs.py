"""The memory that a test takes, told from what it reads."""

import numpy as np
import pytest
from PIL import Image

from ploughval.limits import PICTURE_PIXELS
from ploughval.run.many.needs import (
    BASE_BYTES,
    BYTES_A_LOG_BYTE,
    BYTES_A_PIXEL,
    MOST_OF_LOGS,
    VIDEO_PIXELS,
    needed_bytes,
)

CAMERA = """
[camera]
photos = "{photos}"
times = {times}
mm_per_px = 0.1
tip_px = [10.0, 10.0]
direction = "right"
"""
CELLS = """
[loadcells]
log = "log.csv"
spacing_mm = 150.0
lower_to_tip_mm = 260.0
rest_s = [0.0, 9.5]
"""


@pytest.fixture
def folder_with(model_settings):
    """Makes a test folder with these tables and files."""

    def make(folder, tables, **files):
        (folder / "test.toml").write_text(model_settings + tables)
        for name, content in files.items():
            (folder / name.replace("_", ".")).write_bytes(content)
        return str(folder)

    return make


def test_a_model_alone_and_what_is_refused_take_the_least(tmp_path, folder_with):
    assert needed_bytes(folder_with(tmp_path, "")) == BASE_BYTES
    assert needed_bytes(str(tmp_path / "not there")) == BASE_BYTES
    assert needed_bytes("s3://bucket/test") == BASE_BYTES


def test_photographs_count_by_their_pixels_and_logs_by_their_bytes(tmp_path, folder_with):
    Image.fromarray(np.zeros((30, 40), np.uint8)).save(tmp_path / "a.png")
    camera = CAMERA.format(photos="*.png", times="{start_s = 0.0, interval_s = 1.0}")
    folder = folder_with(tmp_path, camera + CELLS, log_csv=b"x" * 1000)
    assert needed_bytes(folder) == BASE_BYTES + 1200 * BYTES_A_PIXEL + 1000 * BYTES_A_LOG_BYTE


@pytest.mark.parametrize(
    ("photos", "times", "pixels"),
    [("a.avi", '"video"', VIDEO_PIXELS), ("a.png", "{start_s = 0.0, interval_s = 1.0}", 500)],
)
def test_a_film_counts_as_large_and_an_unknown_header_by_its_bytes(
    tmp_path, photos, times, pixels, folder_with
):
    folder = folder_with(
        tmp_path, CAMERA.format(photos=photos, times=times), **{photos.replace(".", "_"): b"x" * 500}
    )
    assert needed_bytes(folder) == BASE_BYTES + pixels * BYTES_A_PIXEL
    assert pixels < PICTURE_PIXELS


def test_long_logs_take_no_more_than_the_longest_that_are_read(tmp_path, folder_with):
    folder = folder_with(tmp_path, CELLS)
    with (tmp_path / "log.csv").open("wb") as log:
        log.truncate(400 << 20)  # holes take no room on the disk
    assert needed_bytes(folder) == BASE_BYTES + MOST_OF_LOGS
