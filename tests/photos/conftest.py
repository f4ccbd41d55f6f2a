"""Test folders with photographs, written in each case from nothing."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from made import cameras as made_cameras
from ploughval.scene import Scene


@pytest.fixture(scope="session")
def cameras():
    """Cameras known exactly, from the benchmarks' own ray tracing."""
    return made_cameras


@pytest.fixture
def make_scene(tmp_path):
    """A scene of the folder tmp_path with the given [camera] keys."""

    def make(**camera) -> Scene:
        geometry = (
            {}
            if {"control_points", "board", "calibration"} & set(camera)
            else {"mm_per_px": 0.1, "tip_px": [5, 6]}
        )
        return Scene.model_validate(
            {
                "folder": tmp_path,
                "source": tmp_path / "test.toml",
                "test": {"name": "t"},
                "blade": {"depth_mm": 30.0, "width_mm": 200.0},
                "camera": {"photos": "photos/*", **geometry, **camera},
            }
        )

    (tmp_path / "photos").mkdir()
    return make


@pytest.fixture
def write_photos(tmp_path):
    """Grey photographs whose first pixel holds their number, as photos/<name>."""

    def write(names, shape=(24, 32)) -> list[Path]:
        paths = []
        for number, name in enumerate(names):
            image = np.full(shape, 100, np.uint8)
            image[0, 0] = number
            paths.append(tmp_path / "photos" / name)
            Image.fromarray(image).save(paths[-1])
        return paths

    return write
