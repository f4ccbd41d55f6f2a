"""Where points are placed: in the sand ahead of the blade, and along the layers."""

import numpy as np
import pytest

from ploughval.axes import Direction
from ploughval.scene import Piv, Tracers
from ploughval.tracers import place_points

LAYERS = (5.0, 12.5)


def place(drawn, **piv):
    rows, cols = np.mgrid[: drawn.shape[0], : drawn.shape[1]]
    mm = drawn.calibration.to_mm(np.stack([cols, rows], axis=-1))
    sand = (mm[..., 1] < 0) | ((mm[..., 0] > 0) & (mm[..., 1] < 25))
    scene = drawn.scene.model_copy(
        update={"tracers": Tracers(layers_mm=LAYERS), "piv": Piv(subset_px=21, **piv)}
    )
    return place_points(sand, drawn.calibration, scene), sand


@pytest.mark.parametrize("direction", list(Direction))
def test_every_point_is_in_the_sand_ahead_of_the_face(stage, direction):
    drawn = stage(direction=direction)
    points, sand = place(drawn)
    nearest = np.rint(points.px).astype(int)
    assert sand[nearest[:, 1], nearest[:, 0]].all()
    mm = drawn.calibration.to_mm(points.px)
    assert (mm[:, 0] > 0).all()
    assert mm[:, 1].min() < -2.0  # some below the tip's level
    assert mm[:, 1].max() < 25.0


def test_the_subset_of_every_point_is_mostly_sand(stage):
    points, sand = place(stage())
    padded = np.pad(sand.astype(float), 10)
    for x, y in np.rint(points.px).astype(int):
        assert padded[y : y + 21, x : x + 21].mean() >= 0.5


def test_each_layer_has_a_dense_row_of_points_at_its_height(stage):
    drawn = stage()
    points, _ = place(drawn)
    for height in LAYERS:
        row = drawn.calibration.to_mm(points.px[points.layer_mm == height])
        assert row[:, 1] == pytest.approx(height, abs=1e-9)
        assert np.diff(np.sort(row[:, 0])).max() < 5 * drawn.mm_per_px
        assert np.ptp(row[:, 0]) > 85.0


def test_the_grid_has_the_spacing_that_was_asked_for(stage):
    for spacing, expected in ((None, 10.0), (16.0, 16.0)):
        points, _ = place(stage(), spacing_px=spacing)
        columns = np.unique(points.px[np.isnan(points.layer_mm), 0])
        assert np.diff(columns) == pytest.approx(expected)


def test_the_grid_is_coarser_where_sand_stays(stage):
    drawn = stage()
    points, _ = place(drawn, spacing_px=8.0)
    grid = points.px[np.isnan(points.layer_mm)]
    deep = drawn.calibration.to_mm(grid)[:, 1] < -10 * drawn.mm_per_px  # no subset of 21 px reaches the tip
    assert deep.sum() > 20
    for part, spacing in ((grid[deep], 16.0), (grid[~deep], 8.0)):
        assert np.diff(np.unique(part[:, 0])) == pytest.approx(spacing)
        assert np.diff(np.unique(part[:, 1])) == pytest.approx(spacing)
