"""Order of names and order of time are told apart, and copies are not photographs."""

import logging

import numpy as np
import pytest
from PIL import Image

from ploughval.errors import DataError
from ploughval.photos import open_frames
from ploughval.photos.series.copies import is_copy_of, same_files
from ploughval.photos.series.order import by_time, disagreement, kinds_of_names, unroll


def write_jpeg(path, shot, number=0, model="", serial=""):
    tags = Image.Exif()
    if model:
        tags[0x0110] = model
    tags[0x8769] = {0x9003: shot} | ({0xA431: serial} if serial else {})
    picture = np.full((16, 24), 100, np.uint8)
    picture[:8, :8] = 8 * number
    Image.fromarray(picture).save(path, exif=tags, quality=100)


def numbers(series):
    return [round(int(series.read(k)[3, 3]) / 8) for k in range(len(series))]


def test_a_counter_that_begins_anew_is_followed_where_there_are_no_times(make_scene, write_photos):
    write_photos(["DSC_9998.png", "DSC_9999.png", "DSC_0001.png", "DSC_0002.png"])
    series = open_frames(make_scene(times={"start_s": 0, "interval_s": 2}))
    assert [p.name[4:8] for p in series.paths] == ["9998", "9999", "0001", "0002"]
    assert "DSC_9998.png is taken as the first photograph" in series.notes[0]


def test_times_agree_with_a_counter_that_begins_anew(make_scene, tmp_path):
    for number, name in enumerate(["DSC_9998", "DSC_9999", "DSC_0001", "DSC_0002"]):
        write_jpeg(tmp_path / "photos" / f"{name}.jpg", f"2024:05:01 10:00:{2 * number:02d}", number)
    series = open_frames(make_scene(times="exif"))
    assert numbers(series) == [0, 1, 2, 3]
    np.testing.assert_array_equal(series.time_s, [0, 2, 4, 6])
    assert series.notes == ()


def test_a_counter_that_begins_anew_orders_photographs_within_a_second(make_scene, tmp_path):
    names = ["DSC_9997", "DSC_9998", "DSC_9999", "DSC_0001", "DSC_0002", "DSC_0003", "DSC_0004", "DSC_0005"]
    for number, name in enumerate(names):  # two a second by a clock of whole seconds
        write_jpeg(tmp_path / "photos" / f"{name}.jpg", f"2024:05:01 10:00:{number // 2:02d}", number)
    series = open_frames(make_scene(times="exif"))
    assert numbers(series) == list(range(8))
    assert series.faults == {}
    np.testing.assert_allclose(np.diff(series.time_s), 0.5, atol=0.1)


def test_a_counter_that_begins_anew_in_spite_of_the_times_is_said(make_scene, tmp_path):
    for number, name in enumerate(["DSC_0001", "DSC_0002", "DSC_9998", "DSC_9999"]):
        write_jpeg(tmp_path / "photos" / f"{name}.jpg", f"2024:05:01 10:00:{2 * number:02d}", number)
    series = open_frames(make_scene(times="exif"))
    assert numbers(series) == [0, 1, 2, 3]
    assert "photos/DSC_0001.jpg was taken before photos/DSC_9999.jpg" in series.notes[0]


@pytest.mark.parametrize(
    "names",
    [
        ["a1.png", "a9.png"],  # a short counter need not have run over
        ["DSC_0001.png", "DSC_0002.png", "DSC_9997.png"],  # its end was not reached
        ["DSC_0001.png", "IMG_9999.png"],
        [
            "DSC_0001.png",
            "DSC_3000.png",
            "DSC_6000.png",
            "DSC_9999.png",
        ],  # no stretch of more than half without a photograph
        ["one.png", "two.png"],
    ],
)
def test_other_names_are_left_in_their_natural_order(names):
    assert unroll(names) == 0


def test_names_of_two_kinds_are_told_where_there_are_no_times(make_scene, write_photos):
    assert kinds_of_names(["IMG_1.png", "IMG_22.png"]) == []
    write_photos(["IMG_1.png", "IMG_2.png", "DSC_1.png"])
    note = open_frames(make_scene()).notes[0]
    assert "2 as photos/IMG_#.png, 1 as photos/DSC_#.png" in note


def test_two_cameras_in_one_series_are_refused(make_scene, tmp_path):
    for name, serial in (("a", "17"), ("b", "17"), ("c", ""), ("d", "23")):
        write_jpeg(
            tmp_path / "photos" / f"{name}.jpg", "2024:05:01 10:00:00", 0, "D850" if serial else "", serial
        )
    with pytest.raises(
        DataError, match="camera changes within the series: got D850 23; expected D850 17"
    ) as caught:
        open_frames(make_scene())
    assert caught.value.frame == 3


