"""The grid that the tracers look at: the photograph's own pixels, or a sampling on world axes."""

import numpy as np
import pytest

from ploughval.axes import Direction
from ploughval.errors import CalibrationError
from ploughval.tracers.view import View

MATRIX = np.array(
    [[4.9, 0.3, 40.2], [0.2, -5.1, 150.7], [1e-4, 2e-4, 1.0]]
)  # px from mm: turned, in perspective


class Turned:
    """A homography, written down."""

    mm_per_px = 0.2

    def to_px(self, mm):
        return _project(MATRIX, mm)

    def to_mm(self, px):
        return _project(np.linalg.inv(MATRIX), px)


def _project(matrix, points):
    homogeneous = np.concatenate([points, np.ones((*np.shape(points)[:-1], 1))], axis=-1) @ matrix.T
    return homogeneous[..., :2] / homogeneous[..., 2:]


@pytest.mark.parametrize("direction", list(Direction))
def test_with_a_plain_scale_the_grid_is_the_pixels_themselves(stage, direction):
    drawn = stage(direction=direction)
    image = np.random.default_rng(1).integers(0, 65535, drawn.shape, dtype=np.uint16)
    view = View(drawn.shape, drawn.calibration, (10, 20, 400, 220))
    part = image[20:220, 10:400]
    cut = view.cut(image)
    assert np.array_equal(cut, part if direction is Direction.RIGHT else part[:, ::-1])
    row, col = 37, 51
    px = drawn.calibration.to_px([view.x_mm(float(col)), view.y_mm(float(row))])
    assert image[tuple(np.rint(px[::-1]).astype(int))] == cut[row, col]
    assert view.column(view.x_mm(12.5)) == pytest.approx(12.5)
    assert view.row(view.y_mm(7.25)) == pytest.approx(7.25)


@pytest.mark.parametrize("direction", list(Direction))
def test_a_mask_goes_back_to_the_pixels_it_came_from(stage, direction):
    drawn = stage(direction=direction)
    image = np.random.default_rng(2).integers(0, 255, drawn.shape, dtype=np.uint8)
    view = View(drawn.shape, drawn.calibration, (10, 20, 400, 220))
    whole = view.uncut((view.cut(image) > 128).astype(np.uint8), 7)
    assert np.array_equal(whole[20:220, 10:400], image[20:220, 10:400] > 128)
    whole[20:220, 10:400] = 7
    assert (whole == 7).all()  # the code of what lies outside


def test_in_perspective_the_grid_lies_along_the_world_axes():
    """Grey that grows with world x and y is seen as a plane; bilinear sampling is exact to rounding."""
    calibration = Turned()
    cols, rows = np.meshgrid(np.arange(400.0), np.arange(200.0))
    mm = calibration.to_mm(np.stack([cols, rows], axis=-1))
    image = np.rint(20000 + 200 * mm[..., 0] + 300 * mm[..., 1]).astype(np.uint16)
    view = View(image.shape, calibration)
    cut = view.cut(image)[:, :]
    x, y = np.meshgrid(np.arange(100, 300), np.arange(60, 140))
    expected = 20000 + 200 * view.x_mm(x.astype(float)) + 300 * view.y_mm(y.astype(float))
    # remap works in 1/32 px: 300 grey/mm * 0.2 mm/px / 32 and rounding of the file
    assert np.abs(cut[60:140, 100:300].astype(float) - expected).max() < 3.0
    mask = view.uncut((cut > 22000).astype(np.uint8), 0).astype(bool)
    assert np.mean(mask == (image > 22000)) > 0.995


def test_a_view_outside_the_photograph_is_refused(stage):
    drawn = stage()
    with pytest.raises(CalibrationError, match="view_px"):
        View(drawn.shape, drawn.calibration, (510, 0, 900, 100))
