"""Frames of a video are the stored ones, in their order, at their times, and a cut one says so."""

import re

import cv2
import numpy as np
import pytest

from ploughval.errors import DataError
from ploughval.photos import open_frames
from ploughval.photos.reading.decode import decode, read_header
from ploughval.photos.reading.reader import Reader
from ploughval.photos.reading.video import VideoFile

COUNT, HEIGHT, WIDTH = 12, 96, 128
GROUND = cv2.GaussianBlur(np.random.default_rng(5).normal(128, 90, (HEIGHT, WIDTH + COUNT)), (0, 0), 2)
FRAMES = [GROUND[:, k : k + WIDTH].clip(0, 255).astype(np.uint8) for k in range(COUNT)]


def write_video(path, code="FFV1", frames=FRAMES, rate=25.0):
    colour = frames[0].ndim == 3
    fourcc = cv2.VideoWriter_fourcc(*code) if code else 0
    video = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, fourcc, rate, (WIDTH, HEIGHT), colour)
    assert video.isOpened()
    for frame in frames:
        video.write(frame)
    video.release()


def test_a_lossless_video_gives_its_frames_bit_by_bit(tmp_path):
    write_video(tmp_path / "a.mkv")
    header = read_header(tmp_path / "a.mkv")
    assert header.shape == (HEIGHT, WIDTH)
    assert header.pages == tuple(range(COUNT))
    np.testing.assert_allclose(header.page_time_s, np.arange(COUNT) / 25, atol=1e-3)  # Matroska: whole ms
    video = VideoFile(tmp_path / "a.mkv")
    for k in (0, 1, 5, 2, 2, 11):  # on, over some, back, again, to the end
        np.testing.assert_array_equal(video.read(k), FRAMES[k])