def test_exif_that_contradicts_the_names_is_told_where_an_interval_is_given(make_scene, tmp_path):
    for name, second in (("a", 0), ("b", 4), ("c", 2)):
        write_jpeg(tmp_path / "photos" / f"{name}.jpg", f"2024:05:01 10:00:{second:02d}")
    series = open_frames(make_scene(times={"start_s": 0, "interval_s": 2}))
    assert "by EXIF" in series.notes[0]
    assert "photos/c.jpg was taken before photos/b.jpg" in series.notes[0]
    np.testing.assert_array_equal(series.time_s, [0, 2, 4])


def test_a_copy_is_left_out_by_bytes_and_name(make_scene, write_photos, tmp_path, caplog):
    write_photos(["IMG_1.png", "IMG_2.png", "IMG_3.png"])
    photos = tmp_path / "photos"
    for copy in ("IMG_2 (2).png", "IMG_2 - Copy.png", "IMG_2(1).png"):
        (photos / copy).write_bytes((photos / "IMG_2.png").read_bytes())
    with caplog.at_level(logging.WARNING):
        series = open_frames(make_scene(times={"start_s": 0, "interval_s": 2}))
    assert [p.name for p in series.paths] == ["IMG_1.png", "IMG_2.png", "IMG_3.png"]
    assert sum("a copy of another photograph" in note for note in series.notes) == 3
    assert "IMG_2 (2).png" in caplog.text


def test_a_copy_of_any_name_is_left_out_where_exif_gives_both_one_time(make_scene, tmp_path):
    for number, name in enumerate(["a", "b", "c"]):
        write_jpeg(tmp_path / "photos" / f"{name}.jpg", f"2024:05:01 10:00:{2 * number:02d}", number)
    (tmp_path / "photos" / "best.jpg").write_bytes((tmp_path / "photos" / "b.jpg").read_bytes())
    series = open_frames(make_scene(times="exif"))
    assert numbers(series) == [0, 1, 2]
    assert series.notes == ("a copy of another photograph, left out: best.jpg",)


def test_a_name_like_that_of_a_copy_is_a_photograph_where_its_bytes_differ(make_scene, write_photos):
    write_photos(["IMG_1.png", "IMG_1 (2).png"])
    assert len(open_frames(make_scene())) == 2


def test_equal_photographs_at_rest_are_no_copies(make_scene, write_photos, tmp_path):
    (first,) = write_photos(["a1.png"])
    (tmp_path / "photos" / "a2.png").write_bytes(first.read_bytes())
    assert len(open_frames(make_scene())) == 2
    assert same_files([first, tmp_path / "photos" / "a2.png"]) == [[first, tmp_path / "photos" / "a2.png"]]


def test_a_picture_that_comes_again_later_is_told(make_scene, write_photos, tmp_path):
    paths = write_photos(["a1.png", "a2.png", "a3.png"])
    paths[2].write_bytes(paths[0].read_bytes())
    series = open_frames(make_scene())
    assert len(series) == 3
    assert series.notes == ("the same picture, to the byte, as one further on: a1.png",)


def test_files_that_differ_outside_their_middle_are_told_apart(tmp_path):
    data = np.random.default_rng(1).bytes(300_000)
    for name, change in (("a", b""), ("b", b"x"), ("c", b"")):
        (tmp_path / name).write_bytes(change + data[len(change) :])
    (tmp_path / "d").write_bytes(b"")
    (tmp_path / "e").write_bytes(b"")
    files = [tmp_path / name for name in "abcde"]
    assert same_files(files) == [[files[0], files[2]]]


@pytest.mark.parametrize(
    ("copy", "original", "told"),
    [
        ("a (1).jpg", "a.jpg", True),
        ("a copy 2.jpg", "a.jpg", True),
        ("a - Kopie (3).jpg", "a.jpg", True),
        ("a_copy.jpg", "a.jpg", True),
        ("a1.jpg", "a.jpg", False),
        ("copy.jpg", "a.jpg", False),
    ],
)
def test_names_of_copies_are_known(tmp_path, copy, original, told):
    assert is_copy_of(tmp_path / copy, tmp_path / original) is told


def test_a_clock_that_was_set_back_is_told_from_names_that_are_not_in_order():
    names = list("abcdefgh")
    back = np.array([0, 2, 4, 6, 8 - 3600, 10 - 3600, 12 - 3600, 14 - 3600.0])
    assert "set back by 60 min" in disagreement(back, names)
    assert "set back" not in disagreement(np.array([8, 10, 12, 14, 0, 2, 4, 6.0]), names)


def test_order_of_time_keeps_frames_without_time_beside_their_neighbours():
    np.testing.assert_array_equal(by_time(np.array([5.0, np.nan, 1.0, 9.0])), [2, 1, 0, 3])
    assert disagreement(np.array([1.0, np.nan, 3.0]), ["a", "b", "c"]) == ""
