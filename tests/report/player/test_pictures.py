"""The picture of a frame is that frame, in its place, of one light, within the budget."""

import io

import numpy as np
import pytest
from PIL import Image

from ploughval.report.photographs import Photographs
from ploughval.report.player import pictures as module
from ploughval.report.player.pictures import frame_pictures
from ploughval.report.stages import view
from ploughval.results import read_results


def grey_of(pictures, frame):
    return np.asarray(Image.open(io.BytesIO(pictures.data[frame])).convert("L"), dtype=float)


def spot_in(pictures, frame):
    """Centre of the bright spot of a picture, mm."""
    grey = grey_of(pictures, frame)
    x0, x1, y0, y1 = pictures.extent
    bright = np.clip(grey - 160, 0, None)
    rows, columns = np.mgrid[: grey.shape[0], : grey.shape[1]] + 0.5
    x = (bright * columns).sum() / bright.sum() / grey.shape[1] * (x1 - x0) + x0
    y = y1 - (bright * rows).sum() / bright.sum() / grey.shape[0] * (y1 - y0)
    return x, y


def made(folder, frames=range(13)):
    results = read_results(folder)
    photographs = Photographs(results)
    assert not photographs.missing
    return frame_pictures(photographs, list(frames), view(results)), photographs


@pytest.mark.parametrize(
    ("ending", "factor"), [(".png", 1), (".jpg", 1), (".jpg", 4), (".tif", 3), (".jpg", 8), (".jpg", 6)]
)
def test_the_picture_of_a_frame_is_that_frame_in_its_place(make_pictured, spot_place, ending, factor):
    """Reduced reading of large files included; 0.25 mm is half a pixel of the smallest photographs."""
    pictures, _ = made(make_pictured(ending, factor=factor))
    assert sorted(pictures.data) == list(range(13))
    for frame in (0, 4, 9, 12):
        assert spot_in(pictures, frame) == pytest.approx(spot_place(frame), abs=0.25)


def test_all_frames_are_stretched_alike(make_pictured):
    folder = make_pictured()
    photo = folder.parent / "photos" / "f006.png"
    brighter = np.clip(np.asarray(Image.open(photo)).astype(int) + 60, 0, 255).astype(np.uint8)
    Image.fromarray(brighter).save(photo)
    pictures, _ = made(folder)
    levels = [np.median(grey_of(pictures, frame)) for frame in (2, 5, 6, 9)]
    assert levels[0] == pytest.approx(levels[1], abs=2)
    assert levels[0] == pytest.approx(levels[3], abs=2)
    assert levels[2] > levels[0] + 40  # what is brighter looks brighter


def test_no_more_pixels_are_made_than_the_photograph_has(make_pictured):
    pictures, photographs = made(make_pictured())
    x0, x1, _, _ = pictures.extent
    assert pictures.shape[1] <= (x1 - x0) / 0.5 + 1
    assert photographs.native_width((0.0, 100.0, 0.0, 50.0)) == 200


def test_pictures_of_an_unreadable_file_are_left_out_with_the_reason(make_pictured):
    folder = make_pictured()
    (folder.parent / "photos" / "f003.png").write_bytes(b"no longer a photograph")
    pictures, photographs = made(folder)
    assert sorted(set(range(13)) - set(pictures.data)) == [3]
    assert "not a picture" in photographs.unread[3]
    assert str(folder.parent) not in photographs.unread[3]


def test_a_truncated_jpeg_is_left_out_though_it_is_read_at_a_fraction(make_pictured):
    folder = make_pictured(".jpg", factor=8)
    photo = folder.parent / "photos" / "f003.jpg"
    photo.write_bytes(photo.read_bytes()[:3000])
    pictures, photographs = made(folder)
    assert 3 not in pictures.data
    assert photographs.unread[3]


def test_the_budget_holds_for_the_sum_of_all_pictures(make_pictured, monkeypatch):
    folder = make_pictured(factor=2)
    rng = np.random.default_rng(3)
    for photo in (folder.parent / "photos").glob("*.png"):
        shape = np.asarray(Image.open(photo)).shape
        Image.fromarray(rng.integers(0, 255, shape, dtype=np.uint8)).save(photo)
    whole, _ = made(folder)
    for budget in (200_000, 80_000):
        monkeypatch.setattr(module, "PICTURE_BYTES", budget)
        pictures, _ = made(folder)
        assert sum(map(len, pictures.data.values())) <= budget < sum(map(len, whole.data.values()))
        assert len(pictures.data) == 13


def test_the_bytes_do_not_depend_on_the_threads(make_pictured, monkeypatch):
    folder = make_pictured()
    first, _ = made(folder)
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    second, _ = made(folder)
    assert first == second


def test_without_a_readable_photograph_there_are_no_pictures(make_pictured):
    folder = make_pictured()
    results = read_results(folder)
    photographs = Photographs(results)
    for photo in (folder.parent / "photos").glob("*.png"):
        photo.write_bytes(b"gone")
    assert frame_pictures(photographs, list(range(13)), view(results)) is None
    assert frame_pictures(photographs, [], view(results)) is None
