"""The chapter on mobilised friction says what its files hold."""

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.mobilised.curve import CURVE_COLUMNS
from ploughval.compare.softening.table import SOFTENING_COLUMNS
from ploughval.report.blocks import Pen
from ploughval.report.friction import friction_chapter
from ploughval.results import read_results


@pytest.fixture
def folder(own_folder):
    """A result folder with the curves of one band and what was read from them."""
    slip = np.linspace(0.0, 4.0, 41)
    curve = pd.DataFrame(0.0, index=range(41), columns=list(CURVE_COLUMNS))
    curve = curve.assign(band=1, u_mm=slip / 1.1, slip_mm=slip, phi_deg=50 - 18 * np.minimum(slip, 1))
    curve = curve.assign(phi_std_deg=0.5, fresh_deg=0.03, force_zero_deg=-0.4, outcrop_deg=0.3)
    curve = curve.assign(weight_N=5.0, force_N=10.0)  # smooth blade: F^2 / (F^2 + W^2) = 0.8
    curve.to_csv(own_folder / "mobilised_curve.csv", index=False)
    unknown = [np.nan] * 4
    one = ["0", 49.5, 0.4, 48.7, 50.3, *unknown, *unknown, 3.0, 0.01, 90, 1.0, 1.0, "linear"]
    peak, residual, length = (49.75, 0.3, 49.2, 50.3), (31.5, 0.2, 31.1, 31.9), (1.05, 0.04, 0.97, 1.13)
    together = ["all", *peak, *residual, *length, np.nan, np.nan, 180, 1.0, 1.0, "exponential"]
    rows = [[*one, "residual not determined"], [*together, ""]]
    pd.DataFrame(rows, columns=list(SOFTENING_COLUMNS)).to_csv(own_folder / "softening.csv", index=False)
    return own_folder


def texts(table):
    return [[cell.text for cell in row] for row in table.rows]


def test_softening_is_told_by_band_and_for_all_with_what_is_not_determined(folder):
    chapter = friction_chapter(read_results(folder), Pen())
    one, together = texts(chapter.tables[0])
    assert one[0] == "band 0"
    assert one[1:3] == ["49.50 ± 0.40", "48.70 to 50.30"]
    assert one[-1] == "residual not determined"
    assert together[0] == "all bands together"
    assert together[5:7] == ["1.050 ± 0.040", "0.9700 to 1.130"]
    assert "exponential" in together[-1]
    assert "falls from 49.8 to 31.5 degrees over 1.05 mm" in str(chapter.drawings[0].svg)


def test_budget_names_the_sources_that_count_largest_first(folder):
    budget = friction_chapter(read_results(folder), Pen()).tables[1]
    assert [row[0] for row in texts(budget)] == [
        "zeros and friction of the force",
        "place of the outcrop",
        "noise of the force, and the way between photographs",
        "all of them",
    ]
    assert [row[2].value for row in budget.rows] == pytest.approx([0.4, 0.3, 0.03, 0.5])


def test_notes_name_what_was_taken_as_exact_and_what_wall_friction_would_change(folder):
    exact, wall = friction_chapter(read_results(folder), Pen()).notes
    assert "unit weight" in exact
    assert "place of the outcrop" not in exact
    assert "0.80 to 0.80 degrees" in wall


def test_chapter_stands_on_the_photographs_alone_where_there_is_no_curve(own_folder):
    chapter = friction_chapter(read_results(own_folder), Pen())
    assert len(chapter.drawings) == 1
    assert [table.caption for table in chapter.tables] == ["Mobilised friction, every photograph"]


def test_bands_without_any_note_have_an_empty_one(folder):
    path = folder / "softening.csv"
    pd.read_csv(path).iloc[1:].to_csv(path, index=False)
    (only,) = texts(friction_chapter(read_results(folder), Pen()).tables[0])
    assert only[-1] == "an exponential fall describes the curve better"
