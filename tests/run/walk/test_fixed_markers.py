"""Fixed markers on the whole way: a camera that creeps or turns leaves the measurements as they are."""

import json
import math
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pandas as pd
import pytest
import xarray as xr

from ploughval import load_scene
from ploughval.photos import calibrate, open_frames
from ploughval.run import process_folder
from ploughval.run.walk.walk import watch
from ploughval.synth import EXAMPLE, load_truth, make_folder

STILL = replace(EXAMPLE, seed=11, frames=10, displacement_mm=12.0, loadcells=False, markers=6, name="marked")
CREEP_PX = (0.07, -0.04)
TURN_DEG = 0.03  # a frame: 0.27 degrees at the end, 1.3 px in the corners


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folders of the same test: camera at rest, creeping, turning."""
    root = tmp_path_factory.mktemp("marked")
    make_folder(root / "still", STILL)
    make_folder(root / "creeping", replace(STILL, camera_creep_px=CREEP_PX))
    shutil.copytree(root / "still", root / "turning")
    for frame, path in enumerate(sorted((root / "turning" / "photos").glob("*.png"))):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        height, width = image.shape
        matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), TURN_DEG * frame, 1.0)
        turned = cv2.warpAffine(
            image, matrix, (width, height), flags=cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REFLECT
        )
        cv2.imwrite(str(path), turned)
    return root


@pytest.fixture(scope="module")
def outcomes(made):
    return {name: process_folder(made / name) for name in ("still", "creeping", "turning")}


def errors_px(made, outcome):
    """Errors of all tracked places against the truth, (F, N, 2) px."""
    with xr.open_dataset(outcome.results / "tracks.nc", engine="h5netcdf") as tracks:
        first = np.column_stack([tracks["x0_mm"], tracks["y0_mm"]])
        found = np.stack([tracks["x_mm"].values, tracks["y_mm"].values], axis=-1)
    return (found - load_truth(made / "still").positions(first)) / STILL.mm_per_px


def notes(outcome):
    frames = json.loads((outcome.results / "run.json").read_text())["frames"]
    return " ".join(text for frame in frames for text in frame["notes"])


@pytest.mark.parametrize(
    ("name", "mean_px", "median_px"),
    [("still", 0.02, 0.1), ("creeping", 0.02, 0.1), ("turning", 0.04, 0.12)],  # turned ones are resampled
)
def test_tracked_points_are_where_the_sand_is(made, outcomes, name, mean_px, median_px):
    error = errors_px(made, outcomes[name])
    assert np.isfinite(error[-1]).mean() > 0.2
    assert np.abs(np.nanmedian(error[-1], axis=0)).max() < mean_px
    assert np.nanmedian(np.linalg.norm(error, axis=-1)) < median_px


@pytest.mark.parametrize("name", ["still", "creeping", "turning"])
def test_the_blade_is_found_to_a_fifth_of_a_pixel(made, outcomes, name):
    blade = pd.read_csv(outcomes[name].results / "blade.csv")
    true = pd.read_csv(made / "still" / "truth" / "blade.csv")
    assert np.sqrt(np.mean((blade["blade_x_mm"] - true["u_mm"]) ** 2)) / STILL.mm_per_px < 0.2


def test_the_surface_is_that_of_a_camera_at_rest(outcomes):
    rest = pd.read_csv(outcomes["still"].results / "surface.csv")
    for name in ("creeping", "turning"):
        seen = pd.read_csv(outcomes[name].results / "surface.csv")
        off = []
        for frame in range(1, STILL.frames):
            a, b = rest[rest["frame"] == frame], seen[seen["frame"] == frame]
            off.append(np.interp(b["x_mm"], a["x_mm"], a["y_mm"]) - b["y_mm"])
        off_px = np.concatenate(off) / STILL.mm_per_px
        assert np.median(np.abs(off_px)) < 0.3


def test_creep_and_turn_are_taken_off_and_said(outcomes):
    assert "fixed markers" not in notes(outcomes["still"])
    assert "by 6 fixed markers the camera has moved" in notes(outcomes["creeping"])
    assert "degrees since the first frame: taken off all places" in notes(outcomes["turning"])
    assert "not taken off" not in notes(outcomes["turning"])


def test_movement_of_the_camera_is_told_to_two_hundredths_of_a_pixel(made):
    scene = load_scene(made / "creeping")
    frames = open_frames(scene)
    record = watch(scene, frames, calibrate(scene, frames))
    true = np.arange(STILL.frames)[:, None] * np.array(CREEP_PX)
    np.testing.assert_allclose(record.camera[:, :2], true, atol=0.02)


def test_no_point_is_placed_on_a_marker(made, outcomes):
    scene = load_scene(made / "creeping")
    with xr.open_dataset(outcomes["creeping"].results / "tracks.nc", engine="h5netcdf") as tracks:
        first = np.column_stack([tracks["x0_mm"], tracks["y0_mm"]])
    frames = open_frames(scene)
    px = calibrate(scene, frames).to_px(first)
    apart = np.linalg.norm(px[:, None] - np.array(scene.camera.markers.fixed_px)[None], axis=-1)
    assert apart.min() > 2 * STILL.marker_radius_px


def test_markers_that_are_not_there_cost_nothing_but_a_note(made, tmp_path):
    shutil.copytree(made / "still", tmp_path / "test", ignore=shutil.ignore_patterns("results"))
    toml = tmp_path / "test" / "test.toml"
    text = toml.read_text()
    start = text.index("fixed_px = [")
    end = text.index("]\n]", start) if "]\n]" in text[start:] else text.index("\n]", start)
    toml.write_text(text[:start] + "fixed_px = [[60.0, 90.0], [90.0, 95.0], [130.0, 92.0]]" + text[end + 2 :])
    outcome = process_folder(tmp_path / "test")
    said = notes(outcome)
    assert "fixed marker 0: nothing round of radius 5 px" in said
    assert outcome.complete


def test_turn_is_seen_as_opposite_to_that_of_the_picture(made):
    scene = load_scene(made / "turning")
    frames = open_frames(scene)
    record = watch(scene, frames, calibrate(scene, frames))
    height, width = frames.shape
    pivot = (np.array(scene.camera.markers.fixed_px)).mean(axis=0) - [(width - 1) / 2, (height - 1) / 2]
    turn = math.radians(TURN_DEG * (STILL.frames - 1))
    # cv2 turns the picture counter-clockwise: what is right of its middle goes up
    expected = np.array([pivot[1], -pivot[0]]) * turn
    np.testing.assert_allclose(record.camera[-1, :2], expected, atol=0.03)
