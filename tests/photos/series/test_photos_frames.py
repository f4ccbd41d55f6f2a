"""A series of photographs is ordered by time, of one size, and one bad file costs one frame."""

import logging
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ploughval.errors import ConfigError, DataError
from ploughval.photos import open_frames
from ploughval.scene import Scene


def numbers(series):
    return [int(series.read(k)[0, 0]) for k in range(len(series))]


def test_names_are_ordered_as_numbers_where_times_are_unknown(make_scene, write_photos):
    write_photos(["img9.png", "img10.png", "img100.png", "img2.png"])
    series = open_frames(make_scene())
    assert series.name(0) == "img2.png"
    assert [p.name for p in series.paths] == ["img2.png", "img9.png", "img10.png", "img100.png"]
    assert numbers(series) == [3, 0, 1, 2]
    assert np.isnan(series.time_s).all()
    assert series.shape == (24, 32)
    assert len(series) == 4


def test_frames_are_numbered_by_time_and_the_other_order_is_told(make_scene, write_photos, tmp_path, caplog):
    write_photos(["a.png", "b.png", "c.png"])
    (tmp_path / "t.csv").write_text("file,time_s\na.png,5\nb.png,9\nc.png,7\n")
    with caplog.at_level(logging.WARNING):
        series = open_frames(make_scene(times="t.csv"))
    np.testing.assert_array_equal(series.time_s, [5, 7, 9])
    assert numbers(series) == [0, 2, 1]
    assert "photos/c.png was taken before photos/b.png" in series.notes[0]
    assert series.notes[0] in caplog.text


def test_one_bad_file_costs_one_frame_and_keeps_its_place_and_time(make_scene, write_photos, tmp_path):
    paths = write_photos(["a.png", "b.png", "c.png", "d.png"])
    paths[1].write_text("not a picture")
    paths[2].write_bytes(b"")
    paths[3].write_bytes(paths[3].read_bytes()[:-40])
    series = open_frames(make_scene(times={"start_s": 0, "interval_s": 2}))
    np.testing.assert_array_equal(series.time_s, [0, 2, 4, 6])
    assert set(series.faults) == {1, 2}
    assert series.read(0)[0, 0] == 0
    for frame, text in ((1, "not a picture"), (2, "0 bytes"), (3, "truncated")):
        with pytest.raises(DataError, match=text) as caught:
            series.read(frame)
        assert caught.value.frame == frame
        assert caught.value.path == str(paths[frame])
        assert str(caught.value).count(str(paths[frame])) == 1


def test_a_frame_without_time_keeps_its_place_between_its_neighbours(make_scene, write_photos, tmp_path):
    write_photos(["a.png", "b.png", "c.png"])
    (tmp_path / "t.csv").write_text("file,time_s\na.png,5\nc.png,7\n")
    series = open_frames(make_scene(times="t.csv"))
    assert [p.name for p in series.paths] == ["a.png", "b.png", "c.png"]
    assert "no row" in series.faults[1]
    with pytest.raises(DataError, match="no row"):
        series.read(1)


def test_a_change_of_size_is_refused_by_frame(make_scene, write_photos):
    write_photos(["a.png", "b.png"])
    (changed,) = write_photos(["c.png"], shape=(32, 24))
    with pytest.raises(DataError, match="got 24 x 32 px; expected 32 x 24 px") as caught:
        open_frames(make_scene())
    assert caught.value.frame == 2
    assert caught.value.path == str(changed)


def test_a_change_of_orientation_is_refused_by_frame(make_scene, write_photos, tmp_path):
    write_photos(["a.jpg"])
    exif = Image.Exif()
    exif[0x0112] = 8
    Image.new("L", (32, 24)).save(tmp_path / "photos" / "b.jpg", exif=exif)
    with pytest.raises(DataError, match=r"orientation changes.*got 8; expected 1") as caught:
        open_frames(make_scene())
    assert caught.value.frame == 1


def test_a_change_of_depth_is_refused_by_frame(make_scene, write_photos, tmp_path):
    write_photos(["a.tif"])
    Image.fromarray(np.zeros((24, 32), np.uint16)).save(tmp_path / "photos" / "b.tif")
    with pytest.raises(DataError, match="got 16; expected 8"):
        open_frames(make_scene())


def test_a_gif_counts_as_its_frames(make_scene, tmp_path):
    frames = [Image.fromarray(np.full((20, 30), 10 * k, np.uint8)) for k in range(3)]
    frames[0].save(tmp_path / "photos" / "a.gif", save_all=True, append_images=frames[1:])
    series = open_frames(make_scene(times={"start_s": 1, "interval_s": 0.5}))
    assert numbers(series) == [0, 10, 20]
    assert series.name(2) == "a.gif, picture 2"
    np.testing.assert_allclose(series.time_s, [1, 1.5, 2])


def test_files_that_are_no_photographs_are_left_out_and_told(make_scene, write_photos, tmp_path):
    write_photos(["a.png"])
    (tmp_path / "photos" / "Thumbs.db").write_bytes(b"x")
    (tmp_path / "photos" / "._a.png").write_bytes(b"\0\5\x16\7")
    series = open_frames(make_scene())
    assert len(series) == 1
    assert "Thumbs.db" in series.notes[0]


