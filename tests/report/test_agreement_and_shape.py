"""Pictures of agreement by topic and of the force's shape hold the numbers that they are given."""

import xml.etree.ElementTree as ET

import matplotlib.colors as colors
import numpy as np
import pandas as pd
import pytest

from ploughval.report import figures
from ploughval.report.blocks import Pen
from ploughval.report.figures.style import MEASURED, MODEL, to_svg
from ploughval.report.verdict import by_topic, named, parts, topic
from ploughval.results import MetricEntry

U = np.array([0.0, 1.0, 38.0, 39.0, 60.0])
F = np.array([10.0, 5.0, 18.0, 8.0, 12.0])


def entry(**values):
    return MetricEntry(**{"unit": "N", "error": 1.0, "validation_std": 2.0, **values})


def test_each_side_is_drawn_over_its_own_initial_force():
    force = pd.DataFrame({"u_mm": U, "force_N": F * 1.1})
    model = pd.DataFrame({"u_mm": U, "force_N": F})
    envelope = pd.DataFrame({"u_mm": U, "low_N": F - 1, "high_N": F + 2})
    peaks = pd.DataFrame({"source": ["model"], "kind": ["peak"], "u_mm": [38.0], "force_N": [18.0]})
    pairs = pd.DataFrame(
        {
            "u_mm_experiment": [36.0],
            "force_N_experiment": [19.8],
            "u_mm_model": [38.0],
            "force_N_model": [18.0],
        }
    )
    figure = figures.shape_figure(
        force, model, (11.0, 10.0), depth_mm=30.0, peaks=peaks, envelope=envelope, pairs=pairs
    )
    axes = figure.axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    np.testing.assert_allclose(lines["measured"].get_ydata(), F / 10)
    np.testing.assert_allclose(lines["predicted"].get_ydata(), F / 10)
    np.testing.assert_allclose(lines["measured"].get_xdata(), U / 30)
    edges = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert (edges.min(), edges.max()) == pytest.approx((0.4, 2.0))
    joined = [line for line in axes.lines if len(line.get_xdata()) == 2 and line.get_linestyle() == "-"]
    np.testing.assert_allclose(joined[0].get_xdata(), [1.2, 38 / 30])
    np.testing.assert_allclose(joined[0].get_ydata(), [1.8, 1.8])


def test_bars_of_a_validation_uncertainty_are_its_shares_and_fill_one():
    shares = [(0.5, 0.3, 0.2), (0.1, 0.9, 0.0)]
    figure = figures.agreement_figure(["near", "far"], [1.5, -3.0], shares)
    errors, beside = figure.axes
    widths = np.array([[bar.get_width() for bar in group] for group in beside.containers]).T
    np.testing.assert_allclose(widths, shares)
    shown = {
        colors.to_hex(line.get_color()): line.get_xdata().tolist()
        for line in errors.lines
        if len(line.get_xdata()) == 1
    }
    assert shown == {MEASURED: [1.5], MODEL: [-3.0]}


def test_parts_are_squares_over_their_sum_and_unknown_where_one_is():
    assert parts(entry(experiment_std=3.0, input_std=4.0, numerical_std=0.0)) == pytest.approx(
        (0.36, 0.64, 0.0)
    )
    assert parts(entry(experiment_std=3.0, input_std=4.0)) is None
    assert parts(entry(experiment_std=0.0, input_std=0.0, numerical_std=0.0)) is None


def test_metrics_stand_by_topic_with_their_units():
    names = ["mound_crest_mm", "band_start_mean_mm", "first_switch_P0", "layers_rms_mm", "mobilised_peak_deg"]
    assert [topic(name) for name in names] == ["Free surface", "Shear bands", "Force", "Layers", "Friction"]
    assert next(iter(by_topic({name: entry() for name in names}))) == "first_switch_P0"
    assert named("first_switch_P0", entry(unit="P0")) == "First switch, P₀"
    assert named("area_validation_percent", entry(unit="%")) == "Area validation, %"
    assert named("switches_per_depth", entry(unit="1/d")) == "Switches, 1/d"


def test_every_topic_has_its_own_picture_and_alternative_text():
    from ploughval.report.verdict import agreement_drawings

    std = {"experiment_std": 1.0, "input_std": 1.0, "numerical_std": 0.0}
    metrics = {"first_peak_N": entry(error=9.0, **std), "layers_rms_mm": entry(**std)}
    drawings = agreement_drawings(metrics, Pen())
    assert [drawing.caption.split(":")[0] for drawing in drawings] == ["Force", "Layers"]
    assert "Outside two of them: First peak, N" in drawings[0].caption
    assert "All are within two" in drawings[1].caption
    assert all('aria-label="' in drawing.svg for drawing in drawings)


@pytest.mark.parametrize("name", [r"$\frac{$", "$x$ & <b>", r"\$a$", "_hidden", "two\nlines", "a$"])
def test_names_of_metrics_are_drawn_letter_by_letter(name):
    text = to_svg(figures.agreement_figure([name, "Force, N"], [0.5, -1.0]), "f1", "")
    drawn = "".join(ET.fromstring(text).itertext()).replace("\u200b", "")
    assert name.replace("\n", " ") in drawn
