"""Camera and pattern: settings win over EXIF, EXIF over nothing, and what is missing says how to tell it."""

from types import SimpleNamespace

import numpy as np
import pytest

from ploughval.photos.pattern import texture_of
from ploughval.photos.reading.exif import Shot
from ploughval.run.practice.equipment import camera_rows, pattern_rows, shot_of
from ploughval.run.practice.rows import Source
from ploughval.run.walk.noise import NO_NOISE
from ploughval.run.walk.pattern import NO_TEXTURE, texture_arrays
from ploughval.synth import sand_texture

from .conftest import SCALE, U_MM

SHOT = Shot(
    make="Canon", model="Canon EOS 100D", lens="EF50mm f/1.8", focal_mm=50.0, aperture=8.0, exposure_s=0.02
)


def cameras(scene, found):
    return {row.item: row for row in camera_rows(scene, found)}


def window(**parts):
    camera = np.zeros((len(U_MM), 3))
    return SimpleNamespace(**{"camera": camera, **NO_NOISE, **NO_TEXTURE, **parts})


def test_what_nobody_told_has_no_value_and_a_remedy(make_scene, make_found):
    rows = cameras(make_scene(), make_found())
    for item, key in (
        ("Camera", "make"),
        ("Lens", "lens"),
        ("Focal length", "focal_mm"),
        ("Aperture", "aperture"),
        ("Exposure", "exposure_s"),
        ("Sensitivity", "iso"),
        ("Lens to window", "stand_off_mm"),
        ("Lighting", "lighting"),
        ("Blur by motion during an exposure", "exposure_s"),
    ):
        assert rows[item].source == Source.UNTOLD
        assert key in rows[item].note
        assert np.isnan(rows[item].value)
        assert not rows[item].text


def test_exif_fills_what_the_settings_leave_open(make_scene, make_found, make_frames):
    rows = cameras(make_scene(), make_found(frames=make_frames((SHOT,) * 12)))
    assert (rows["Camera"].text, rows["Camera"].source) == ("Canon EOS 100D", Source.EXIF)
    assert rows["Lens"].text == "EF50mm f/1.8"
    assert (rows["Aperture"].value, rows["Aperture"].source) == (8.0, Source.EXIF)


def test_settings_win_over_exif(make_scene, make_found, make_frames):
    scene = make_scene({"make": "Basler", "model": "acA2440", "lens": "25 mm", "exposure_s": 0.005})
    rows = cameras(scene, make_found(scene, frames=make_frames((SHOT,) * 12)))
    assert (rows["Camera"].text, rows["Camera"].source) == ("Basler acA2440", Source.SETTING)
    assert rows["Lens"].source == Source.SETTING
    assert (rows["Exposure"].value, rows["Exposure"].source) == (0.005, Source.SETTING)
    assert rows["Focal length"].source == Source.EXIF


def test_an_exposure_that_changes_is_said(make_scene, make_found, make_frames):
    shots = tuple(Shot(exposure_s=0.01 if k < 6 else 0.02) for k in range(12))
    assert (
        "changes from 0.01 to 0.02 s"
        in cameras(make_scene(), make_found(frames=make_frames(shots)))["Exposure"].note
    )


def test_blur_is_exposure_times_speed_over_scale(make_scene, make_found):
    scene = make_scene({"exposure_s": 0.05})
    row = cameras(scene, make_found(scene))["Blur by motion during an exposure"]
    assert row.value == pytest.approx(0.05 * 1.0 / SCALE)  # 2 mm every 2 s


def test_field_interval_and_scale_are_those_of_the_photographs(make_scene, make_found):
    scene = make_scene({"mm_per_px_std": 0.001})
    rows = cameras(scene, make_found(scene))
    assert rows["Field of view across"].value == pytest.approx(1200 * SCALE)
    assert rows["Field of view down"].value == pytest.approx(400 * SCALE)
    assert rows["Interval between photographs"].value == pytest.approx(2.0)
    assert rows["Travel between photographs"].value == pytest.approx(2.0)
    assert (rows["Scale"].value, rows["Scale"].std) == (SCALE, pytest.approx(0.001))


def test_a_scale_without_uncertainty_says_so(make_scene, make_found):
    row = cameras(make_scene(), make_found())["Scale"]
    assert np.isnan(row.std)
    assert "mm_per_px_std" in row.note


def test_photographs_without_times_ask_for_them(make_scene, make_found, make_frames):
    found = make_found(frames=make_frames(time_s=np.full(12, np.nan)))
    assert cameras(make_scene(), found)["Interval between photographs"].source == Source.UNTOLD


def test_the_cameras_largest_movement_is_told(make_scene, make_found):
    moved = np.column_stack([np.linspace(0, 3, 12), np.linspace(0, 4, 12), np.full(12, 0.02)])
    rows = cameras(make_scene(), make_found(window=window(camera=moved)))
    row = rows["Movement of the camera, taken off"]
    assert (row.value, row.std) == (pytest.approx(5.0), pytest.approx(0.02))


def grains(diameter_px, shape=(400, 600)):
    picture = sand_texture(np.random.default_rng(1), shape, diameter_px=diameter_px).picture(shape)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def patterns(scene, make_found, image):
    arrays = texture_arrays(image, np.ones(image.shape, bool))
    found = make_found(scene, window=window(**arrays))
    return {row.item: row for row in pattern_rows(scene, found)}


def test_grain_size_is_told_in_px_and_mm_with_grains_across_a_subset(make_scene, make_found):
    rows = patterns(make_scene(), make_found, grains((3.5, 6.0)))
    size = rows["Grain size"]
    assert size.value > 3
    assert rows["Grain size in the sand"].value == pytest.approx(size.value * SCALE)
    assert rows["Grains across a subset"].value == pytest.approx(31 / size.value)
    assert "alias" not in size.note
    assert "set piv.subset_px" not in size.note


def test_grains_finer_than_3_px_and_coarser_than_a_third_of_the_subset_are_warned_of(make_scene, make_found):
    assert "alias" in patterns(make_scene(), make_found, grains((1.5, 2.5)))["Grain size"].note
    coarse = patterns(make_scene(piv={"subset_px": 15}), make_found, grains((7.0, 9.0)))
    least = int(coarse["Grain size"].note.split("piv.subset_px to ")[1].split()[0])
    assert least % 2 == 1
    assert least >= 3 * coarse["Grain size"].value > 15
    assert "fewer than 3" in coarse["Grains across a subset"].note


def test_a_texture_that_is_noise_says_what_to_check(make_scene, make_found):
    noise = np.random.default_rng(0).integers(80, 160, (300, 300), dtype=np.uint8)
    assert texture_of(noise, np.ones(noise.shape, bool)).side_px
    row = patterns(make_scene(), make_found, noise)["Grain size"]
    assert row.source == Source.UNTOLD
    assert "focus" in row.note


def test_pattern_words_are_those_of_the_settings(make_scene, make_found):
    scene = make_scene({"pattern": "one grain in five dyed <b>"})
    row = patterns(scene, make_found, grains((3.5, 6.0)))["Pattern"]
    assert (row.text, row.source) == ("one grain in five dyed <b>", Source.SETTING)


def test_a_series_is_told_by_most_words_and_middle_numbers():
    shots = (Shot(make="A", exposure_s=0.1), Shot(make="B", exposure_s=0.3), Shot(make="B", exposure_s=0.2))
    assert shot_of(shots) == Shot(make="B", exposure_s=0.2)
    assert shot_of(()) == Shot()