def test_a_series_that_holds_nothing_is_refused(make_scene, tmp_path):
    with pytest.raises(DataError, match="no photograph matches"):
        open_frames(make_scene())
    (tmp_path / "photos" / "a.heic").write_bytes(b"x")
    with pytest.raises(DataError, match=r"files of other kinds do \(\.heic\): convert them"):
        open_frames(make_scene())
    (tmp_path / "photos" / "a.png").write_bytes(b"")
    with pytest.raises(DataError, match="none of 1 photographs can be read"):
        open_frames(make_scene())


def test_a_frame_outside_the_series_is_refused(make_scene, write_photos):
    write_photos(["a.png"])
    for frame in (-1, 1):
        with pytest.raises(DataError, match="holds 0 to 0"):
            open_frames(make_scene()).read(frame)


@pytest.mark.parametrize("view", [[0, 0, 33, 24], [5, 5, 5, 9], [-1, 0, 10, 10]])
def test_a_view_outside_the_picture_is_refused(make_scene, write_photos, view):
    write_photos(["a.png"])
    with pytest.raises(ConfigError, match=r"camera\.view_px"):
        open_frames(make_scene(view_px=view))


def test_a_view_does_not_crop(make_scene, write_photos):
    write_photos(["a.png"])
    series = open_frames(make_scene(view_px=[2, 3, 32, 24]))
    assert series.read(0).shape == series.shape == (24, 32)


def test_the_channel_of_the_scene_is_read(make_scene, tmp_path):
    colour = np.random.default_rng(3).integers(0, 256, (24, 32, 3)).astype(np.uint8)
    Image.fromarray(colour).save(tmp_path / "photos" / "a.png")
    np.testing.assert_array_equal(open_frames(make_scene(channel="green")).read(0), colour[..., 1])


def test_a_scene_without_camera_is_refused(tmp_path):
    scene = Scene.model_validate(
        {
            "test": {"name": "t"},
            "blade": {"depth_mm": 1, "width_mm": 1},
            "loadcells": {"log": "l.csv", "spacing_mm": 1, "lower_to_tip_mm": 1},
        }
    )
    with pytest.raises(ConfigError, match="camera"):
        open_frames(scene)


def test_each_third_photograph_keeps_its_time_and_number_by_name(make_scene, write_photos):
    write_photos([f"img{k}.png" for k in range(11)])
    series = open_frames(make_scene(times={"start_s": 5, "interval_s": 2}, every=3))
    assert numbers(series) == [0, 3, 6, 9]
    np.testing.assert_array_equal(series.time_s, [5, 11, 17, 23])


def test_standard_uncertainties_go_with_their_frames(make_scene, write_photos, tmp_path):
    write_photos(["a.png", "b.png", "c.png"])
    (tmp_path / "t.csv").write_text("file,time_s\na.png,5\nc.png,4\n")
    series = open_frames(make_scene(times="t.csv"))
    assert [p.name for p in series.paths] == ["c.png", "b.png", "a.png"]
    np.testing.assert_array_equal(series.time_std_s, [0, np.nan, 0])
    assert np.isnan(open_frames(make_scene()).time_std_s).all()


def test_photographs_read_at_once_by_several_threads_are_the_same(make_scene, tmp_path):
    pictures = [Image.fromarray(np.full((20, 30), 7 * k, np.uint8)) for k in range(20)]
    pictures[0].save(tmp_path / "photos" / "a.gif", save_all=True, append_images=pictures[1:])
    series = open_frames(make_scene())
    wanted = np.random.default_rng(0).permutation(np.tile(np.arange(20), 4))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda k: int(series.read(k)[3, 3]), wanted))
    np.testing.assert_array_equal(found, 7 * wanted)


def shared_photos():
    root = Path(os.environ.get("PLOUGHVAL_SHARED", Path(__file__).parents[4] / "shared"))
    return root / "realdata" / "exif_phone_sand"


@pytest.mark.skipif(not shared_photos().is_dir(), reason="the shared photographs are not here")
def test_telephone_photographs_are_635_205_and_334_s_apart():
    scene = Scene.model_validate(
        {
            "folder": shared_photos(),
            "test": {"name": "t"},
            "blade": {"depth_mm": 1, "width_mm": 1},
            "camera": {"photos": "*.jpg", "times": "exif", "mm_per_px": 1, "tip_px": [0, 0]},
        }
    )
    series = open_frames(scene)
    np.testing.assert_allclose(series.time_std_s, 1 / np.sqrt(12))  # whole seconds
    assert [p.name for p in series.paths] == ["rpm000.jpg", "rpm150.jpg", "rpm175.jpg", "rpm225.jpg"]
    np.testing.assert_array_equal(np.diff(series.time_s), [635, 205, 334])
    assert series.shape == (2592, 1456)
    assert series.read(3).shape == (2592, 1456)
