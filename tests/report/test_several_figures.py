"""Figures of several tests: what is drawn is what was found."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from ploughval.compare.several import Record, Value, depth_trends, group_tests, mean_errors, repeats_of
from ploughval.compare.several.groups import DEPTH
from ploughval.compare.several.histories import MeanHistory
from ploughval.report.figures.several import (
    envelope_figure,
    errors_figure,
    power_figure,
    scatter_figure,
    trends_figure,
)

FORCES_N = {20.0: (3.4, 3.5), 30.0: (7.6, 7.9), 60.0: (30.5, 31.1)}


@pytest.fixture(scope="module")
def records():
    settings = {"soil": {"unit_weight_kN_m3": 16.0}}
    return [
        Record(
            f"d{depth:g}",
            {"blade": {"depth_mm": depth, "width_mm": 200.0}, **settings},
            {"first_peak_N": Value("N", force, 0.02 * force, 1.01 * force, 0.1, 0.01 * force, 0.3, True)},
        )
        for depth, forces in FORCES_N.items()
        for force in forces
    ]


@pytest.fixture(scope="module")
def trend(records):
    (series,) = group_tests(records).along(DEPTH)
    return depth_trends(series, records)[0]


def line(axes, label):
    return next(item for item in axes.lines if item.get_label() == label)


def test_scatter_is_drawn_in_per_cent_of_the_mean(records):
    repeats = repeats_of(group_tests(records).groups[0], records)
    axes = scatter_figure(repeats).axes[0]
    dots = next(item for item in axes.lines if item.get_marker() == "o")
    np.testing.assert_allclose(dots.get_xdata(), [-100 * 0.05 / 3.45, 100 * 0.05 / 3.45])
    (stated,) = [bar for bar in axes.patches if bar.get_width() > 0]
    assert stated.get_width() == pytest.approx(200 * repeats[0].pooled.stated_std / 3.45)


def test_values_beyond_the_edge_stand_at_it(records):
    wild = [
        Record(r.name, r.settings, {"a_N": Value("N", v, 1.0)})
        for r, v in zip(records, (1.0, 9.0), strict=False)
    ]
    axes = scatter_figure(repeats_of(group_tests(wild).groups[0], wild)).axes[0]
    edges = [
        item.get_xdata()[0] for item in axes.lines if item.get_marker() in "<>" and len(item.get_xdata())
    ]
    assert sorted(edges) == [-50.0, 50.0]


def test_trends_draw_scaled_values_and_the_line_of_the_table(trend):
    axes = trends_figure([trend]).axes[0]
    scale = 16e-6 * np.array([20, 20, 30, 30, 60, 60]) ** 2 * 200 / 2
    forces = np.concatenate(list(FORCES_N.values()))
    np.testing.assert_allclose(line(axes, "predicted").get_ydata(), 1.01 * forces / scale)
    fitted = next(item for item in axes.lines if item.get_linestyle() == "-" and len(item.get_xdata()) == 30)
    np.testing.assert_allclose(fitted.get_ydata(), trend.measured.at(np.log(fitted.get_xdata())))


def test_power_figure_draws_both_powers_through_the_middle(trend):
    axes = power_figure(trend).axes[0]
    fitted = next(
        item
        for item in axes.lines
        if str(item.get_label()).startswith("power 1.") or "power 2.0" in str(item.get_label())
    )
    slope = np.polyfit(np.log(fitted.get_xdata()), np.log(fitted.get_ydata()), 1)[0]
    assert slope == pytest.approx(trend.power.slope)
    expected = line(axes, "power 2")
    assert np.polyfit(np.log(expected.get_xdata()), np.log(expected.get_ydata()), 1)[0] == pytest.approx(2.0)


def test_envelope_is_mean_and_standard_deviation_and_a_panel_more_where_aligned():
    u = np.linspace(0, 2, 21)
    forces = np.array([u, u + 0.2, u + 0.4])
    history = MeanHistory(
        (0, 1, 2), "γd²B/2", u, forces, forces.mean(axis=0), forces.std(axis=0, ddof=1), 0 * u + 0.1,
        None, None, None, np.empty((3, 0)), (0, 0, 0), (),
    )  # fmt: skip
    figure = envelope_figure(history)
    assert len(figure.axes) == 1
    np.testing.assert_allclose(line(figure.axes[0], "mean").get_ydata(), u + 0.2)
    edge = figure.axes[0].collections[0].get_paths()[0].vertices[:, 1]
    assert (edge.min(), edge.max()) == pytest.approx((0.0, 2.4))


def test_mean_errors_stand_in_validation_uncertainties(records):
    errors = mean_errors(range(6), records)
    figure = errors_figure(errors)
    assert isinstance(figure, Figure)
    mean = next(item for item in figure.axes[0].lines if item.get_marker() == "D" and len(item.get_xdata()))
    size = np.sqrt(np.mean(np.square(errors[0].validation_stds)))
    assert mean.get_xdata()[0] == pytest.approx(errors[0].pooled.pooled / size)
