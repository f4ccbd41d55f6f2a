"""The page shows where control points were missed and how the scale differs across the photograph."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from ploughval.photos import calibrate
from ploughval.photos.calibration.file import read_calibration
from ploughval.report.calibration import maps
from ploughval.report.figures import residual_figure, scale_figure
from ploughval.report.page import single_page
from ploughval.results import read_results
from ploughval.run.findings import Findings
from ploughval.run.finish import finish
from ploughval.run.kept.store import Store
from ploughval.run.results import write_results
from ploughval.scene import Scene

FRAMES = SimpleNamespace(shape=(900, 1400))
# 4 px/mm at the origin, 8 % of perspective along 250 mm
WORLD_TO_PX = np.array([[4.0, 0.14, 250.0], [0.15, -4.1, 700.0], [2.5e-4, 1.5e-4, 1.0]])


def projected(mm):
    mapped = np.column_stack([mm, np.ones(len(mm))]) @ WORLD_TO_PX.T
    return mapped[:, :2] / mapped[:, 2:]


@pytest.fixture
def scene(tmp_path):
    mm = np.stack(np.meshgrid(np.linspace(-20, 220, 5), np.linspace(-10, 120, 4)), -1).reshape(-1, 2)
    px = projected(mm) + np.random.default_rng(3).normal(0, 0.2, mm.shape)
    return Scene.model_validate(
        {
            "folder": tmp_path,
            "source": tmp_path / "test.toml",
            "test": {"name": "points"},
            "blade": {"depth_mm": 30.0, "width_mm": 200.0},
            "camera": {"photos": "photos/*", "control_points": np.hstack([px, mm]).tolist()},
        }
    )


def page_of(scene, tmp_path):
    found = Findings(calibration=calibrate(scene, FRAMES))
    write_results(scene, found, tmp_path / "results")
    finish(scene, found, Store(tmp_path / "results"), None)
    return single_page(read_results(tmp_path / "results")), found.calibration


def chapter(page):
    return re.search(r'<section[^>]*id="calibration".*?</section>', page, re.S)[0]


def test_control_points_have_a_chapter_with_two_figures_and_their_table(scene, tmp_path):
    page, found = page_of(scene, tmp_path)
    text = chapter(page)
    assert text.count("<svg") == 2
    assert "20 control points" in text
    assert "Points of the calibration" in text
    assert f"{found.residual_px:.2g}"[:4] in text


def test_the_result_folder_holds_the_calibration_for_other_tests(scene, tmp_path):
    found = page_of(scene, tmp_path)[1]
    again = read_calibration(tmp_path / "results" / "calibration.json", FRAMES.shape)
    px = np.random.default_rng(1).uniform(0, 900, (40, 2))
    assert np.array_equal(again.to_mm(px), found.to_mm(px))
    assert np.array_equal(again.std_mm(px), found.std_mm(px))


def test_a_plain_scale_has_a_short_table_only(scene, tmp_path):
    camera = scene.camera.model_copy(
        update={"control_points": None, "mm_per_px": 0.25, "tip_px": (250.0, 700.0)}
    )
    text = chapter(page_of(scene.model_copy(update={"camera": camera}), tmp_path)[0])
    assert "<svg" not in text
    assert "scale and tip" in text
    assert "0.25" in text
    assert "not given" in text  # how well the scale is known: nobody said
    assert "Residual" not in text


def test_the_map_of_the_scale_is_that_of_the_projection(scene):
    found = calibrate(scene, FRAMES)
    scale, std = maps(found)
    # local scale of a homography: |det H|^-1/2 w^3/2, w being the denominator at the place (written out here)
    x, y = np.meshgrid(scale.x_px, scale.y_px)
    mm = np.column_stack([x.ravel(), y.ravel(), np.ones(x.size)]) @ np.linalg.inv(WORLD_TO_PX).T
    mm = mm[:, :2] / mm[:, 2:]
    w = 1 + mm @ WORLD_TO_PX[2, :2]
    expected = 1000 * (w**1.5 - 1)
    # readings of 0.2 px leave 0.6 per mille in the corners
    np.testing.assert_allclose(scale.values.ravel(), expected, atol=3.0)
    assert np.ptp(expected) > 80
    assert std.values.min() < 0.5 * std.values.max() < 0.5


def test_arrows_point_from_the_reading_to_the_camera(scene):
    found = calibrate(scene, FRAMES)
    at = found.points[["px_x", "px_y"]].to_numpy()
    off = found.points[["residual_x_px", "residual_y_px"]].to_numpy()
    figure = residual_figure(at, off, FRAMES.shape, [250.0, 700.0])
    quiver = figure.axes[0].collections[0]
    arrows = np.column_stack([quiver.U, quiver.V])
    factor = arrows[0, 0] / off[0, 0]
    np.testing.assert_allclose(arrows, factor * off, rtol=1e-9)
    assert f"{factor:,g} times enlarged" in figure.legends[0].get_texts()[-1].get_text()
    mapped = found.to_px(found.points[["x_mm", "y_mm"]].to_numpy())
    np.testing.assert_allclose(mapped - at, off, atol=1e-9)


def test_a_scale_that_is_the_same_everywhere_is_said_to_be(scene):
    flat = maps(calibrate(scene, FRAMES))[0]
    same = type(flat)(flat.x_px, flat.y_px, np.zeros_like(flat.values))
    figure = scale_figure(same, flat, np.empty((0, 2)), FRAMES.shape, [0.0, 0.0])
    assert "the same everywhere" in [text.get_text() for text in figure.axes[0].texts]
