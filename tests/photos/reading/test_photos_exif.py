"""Camera, lens and exposure from EXIF: what is written is read, what is damaged or unknown is absent."""

import numpy as np
import pytest
from PIL import Image
from PIL.TiffImagePlugin import IFDRational

from ploughval.photos import open_frames
from ploughval.photos.reading.decode import read_header
from ploughval.photos.reading.exif import Shot
from ploughval.scene import Scene

GREY = np.random.default_rng(0).integers(0, 255, (24, 32), dtype=np.uint8)
FULL = {
    0x829A: IFDRational(1, 250),
    0x829D: IFDRational(56, 10),
    0x8827: 200,
    0x920A: IFDRational(50, 1),
    0xA434: "EF50mm f/1.8 STM",
}


def save(path, main, inner):
    exif = Image.Exif()
    for tag, value in main.items():
        exif[tag] = value
    exif[0x8769] = inner
    Image.fromarray(GREY).save(path, exif=exif, quality=95)
    return path


@pytest.mark.parametrize("ending", ["jpg", "png"])
def test_camera_lens_and_exposure_are_read(tmp_path, ending):
    path = save(tmp_path / f"a.{ending}", {0x010F: "Canon", 0x0110: "Canon EOS 100D"}, FULL)
    assert read_header(path).tags.shot == Shot(
        make="Canon",
        model="Canon EOS 100D",
        lens="EF50mm f/1.8 STM",
        focal_mm=50.0,
        aperture=5.6,
        exposure_s=0.004,
        iso=200.0,
    )


def test_a_picture_without_tags_tells_nothing(tmp_path):
    path = tmp_path / "a.png"
    Image.fromarray(GREY).save(path)
    assert read_header(path).tags.shot == Shot()


def test_maker_of_a_lens_stands_before_its_name_once(tmp_path):
    apart = save(tmp_path / "a.jpg", {}, {0xA433: "Nikon", 0xA434: "60 mm f/2.8"})
    named = save(tmp_path / "b.jpg", {}, {0xA433: "Nikon", 0xA434: "Nikon 60 mm f/2.8"})
    assert read_header(apart).tags.shot.lens == read_header(named).tags.shot.lens == "Nikon 60 mm f/2.8"


def test_unknown_values_of_zero_over_zero_are_absent(tmp_path):
    nothing = {0x829A: IFDRational(0, 0), 0x829D: IFDRational(0, 1), 0x920A: IFDRational(0, 0)}
    assert read_header(save(tmp_path / "a.jpg", {}, nothing)).tags.shot == Shot()


def test_what_does_not_print_is_left_out_of_names(tmp_path):
    path = save(tmp_path / "a.jpg", {0x010F: "A\tB\x07C\0 rest", 0x0110: " <b>&"}, {})
    shot = read_header(path).tags.shot
    assert (shot.make, shot.model) == ("A B C", "<b>&")


def test_a_series_holds_the_tags_of_its_frames_in_order_of_time(tmp_path):
    (tmp_path / "p").mkdir()
    save(tmp_path / "p" / "a.jpg", {}, {0x829A: IFDRational(1, 100)})
    save(tmp_path / "p" / "b.jpg", {}, {0x829A: IFDRational(1, 50)})
    (tmp_path / "times.csv").write_text("file,time_s\np/a.jpg,5\np/b.jpg,1\n")
    scene = Scene.model_validate(
        {
            "test": {"name": "t"},
            "blade": {"depth_mm": 1.0, "width_mm": 1.0},
            "camera": {"photos": "p/*.jpg", "times": "times.csv", "mm_per_px": 1.0, "tip_px": [0.0, 0.0]},
            "folder": tmp_path,
        }
    )
    frames = open_frames(scene)
    assert [shot.exposure_s for shot in frames.shots] == [0.02, 0.01]
    assert frames.bits == 8
