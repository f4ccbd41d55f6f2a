"""The figure of the cells' calibration draws its tables, and its text says what it shows."""

import numpy as np
import pandas as pd
import pytest

from ploughval.report.figures.cell_calibration import cell_calibration_alt, cell_calibration_figure


@pytest.fixture
def tables():
    moment = np.array([0.0, 5.0, 10.0, 5.0, 0.0, 0.0, 5.0, 10.0, 5.0, 0.0])
    residual = np.array([0.01, -0.02, 0.0, 0.02, -0.01, 0.0, 0.01, 3.0, -0.01, 0.0])
    points = pd.DataFrame(
        {
            "file": ["a.csv"] * 5 + ["b.csv"] * 5,
            "row": [0, 1, 2, 3, 4] * 2,
            "run": "1",
            "direction": ["up", "up", "up", "down", "down"] * 2,
            "moment_upper_Nm": moment,
            "moment_lower_Nm": 0.6 * moment,
            "residual_upper_Nm": residual,
            "residual_lower_Nm": 0.5 * residual,
            "used": np.arange(10) != 7,
        }
    )
    rows = [
        ("standard error", "upper", 0.012),
        ("standard error", "lower", 0.006),
        ("lower limit", "upper", 2.0),
    ]
    return points, pd.DataFrame(rows, columns=["quantity", "cell", "value"])


def drawn(axes, marker):
    lines = [line for line in axes.lines if line.get_marker() == marker and len(line.get_xdata())]
    return sorted((x, y) for line in lines for x, y in zip(*line.get_data(), strict=True))


def test_points_stand_where_the_table_has_them_by_direction(tables):
    points, _ = tables
    for axes, cell in zip(cell_calibration_figure(*tables).axes, ("upper", "lower"), strict=True):
        for marker, direction in (("^", "up"), ("v", "down")):
            part = points[(points["direction"] == direction) & points["used"]]
            expected = sorted(zip(part[f"moment_{cell}_Nm"], part[f"residual_{cell}_Nm"], strict=True))
            np.testing.assert_allclose(drawn(axes, marker), expected)


def test_a_point_left_out_stands_inside_the_panel_with_its_value(tables):
    axes = cell_calibration_figure(*tables).axes[0]
    ((x, y),) = drawn(axes, "x")
    assert x == 10.0
    assert y < axes.get_ylim()[1] < 0.1
    assert [text.get_text() for text in axes.texts] == ["row 2: +3"]


def test_the_dashed_lines_are_two_standard_errors(tables):
    axes = cell_calibration_figure(*tables).axes[0]
    levels = [line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--"]
    assert levels == [-0.024, 0.024]


def test_the_text_tells_the_largest_residual_of_the_points_used(tables):
    text = cell_calibration_alt(*tables)
    assert "9 points in 2 runs" in text
    assert "upper cell: residuals within 0.02 N m (0.2 % of full scale), standard error 0.012 N m" in text
    assert "1 point left out" in text


def test_points_without_residual_and_without_scatter_are_drawn_all_the_same(tables):
    points, quality = tables
    points.loc[0, ["residual_upper_Nm", "residual_lower_Nm"]] = np.nan
    points.loc[0, "used"] = False
    points[["residual_upper_Nm", "residual_lower_Nm"]] *= 0.0
    figure = cell_calibration_figure(points, quality.iloc[:0])
    assert len(drawn(figure.axes[0], "^")) == 4
