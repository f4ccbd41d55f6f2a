"""The picture of `ploughval check`: a file of its own, elsewhere than in the test folder."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from ploughval.axes import Region
from ploughval.errors import ConfigError, DataError
from ploughval.photos.calibration.mapping import POINT_COLUMNS
from ploughval.report import write_preview
from ploughval.run.setup.check_photographs import Seen
from ploughval.run.setup.preview import Preview


class Plain:
    mm_per_px = 0.2
    points = pd.DataFrame(np.empty((0, 6)), columns=list(POINT_COLUMNS))

    def to_px(self, mm):
        return np.asarray(mm, float) * [5.0, -5.0] + [40.0, 200.0]


def found(image):
    sand = np.zeros((240, 400), bool)
    sand[80:, 45:] = True
    scene = SimpleNamespace(
        tracers=SimpleNamespace(layers_mm=(5.0, 15.0)),
        camera=SimpleNamespace(tip_px=(40.0, 200.0)),
        box=SimpleNamespace(length_mm=None),
        blade=SimpleNamespace(depth_mm=24.0),
    )
    regions = np.where(sand, Region.SAND, Region.AIR).astype(np.uint8)
    sight = SimpleNamespace(regions=regions, surface_mm=np.array([[0.0, 24.0], [70.0, 24.0]]))
    points = SimpleNamespace(px=np.array([[100.0, 150.0], [120.0, 150.0]]))
    seen = Seen(image=image, calibration=Plain(), sight=sight, points=points)
    return Preview("d30/../x", scene, (), (), None, seen)


@pytest.fixture
def image():
    return np.random.default_rng(1).integers(0, 255, (240, 400), dtype=np.uint8)


def test_picture_is_written_whole_and_the_same_each_time(image, tmp_path):
    first = write_preview(found(image), tmp_path / "a" / "p.png")
    second = write_preview(found(image), tmp_path / "b" / "p.png")
    assert first.read_bytes() == second.read_bytes()
    with Image.open(first) as picture:
        assert picture.width == 1350  # 9 inches at 150 dots
    assert [p.name for p in first.parent.iterdir()] == ["p.png"]


def test_without_a_place_the_picture_goes_to_a_temporary_folder(image, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    path = write_preview(found(image))
    assert path.name == "d30-x.png"
    assert path.parent.parent == tmp_path


def test_other_formats_and_missing_photographs_are_refused(image, tmp_path):
    with pytest.raises(ConfigError, match=r"\.png, \.svg, \.pdf"):
        write_preview(found(image), tmp_path / "p.gif")
    with pytest.raises(DataError, match="no photograph"):
        write_preview(found(None), tmp_path / "p.png")
