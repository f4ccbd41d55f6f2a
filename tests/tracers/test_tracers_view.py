"""The grid that the tracers look at: the photograph's own pixels, or a sampling on world axes."""

import numpy as np
import pytest

from ploughval.axes import Direction
from ploughval.errors import CalibrationError
from ploughval.tracers.view import View, moved_back

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


def test_parts_of_a_resampled_picture_are_those_of_the_whole():
    image = np.random.default_rng(4).integers(0, 255, (200, 400), dtype=np.uint8)
    cut = View(image.shape, Turned()).cut(image)
    whole = cut[:, :]
    assert whole.shape == cut.shape
    assert np.array_equal(cut[20:60, 30:90], whole[20:60, 30:90])
    assert np.array_equal(cut[::4, ::3], whole[::4, ::3])


@pytest.mark.parametrize("direction", list(Direction))
def test_a_small_shift_is_told_in_columns_and_rows(stage, direction):
    drawn = stage(direction=direction)
    view = View(drawn.shape, drawn.calibration)
    assert view.offset((0.3, -0.2)) == pytest.approx((0.3 * direction.sign, -0.2), abs=1e-9)


@pytest.mark.parametrize("shift", [(0, 0), (3, -2), (-4, 1)])
def test_a_whole_shift_is_undone(shift):
    """What stood at p + shift comes to p; from outside comes the nearest pixel, or the border's code."""
    image = np.random.default_rng(3).integers(0, 255, (20, 30), dtype=np.uint8)
    y, x = np.mgrid[:20, :30]
    rows, cols = y + shift[1], x + shift[0]
    inside = (rows >= 0) & (rows < 20) & (cols >= 0) & (cols < 30)
    expected = image[np.clip(rows, 0, 19), np.clip(cols, 0, 29)]
    assert np.array_equal(moved_back(image, shift), expected)
    assert np.array_equal(moved_back(image, shift, 99), np.where(inside, expected, 99))


def test_a_view_outside_the_photograph_is_refused(stage):
    drawn = stage()
    with pytest.raises(CalibrationError, match="view_px"):
        View(drawn.shape, drawn.calibration, (510, 0, 900, 100))
