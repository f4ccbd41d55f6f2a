"""The chapter on the fitted soil is there when its files are, and says what is open."""

import json

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError
from ploughval.report import write_report
from ploughval.report.blocks import Pen
from ploughval.report.figures import landscape_figure, profiles_figure, soil_fit_figure
from ploughval.report.soil_fit import soil_fit_chapter
from ploughval.report.text import MISSING
from ploughval.results import read_results

NAMES = ("peak_friction_deg", "residual_friction_deg", "mobilization_length_mm")


def curve():
    u = np.linspace(0.0, 30.0, 40)
    table = {"u_mm": u, "force_N": 5.0 + 0.1 * u, "noise_std_N": 0.1, "model_N": 5.05 + 0.1 * u}
    return pd.DataFrame(table)


def profiles():
    rows = []
    for name, best in zip(NAMES, (50.0, 32.0, 1.0), strict=True):
        offsets = np.linspace(-0.1, 0.1, 5)
        rows += [{"parameter": name, "value": best * (1 + o), "rise": 400.0 * o**2} for o in offsets]
    return pd.DataFrame(rows)


def landscape():
    x, y = np.meshgrid(np.linspace(45.0, 55.0, 5), np.linspace(28.0, 36.0, 4))
    rise = (x - 50.0) ** 2 + (y - 32.0) ** 2
    rise[0, 0] = np.nan
    name = "peak_friction_deg x residual_friction_deg"
    return pd.DataFrame({"map": name, "x": x.ravel(), "y": y.ravel(), "rise": rise.ravel()})


def written(folder, **changed):
    limits = dict(zip(NAMES, ([48.0, 52.5], [31.0, 33.0], [None, 3.0]), strict=True))
    best = dict(zip(NAMES, (50.0, 32.0, 1.0), strict=True))
    parameters = {
        name: {
            "value": best[name],
            "interval_68": [0.99 * best[name], 1.01 * best[name]],
            "interval_95": limits[name],
            "told_by": "first rise",
        }
        for name in NAMES
    }
    fit = {
        "parameters": parameters,
        "message": "mobilization_length_mm is not bounded below within the range searched",
        "switches": [{"switch": 1, "record_u_mm": 20.0, "model_u_mm": 19.0, "stretch": 0.0526}],
        "shifts": {"offset_N": {"shift": 0.1, "std": 0.2}},
        "information": {"first rise": {name: {"share": 0.4, "widening": 2.0} for name in NAMES}},
        "discrepancy": {"travel": 0.03, "force": 0.01},
        "rises": {"68": 1.0, "95": 3.9},
        "residual_rms_N": 0.05,
        "points": 40,
        "independent_points": 12.0,
        **changed,
    }
    (folder / "run.json").write_text(json.dumps({"test": "fitted"}))
    (folder / "fit.json").write_text(json.dumps(fit))
    for name, table in (("force", curve()), ("profiles", profiles()), ("landscape", landscape())):
        table.to_csv(folder / f"fit_{name}.csv", index=False)
    return folder


def test_the_chapter_shows_intervals_remarks_and_three_figures(tmp_path):
    page = write_report(written(tmp_path)).read_text()
    assert "Soil from the force" in page
    assert "48 to 52.5" in page
    assert "open to 3" in page
    assert "not bounded below" in page
    assert "12 of them independent" in page
    assert page.count('role="img"') == 3
    order = [
        page.index(text) for text in ("Peak friction, °", "Residual friction, °", "Mobilization length, mm")
    ]
    assert order == sorted(order)


def test_without_a_fit_there_is_no_chapter(tmp_path):
    written(tmp_path)
    (tmp_path / "fit.json").unlink()
    assert "Soil from the force" not in write_report(tmp_path).read_text()


def test_a_fit_without_its_tables_still_has_its_intervals(tmp_path):
    written(tmp_path)
    for name in ("force", "profiles", "landscape"):
        (tmp_path / f"fit_{name}.csv").unlink()
    page = write_report(tmp_path).read_text()
    assert "48 to 52.5" in page
    assert page.count('role="img"') == 0


def test_a_damaged_fit_is_refused_with_its_place(tmp_path):
    written(tmp_path, parameters={"peak_friction_deg": {"value": "much"}})
    with pytest.raises(DataError, match="peak_friction_deg"):
        write_report(tmp_path)


def test_figures_carry_what_they_were_given():
    figure = soil_fit_figure(curve(), np.array([20.0]))
    above, below = figure.axes
    assert above.lines[0].get_ydata() == pytest.approx(curve()["force_N"])
    assert below.lines[0].get_ydata() == pytest.approx(np.full(40, -0.5))  # (measured - model) / noise
    panels = profiles_figure(profiles(), {"95 %": 3.84}).axes
    assert [axes.get_xlabel() for axes in panels] == [
        "Peak friction, °",
        "Residual friction, °",
        "Mobilization length, mm",
    ]
    # the root of the rise is straight between the points: at half way to the ends of a parabola it is on it
    line = panels[0].lines[0]
    assert np.interp(52.5, line.get_xdata(), line.get_ydata()) == pytest.approx(400.0 * 0.05**2, rel=0.02)
    image = landscape_figure(landscape(), {"peak_friction_deg": 50.0, "residual_friction_deg": 32.0}).axes[0]
    shown = image.collections[0].get_array()
    assert np.ma.is_masked(np.ma.masked_invalid(shown).ravel()[0])
    assert float(np.nanmin(np.asarray(shown))) == pytest.approx(np.log10(1.0 + 16 / 9), rel=1e-6)


def test_a_fit_that_states_no_intervals_has_dashes_and_no_word_on_trust(own_folder):
    record = {"parameters": {"peak_friction_deg": {"value": 44.0}}, "message": ""}
    (own_folder / "fit.json").write_text(json.dumps(record))
    chapter = soil_fit_chapter(read_results(own_folder), Pen())
    (table,) = chapter.tables
    assert [cell.text for cell in table.rows[0][2:4]] == [MISSING, MISSING]
    assert table.footnotes == ()
