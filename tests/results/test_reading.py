"""Files of a result folder as they are read: numbers, words, what is missing, and what is refused."""

import json

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError
from ploughval.results import (
    FILES,
    Results,
    RunRecord,
    calibration_in,
    horizontal_share,
    read_record,
    read_results,
    read_table,
    read_tracks,
    with_files,
)


def test_what_is_not_there_is_none(tmp_path):
    assert read_table(tmp_path, "force.csv") is None
    assert read_tracks(tmp_path) is None
    assert read_record(tmp_path / "run.json", RunRecord) is None
    assert calibration_in(tmp_path) is None


def test_an_empty_cell_is_nan_among_numbers_and_no_letters_among_words(tmp_path):
    columns = list(FILES["softening.csv"].units)
    row = dict.fromkeys(columns, "") | {"band": "all", "peak_deg": "44.5", "points": "12", "note": ""}
    pd.DataFrame([row]).to_csv(tmp_path / "softening.csv", index=False)
    found = read_table(tmp_path, "softening.csv").iloc[0]
    assert (found["band"], found["note"], found["law"]) == ("all", "", "")
    assert found["peak_deg"] == 44.5
    assert np.isnan(found["length_mm"])


def test_words_that_look_like_numbers_or_gaps_stay_words(tmp_path):
    columns = FILES["cell_calibration.csv"].columns
    rows = ["01", "NA", "null"]
    text = [",".join(column.name for column in columns)]
    text += [",".join(word if column.is_text else "" for column in columns) for word in rows]
    (tmp_path / "cell_calibration.csv").write_text("\n".join([*text, "last.csv,7", ""]))
    found = read_table(tmp_path, "cell_calibration.csv")
    assert found["run"].tolist() == [*rows, ""]  # the last row ends early
    assert np.isnan(found["load_N"]).all()


def test_a_verdict_is_one_zero_or_nan(tmp_path):
    columns = list(FILES["peak_pairs.csv"].units)
    rows = [dict.fromkeys(columns, "1") | {"u_mm_agrees": word} for word in ("True", "False", "")]
    pd.DataFrame(rows).to_csv(tmp_path / "peak_pairs.csv", index=False)
    np.testing.assert_array_equal(read_table(tmp_path, "peak_pairs.csv")["u_mm_agrees"], [1.0, 0.0, np.nan])


def test_a_word_where_a_number_belongs_is_refused_with_line_and_column(tmp_path):
    (tmp_path / "surface.csv").write_text("frame,u_mm,x_mm,y_mm\n0,0,1,30\n0,0,high,30\n")
    with pytest.raises(DataError, match=r"surface\.csv: line 3, x_mm: got 'high'; expected a number"):
        read_table(tmp_path, "surface.csv")


def test_a_column_that_is_missing_is_refused_but_not_one_that_earlier_versions_did_not_write(tmp_path):
    (tmp_path / "surface.csv").write_text("frame,u_mm,x_mm\n0,0,1\n")
    with pytest.raises(DataError, match="columns y_mm are missing; expected frame, u_mm, x_mm, y_mm"):
        read_table(tmp_path, "surface.csv")
    (tmp_path / "peaks.csv").write_text("source,kind,u_mm,force_N\nmodel,peak,1,2\n")
    assert list(read_table(tmp_path, "peaks.csv")) == ["source", "kind", "u_mm", "force_N"]


@pytest.mark.parametrize("text", ["{", '{"frames": 3}', "[" * 100_000])
def test_a_record_that_cannot_be_read_is_refused_by_name(tmp_path, text):
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(DataError, match=r"run\.json: .*Write it anew with: ploughval process"):
        read_record(tmp_path / "run.json", RunRecord)


def test_a_folder_is_its_own_results_or_that_of_its_test(result_folder, tmp_path):
    assert with_files(result_folder) == with_files(result_folder.parent) == result_folder
    with pytest.raises(DataError, match="no result files here"):
        with_files(tmp_path)


def test_friction_on_the_blade_and_its_inclination_add_up():
    soil, blade = {"wall_friction_deg": 20.0}, {"inclination_deg": 10.0}
    assert horizontal_share({"soil": soil, "blade": blade}) == pytest.approx(np.cos(np.radians(30.0)))
    assert horizontal_share({}) == 1.0


def test_the_models_force_is_read_as_load_cells_would_measure_it(own_folder):
    record = json.loads((own_folder / "run.json").read_text())
    record["settings"]["soil"]["wall_friction_deg"] = 60.0
    (own_folder / "run.json").write_text(json.dumps(record))
    plain = pd.read_csv(own_folder / "model" / "force.csv")
    np.testing.assert_allclose(read_results(own_folder).model_force["force_N"], 0.5 * plain["force_N"])


def test_forces_are_divided_by_the_models_first_peak_or_what_there_is_of_it(own_folder):
    whole = read_results(own_folder)
    assert whole.P0_N == 12.3375
    first = whole.model_force.assign(force_N=8.5)
    assert Results(own_folder, RunRecord(), model_force=first).P0_N == 8.5
    assert Results(own_folder, RunRecord()).P0_N is None