@pytest.mark.parametrize("channel", ["red", "blue"])
def test_a_colour_of_a_lossless_video_is_the_stored_one(tmp_path, channel):
    colours = [np.dstack([f, 255 - f, f // 2]) for f in FRAMES[:3]]  # blue, green, red
    write_video(tmp_path / "a.avi", frames=colours)
    expected = FRAMES[2] if channel == "blue" else FRAMES[2] // 2
    np.testing.assert_array_equal(decode(tmp_path / "a.avi", 2, channel=channel), expected)


def test_grey_is_the_stored_luma_to_the_bit(tmp_path):
    path = tmp_path / "a.avi"
    write_video(path, "", [cv2.cvtColor(f, cv2.COLOR_GRAY2BGR) for f in FRAMES[:2]])  # 4:2:0, not packed
    data = path.read_bytes()
    start = data.index(b"movi") + 12  # after the list's name and the chunk's head
    luma = np.frombuffer(data, np.uint8, HEIGHT * WIDTH, start).reshape(HEIGHT, WIDTH)
    np.testing.assert_array_equal(decode(path), luma)


def test_16_bit_grey_keeps_16_bits(tmp_path):
    deep = np.random.default_rng(2).integers(0, 65536, (HEIGHT, WIDTH)).astype(np.uint16)
    options = [cv2.VIDEOWRITER_PROP_DEPTH, cv2.CV_16U, cv2.VIDEOWRITER_PROP_IS_COLOR, 0]
    fourcc = cv2.VideoWriter_fourcc(*"FFV1")
    video = cv2.VideoWriter(str(tmp_path / "a.mkv"), cv2.CAP_FFMPEG, fourcc, 25, (WIDTH, HEIGHT), options)
    video.write(deep)
    video.release()
    assert read_header(tmp_path / "a.mkv").bits == 16
    np.testing.assert_array_equal(decode(tmp_path / "a.mkv"), deep)


def test_a_turn_in_the_metadata_does_not_turn_the_frames(tmp_path):
    path = tmp_path / "a.mp4"
    write_video(path, "mp4v", [cv2.cvtColor(f, cv2.COLOR_GRAY2BGR) for f in FRAMES])
    upright = decode(path, 3)
    data = bytearray(path.read_bytes())
    matrix = (
        data.index(b"tkhd") + 4 + 40
    )  # ISO 14496-12: after version, times, track, duration, layer, volume
    quarter = np.array([0, 0x10000, 0, -0x10000, 0, 0, 0, 0, 0x40000000], ">i4").tobytes()
    assert data[matrix : matrix + 4] == b"\0\1\0\0"
    data[matrix : matrix + 36] = quarter
    path.write_bytes(data)
    turned = cv2.VideoCapture(str(path))
    assert int(turned.get(cv2.CAP_PROP_FRAME_WIDTH)) == HEIGHT  # the metadata are understood
    assert read_header(path).shape == (HEIGHT, WIDTH)
    np.testing.assert_array_equal(decode(path, 3), upright)


def test_times_are_those_of_a_changing_rate(tmp_path):
    path = tmp_path / "a.mkv"
    write_video(path, frames=FRAMES[:4])
    data = bytearray(path.read_bytes())
    for stated, wanted in ((40, 70), (80, 300), (120, 310)):  # times of Matroska's simple blocks, ms
        block = re.search(rb"\xa3[\x40-\x7f].\x81" + re.escape(stated.to_bytes(2)), data, re.DOTALL)
        data[block.end() - 2 : block.end()] = wanted.to_bytes(2)
    path.write_bytes(data)
    np.testing.assert_allclose(read_header(path).page_time_s, [0, 0.07, 0.3, 0.31], atol=1e-9)


def test_a_video_that_is_cut_short_says_how_much_is_left(make_scene, tmp_path):
    path = tmp_path / "photos" / "a.avi"
    write_video(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    series = open_frames(make_scene(times="video"))
    assert 2 <= len(series) < COUNT
    assert f"states {COUNT} frames but holds {len(series)}" in series.notes[0]
    np.testing.assert_array_equal(series.read(1), FRAMES[1])


@pytest.mark.parametrize("kept", [0.0, 0.3])
def test_a_video_without_its_index_is_refused(tmp_path, kept):
    path = tmp_path / "a.mp4"
    write_video(path, "mp4v", [cv2.cvtColor(f, cv2.COLOR_GRAY2BGR) for f in FRAMES])
    path.write_bytes(path.read_bytes()[: int(kept * path.stat().st_size)])
    with pytest.raises(DataError, match=r"a\.mp4: is (not a video|empty)"):
        read_header(path)


def test_a_frame_after_the_end_is_refused(tmp_path):
    write_video(tmp_path / "a.avi")
    with pytest.raises(DataError, match=f"the video ends after {COUNT} frames"):
        Reader().read(tmp_path / "a.avi", COUNT)


def test_a_video_is_a_series_with_its_own_times(make_scene, tmp_path):
    write_video(tmp_path / "photos" / "a.mkv", rate=4.0)
    series = open_frames(make_scene(times="video"))
    assert len(series) == COUNT
    np.testing.assert_allclose(series.time_s, np.arange(COUNT) / 4)
    for k in (0, 7, 3):
        np.testing.assert_array_equal(series.read(k), FRAMES[k])


def test_each_fourth_frame_keeps_its_time(make_scene, tmp_path):
    write_video(tmp_path / "photos" / "a.mkv", rate=4.0)
    series = open_frames(make_scene(times="video", every=4))
    np.testing.assert_allclose(series.time_s, [0, 1, 2])
    np.testing.assert_array_equal(series.read(2), FRAMES[8])


def test_times_of_a_video_are_refused_where_there_is_none_or_more_than_one(
    make_scene, write_photos, tmp_path
):
    write_photos(["a.png", "b.png"])
    with pytest.raises(DataError, match=r'times = "video".*a video or an animated GIF'):
        open_frames(make_scene(times="video"))
    write_video(tmp_path / "photos" / "c.mkv")
    write_video(tmp_path / "photos" / "d.mkv")
    with pytest.raises(DataError, match="2 files"):
        open_frames(make_scene(photos="photos/*.mkv", times="video"))


def test_luma_of_full_range_is_read_without_a_word_on_every_frame(tmp_path, capfd):
    write_video(tmp_path / "a.avi", "MJPG", [cv2.cvtColor(f, cv2.COLOR_GRAY2BGR) for f in FRAMES])
    video = VideoFile(tmp_path / "a.avi")
    read = np.stack([video.read(k) for k in range(COUNT)]).astype(float)
    assert np.abs(read - FRAMES).mean() < 4  # loss of JPEG
    assert capfd.readouterr().err == ""
