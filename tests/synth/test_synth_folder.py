"""Whole folders: accepted by load_scene, the same bytes from the same seed, and a truth that replays."""

import hashlib
from dataclasses import replace

import cv2
import numpy as np
import pytest

from ploughval.axes import BAND_COLUMNS, LAYER_COLUMNS, SURFACE_COLUMNS, Direction
from ploughval.errors import ConfigError, DataError
from ploughval.scene import Scene, Soil, Step, load_scene
from ploughval.synth import SynthOptions, load_truth, make_folder, options_like

pytestmark = pytest.mark.usefixtures("toy_model")

SMALL = SynthOptions(seed=3, displacement_mm=4.0, frames=3, mm_per_px=0.6, rate_hz=20.0)


def contents(folder):
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in folder.rglob("*")
        if p.is_file()
    }


def read(path):
    return cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH)


def test_a_folder_is_accepted_and_asks_for_every_step(tmp_path):
    truth = make_folder(tmp_path / "a", SMALL)
    scene = load_scene(tmp_path / "a")
    assert set(scene.steps) == set(Step)
    assert scene.camera.tip_px == truth.tip_px
    assert scene.blade.depth_mm == 30.0
    assert scene.soil == SMALL.soil
    assert len(scene.matches(scene.camera.photos)) == 3
    assert len(scene.matches("empty/*.csv")) == 3
    assert scene.tracers.dyed_layers_mm == SMALL.layers_mm


def test_the_same_seed_gives_the_same_bytes_and_another_one_other_pixels(tmp_path):
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        make_folder(tmp_path / name, replace(SMALL, seed=seed))
    first, again, other = (contents(tmp_path / name) for name in "abc")
    assert first == again
    assert first["photos/0001.png"] != other["photos/0001.png"]
    assert first["loadcells.csv"] != other["loadcells.csv"]


def test_a_blade_that_travels_left_gives_the_mirror_image(tmp_path):
    right = make_folder(tmp_path / "right", SMALL)
    left = make_folder(tmp_path / "left", replace(SMALL, direction=Direction.LEFT))
    for name in ("0000.png", "0002.png"):
        one, other = read(tmp_path / "right/photos" / name), read(tmp_path / "left/photos" / name)
        assert np.array_equal(one, other[:, ::-1])
    width = one.shape[1]
    assert left.tip_px == pytest.approx((width - 1 - right.tip_px[0], right.tip_px[1]))
    np.testing.assert_allclose(left.blade["x_px"], width - 1 - right.blade["x_px"])
    assert load_scene(tmp_path / "left").camera.direction is Direction.LEFT


def test_the_blade_stands_in_the_photographs_where_the_truth_says(tmp_path):
    truth = make_folder(tmp_path / "a", replace(SMALL, noise_grey=0.0, vignetting=0.0, gradient=0.0))
    for frame, face in zip(truth.blade["frame"], truth.blade["x_px"], strict=True):
        row = read(tmp_path / f"a/photos/{frame:04d}.png")[2].astype(float)  # air, blade, air
        # area under the blade's profile: thickness; its centroid: half of it behind the face
        share = (row - 45.0) / (205.0 - 45.0)
        assert share.sum() == pytest.approx(5.0 / 0.6, abs=0.01)  # rounding to whole greys
        assert (share * np.arange(len(row))).sum() / share.sum() == pytest.approx(face - 2.5 / 0.6, abs=0.01)


def test_truth_is_read_as_it_was_written(tmp_path):
    made = make_folder(tmp_path / "a", SMALL)
    truth = load_truth(tmp_path / "a")
    assert truth.options == SMALL
    assert truth.tip_px == made.tip_px
    assert tuple(truth.bands.columns) == BAND_COLUMNS
    assert tuple(truth.surface.columns) == SURFACE_COLUMNS
    assert tuple(truth.layers.columns) == LAYER_COLUMNS
    points = np.random.default_rng(1).uniform([-30, -5], [120, 30], (500, 2))
    np.testing.assert_array_equal(truth.positions(points), made.positions(points))
    np.testing.assert_allclose(truth.surface, made.surface)
    np.testing.assert_allclose(truth.force, made.force)


def test_truth_needs_no_model(tmp_path, monkeypatch):
    make_folder(tmp_path / "a", SMALL)

    def no_model(scene):
        raise AssertionError("the model was called")

    monkeypatch.setattr("ploughval.model.simulate", no_model, raising=False)
    assert load_truth(tmp_path / "a").positions([[50.0, 28.0]]).shape == (3, 1, 2)


def test_layers_of_the_truth_are_replayed_points(tmp_path):
    truth = make_folder(tmp_path / "a", SMALL)
    first = truth.layers[truth.layers["frame"] == 0]
    assert set(first["layer"]) == set(SMALL.layers_mm)
    assert np.array_equal(first["y_mm"], first["layer"])
    line = first[first["layer"] == 20.0]
    last = truth.layers[(truth.layers["frame"] == 2) & (truth.layers["layer"] == 20.0)]
    replayed = truth.positions(line[["x_mm", "y_mm"]].to_numpy())[2]
    kept = replayed[np.isfinite(replayed[:, 0])]
    found = last[["x_mm", "y_mm"]].dropna().to_numpy()
    np.testing.assert_allclose(found, kept, atol=6e-4)  # written to 1 um


