"""A test whose photographs are known: a dot at a place in mm that depends on the frame."""

import json

import numpy as np
import pytest
from PIL import Image

from ploughval.scene import load_scene

SCALE_MM = 0.5
TIP_PX = (30.0, 100.0)
SHAPE = (130, 480)
FRAMES = 13


def spot_mm(frame):
    """Where the bright spot of a frame is."""
    return 20.0 + 10.0 * frame, 12.0 + 2.0 * frame


def spotted(frame, shape=SHAPE, scale_mm=SCALE_MM, tip_px=TIP_PX, radius_mm=6.0):
    """A grey photograph with one bright spot, (H, W) uint8."""
    x_mm, y_mm = spot_mm(frame)
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    away = np.hypot((columns - tip_px[0]) * scale_mm - x_mm, (tip_px[1] - rows) * scale_mm - y_mm)
    return np.where(away < radius_mm, 250, 70).astype(np.uint8)


def save_photographs(folder, ending=".png", *, factor=1, frames=FRAMES):
    """Photographs in ``folder/photos`` and its test.toml; ``factor`` times as many pixels each way."""
    photos = folder / "photos"
    photos.mkdir(parents=True)
    shape = (SHAPE[0] * factor, SHAPE[1] * factor)
    tip = tuple(factor * side + (factor - 1) / 2 for side in TIP_PX)
    for frame in range(frames):
        image = Image.fromarray(spotted(frame, shape, SCALE_MM / factor, tip))
        image.save(photos / f"f{frame:03d}{ending}", **({"quality": 95} if ending == ".jpg" else {}))
    (folder / "test.toml").write_text(
        f'[test]\nname = "d30"\n[blade]\ndepth_mm = 30.0\nwidth_mm = 218.0\n[camera]\n'
        f'photos = "photos/*{ending}"\nmm_per_px = {SCALE_MM / factor}\ntip_px = [{tip[0]}, {tip[1]}]\n'
        "times = {start_s = 10.0, interval_s = 5.0}\n"
    )
    return folder


def matched(results_folder, test_folder):
    """The results as those of the photographs."""
    record = json.loads((results_folder / "run.json").read_text())
    record["folder"], record["settings_hash"] = str(test_folder), load_scene(test_folder).settings_hash
    (results_folder / "run.json").write_text(json.dumps(record))
    return results_folder


@pytest.fixture
def make_pictured(make_results, tmp_path):
    """Writes results with their photographs: ending and size of these can be chosen."""

    def make(ending=".png", *, factor=1, frames=FRAMES, **more):
        folder = save_photographs(tmp_path / "test", ending, factor=factor, frames=frames)
        return matched(make_results(folder / "results", **more), folder)

    return make


@pytest.fixture(scope="session")
def spot_place():
    """Where the bright spot of a frame is, in mm: a function of the frame."""
    return spot_mm
