"""The chapter of good practice: values with units, dashes with remedies, ratios, and text that stays text."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import PRACTICE_COLUMNS
from ploughval.errors import DataError
from ploughval.report.good_practice import good_practice_chapter
from ploughval.report.page import single_page
from ploughval.results import read_results

NAN = np.nan
ROWS = [
    ("camera and photographs", "Camera", NAN, NAN, "", "<b>Canon</b>", "exif", NAN, ""),
    ("camera and photographs", "Lens", NAN, NAN, "", "", "not told", NAN, "Add lens to [camera]."),
    ("camera and photographs", "Aperture", 8.0, NAN, "f-number", "", "setting", NAN, ""),
    ("camera and photographs", "Exposure", 0.004, NAN, "s", "", "exif", NAN, ""),
    ("pattern", "Grain size", 3.7323, 0.05, "px", "", "measured", NAN, "width at half its height"),
    ("noise floors", "Displacement upwards", 0.0012, 0.0002, "mm", "", "measured", 0.0016, "-0.2 px"),
    ("noise floors", "Inclination of a band", 0.9, 0.1, "degree", "", "measured", 0.3, "reports/a.csv"),
    ("noise floors", "Line of action", NAN, NAN, "mm", "", "predicted", 0.68, "at rest there is none"),
]


@pytest.fixture
def results(result_folder):
    return read_results(result_folder)


def chapter(results, rows=ROWS):
    return good_practice_chapter(replace(results, practice=pd.DataFrame(rows, columns=PRACTICE_COLUMNS)))


def row_of(found, item):
    return next(row for table in found.tables for row in table.rows if row[0].text == item)


def test_values_carry_their_unit_and_uncertainty(results):
    found = chapter(results)
    assert [cell.text for cell in row_of(found, "Grain size")[1:3]] == ["3.732 ± 0.050", "px"]
    assert [cell.text for cell in row_of(found, "Aperture")[1:3]] == ["8", "f-number"]
    assert [cell.text for cell in row_of(found, "Exposure")[1:3]] == ["0.004", "s, 1/250"]
    band = row_of(found, "Inclination of a band")
    assert [cell.text for cell in band[1:4]] == ["0.90 ± 0.10", "0.30", "°"]


def test_full_numbers_stand_behind_the_text(results):
    cell = row_of(chapter(results), "Grain size")[1]
    assert (cell.value, cell.std) == (3.7323, 0.05)


def test_what_is_not_told_is_a_dash_with_its_remedy_and_is_counted(results):
    found = chapter(results)
    lens = row_of(found, "Lens")
    assert [cell.text for cell in lens] == ["Lens", "–", "", "not told", "Add lens to [camera]."]
    assert any("One value is not known" in note for note in found.notes)


def test_measured_noise_stands_over_what_was_predicted(results):
    found = chapter(results)
    assert row_of(found, "Displacement upwards")[4].text == "0.75"
    assert row_of(found, "Displacement upwards")[4].mark == ""
    assert row_of(found, "Inclination of a band")[4].mark == "differs"
    assert [cell.text for cell in row_of(found, "Line of action")[1:5]] == ["–", "0.68", "mm", "–"]


def test_remarks_begin_with_a_capital_unless_they_name_a_file(results):
    found = chapter(results)
    assert row_of(found, "Grain size")[4].text == "Width at half its height"
    assert row_of(found, "Inclination of a band")[5].text == "reports/a.csv"
    assert row_of(found, "Displacement upwards")[5].text == "−0.2 px"


def test_results_without_the_table_have_no_chapter(results):
    assert good_practice_chapter(results) is None
    assert chapter(results, []) is None


def test_a_test_without_photographs_is_not_asked_for_a_report_on_correlation(results):
    assert "image correlation" in chapter(results).lead
    found = chapter(results, [row for row in ROWS if row[0] == "noise floors"])
    assert "image correlation" not in found.lead
    assert [table.caption for table in found.tables] == ["Noise floors"]


def test_the_table_is_read_from_the_folder_and_its_text_is_no_markup(result_folder, tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    for file in ("run.json", "force.csv"):
        (folder / file).write_bytes((result_folder / file).read_bytes())
    pd.DataFrame(ROWS, columns=PRACTICE_COLUMNS).to_csv(folder / "good_practice.csv", index=False)
    page = single_page(read_results(folder))
    assert 'id="good-practice"' in page
    assert "&lt;b&gt;Canon&lt;/b&gt;" in page
    assert "<b>Canon" not in page


def test_a_table_with_a_word_for_a_number_names_its_line(tmp_path):
    table = pd.DataFrame(ROWS, columns=PRACTICE_COLUMNS).astype({"value": object})
    table.loc[2, "value"] = "eight"
    table.to_csv(tmp_path / "good_practice.csv", index=False)
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(DataError, match="line 4, value: got 'eight'"):
        read_results(tmp_path)