def test_a_folder_that_is_not_empty_is_refused_unless_told_and_made(tmp_path):
    (tmp_path / "note.txt").write_text("mine")
    with pytest.raises(ConfigError, match="not empty"):
        make_folder(tmp_path, SMALL)
    with pytest.raises(ConfigError, match="not made by synth"):
        make_folder(tmp_path, SMALL, overwrite=True)
    (tmp_path / "note.txt").unlink()
    make_folder(tmp_path, SMALL)
    (tmp_path / "note.txt").write_text("mine")
    make_folder(tmp_path, replace(SMALL, frames=2), overwrite=True)
    assert [p.name for p in sorted((tmp_path / "photos").iterdir())] == ["0000.png", "0001.png"]
    assert (tmp_path / "note.txt").read_text() == "mine"
    with pytest.raises(ConfigError, match="a file"):
        make_folder(tmp_path / "note.txt", SMALL, overwrite=True)


def test_16_bit_tiff_and_jpeg_hold_the_same_picture(tmp_path):
    make_folder(tmp_path / "png", SMALL)
    make_folder(tmp_path / "tif", replace(SMALL, image_format="tif", bit_depth=16))
    make_folder(tmp_path / "jpg", replace(SMALL, image_format="jpg"))
    png = read(tmp_path / "png/photos/0001.png")
    deep = read(tmp_path / "tif/photos/0001.tif")
    assert deep.dtype == np.uint16
    assert np.abs(deep / 257.0 - png).max() <= 0.5 + 1 / 257
    jpg = read(tmp_path / "jpg/photos/0001.jpg")
    assert np.abs(jpg.astype(float) - png).std() < 3.0


def test_dark_grains_before_a_pale_wall_are_darker_than_it(tmp_path):
    dark = replace(SMALL, grain_grey=(50.0, 90.0), air_grey=220.0, dyed=False, vignetting=0.0)
    truth = make_folder(tmp_path / "a", dark)
    picture = read(tmp_path / "a/photos/0000.png").astype(float)
    sand = picture[round(truth.tip_px[1]) :]
    # 85 % of the grains have a mean of 70, the others one of 30 (sand_texture)
    assert sand.mean() == pytest.approx(0.85 * 70 + 0.15 * 30, abs=3.0)
    assert picture[:5, -40:].mean() == pytest.approx(220.0, rel=0.02)  # the gradient is 3 %


def test_parts_that_are_not_wanted_are_not_there(tmp_path):
    told = Soil(unit_weight_kN_m3=16.0, peak_friction_deg=45.0, residual_friction_deg=30.0)
    make_folder(tmp_path / "a", replace(SMALL, photographs=False, layers_mm=(), told_soil=told))
    make_folder(tmp_path / "b", replace(SMALL, loadcells=False, dyed=False, clock_told=False))
    forces, pictures = load_scene(tmp_path / "a"), load_scene(tmp_path / "b")
    assert forces.camera is None
    assert forces.tracers is None
    assert forces.soil == told
    assert pictures.loadcells is None
    assert pictures.camera.clock_offset_s == "auto"
    assert pictures.tracers.dyed_layers_mm == ()
    assert not (tmp_path / "b/empty").exists()
    assert not (tmp_path / "a/photos").exists()


def test_the_photographs_clock_is_ahead_by_its_offset(tmp_path):
    make_folder(tmp_path / "a", replace(SMALL, clock_offset_s=2.5))
    times = np.loadtxt(tmp_path / "a/photos.csv", delimiter=",", skiprows=1, usecols=1)
    np.testing.assert_allclose(times, 10.0 + np.array([0.0, 2.0, 4.0]) + 2.5)
    assert load_scene(tmp_path / "a").camera.clock_offset_s == 2.5


def test_impossible_options_are_named_together():
    with pytest.raises(ConfigError) as caught:
        SynthOptions(frames=1, mm_per_px=-0.1, layers_mm=(5.0, 35.0), image_format="jpg", bit_depth=16)
    places = {fault.place for fault in caught.value.faults}
    assert places == {"frames", "mm_per_px", "layers_mm", "bit_depth"}
    with pytest.raises(ConfigError, match="depth_mm"):
        SynthOptions(depth_mm=float("nan"))


def test_a_travel_beyond_the_models_end_is_refused_with_what_it_can_be(tmp_path, monkeypatch, toy_history):
    monkeypatch.setattr("ploughval.model.simulate", lambda scene: toy_history(displacement=2.5))
    with pytest.raises(ConfigError, match=r"displacement_mm: got 4\.0; expected at most 2\.5 mm"):
        make_folder(tmp_path / "a", SMALL)
    assert not (tmp_path / "a").exists()


def test_a_folder_without_truth_says_so(tmp_path):
    with pytest.raises(DataError, match="no truth"):
        load_truth(tmp_path)


@pytest.mark.parametrize(
    ("place", "blade", "model"),
    [
        ("blade.inclination_deg", {"inclination_deg": 5.0}, {}),
        ("model.mechanism", {}, {"mechanism": "two_blocks"}),
        ("model.initial_surface_mm", {}, {"initial_surface_mm": [(0.0, 30.0), (90.0, 40.0)]}),
    ],
)
def test_scenes_that_cannot_be_painted_are_refused(place, blade, model):
    scene = Scene.model_validate(
        {
            "test": {"name": "t"},
            "blade": {"depth_mm": 30.0, "width_mm": 218.0, **blade},
            "soil": SMALL.soil.model_dump(),
            "model": model,
        }
    )
    with pytest.raises(ConfigError) as refused:
        options_like(scene, SMALL)
    assert [fault.place for fault in refused.value.faults] == [place]
