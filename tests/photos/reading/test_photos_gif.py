"""Pictures of an animated GIF are composed and timed as it says."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from ploughval.photos import open_frames
from ploughval.photos.reading.decode import decode, read_header
from ploughval.photos.reading.reader import Reader

HEIGHT, WIDTH = 24, 36
REAL = Path(os.environ.get("PLOUGHVAL_SHARED", Path(__file__).parents[4] / "shared"))
REAL = REAL / "realdata" / "sandbox_wall_push" / "AM_sun2017.gif"


def block(size, column):
    picture = np.full(size, 40, np.uint8)
    picture[5:15, column : column + 8] = 200
    return picture


def test_durations_are_times(tmp_path):
    pictures = [Image.fromarray(block((HEIGHT, WIDTH), 2 * k)) for k in range(4)]
    pictures[0].save(
        tmp_path / "a.gif", save_all=True, append_images=pictures[1:], duration=[100, 50, 300, 70]
    )
    assert read_header(tmp_path / "a.gif").page_time_s == pytest.approx((0, 0.1, 0.15, 0.45), abs=1e-12)


def test_a_picture_that_stays_longer_is_a_gap(make_scene, tmp_path):
    pictures = [Image.fromarray(block((HEIGHT, WIDTH), 2 * k)) for k in range(10)]
    durations = [100] * 4 + [300] + [100] * 5
    pictures[0].save(
        tmp_path / "photos" / "a.gif", save_all=True, append_images=pictures[1:], duration=durations
    )
    (note,) = open_frames(make_scene(times="video")).notes
    assert "0.3 s pass from photos/a.gif, picture 4 to photos/a.gif, picture 5, 0.1 s are usual" in note


def test_a_gif_without_durations_has_no_times(tmp_path):
    pictures = [Image.fromarray(block((HEIGHT, WIDTH), 2 * k)) for k in range(3)]
    pictures[0].save(tmp_path / "a.gif", save_all=True, append_images=pictures[1:])
    assert read_header(tmp_path / "a.gif").page_time_s == ()


@pytest.mark.parametrize("disposal", [0, 1, 2])
def test_pictures_are_drawn_upon_those_before_them(tmp_path, disposal):
    expected = [block((HEIGHT, WIDTH), 2 * k) for k in range(5)]
    pictures = [Image.fromarray(p) for p in expected]
    pictures[0].save(tmp_path / "a.gif", save_all=True, append_images=pictures[1:], disposal=disposal)
    reader = Reader()
    for k in (0, 1, 4, 2, 3):
        np.testing.assert_array_equal(reader.read(tmp_path / "a.gif", k), expected[k])
        np.testing.assert_array_equal(decode(tmp_path / "a.gif", k), expected[k])


@pytest.mark.skipif(not REAL.is_file(), reason="the shared animation is not here")
def test_a_real_animation_is_what_another_decoder_makes_of_it(make_scene, tmp_path):
    (tmp_path / "photos" / "a.gif").write_bytes(REAL.read_bytes())
    series = open_frames(make_scene(times="video"))
    other = cv2.VideoCapture(str(REAL), cv2.CAP_FFMPEG)  # FFmpeg's own
    np.testing.assert_allclose(series.time_s, 0.5 * np.arange(18), atol=1e-9)
    for k in range(len(series)):
        read, colours = other.read()
        assert read
        grey = cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY)
        assert np.abs(series.read(k).astype(int) - grey).max() <= 1
