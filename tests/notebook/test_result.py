"""What ``process`` and ``load_results`` return: tables with units, tracks, metrics, a summary."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import ploughval
from ploughval import load_results
from ploughval.errors import DataError
from ploughval.export import export_results
from ploughval.notebook import ModelTables, Result
from ploughval.results import FILES
from ploughval.run import Outcome


@pytest.fixture(scope="module")
def result(result_folder):
    return load_results(result_folder)


def attribute(result, name):
    above, _, key = name.removesuffix(".csv").rpartition("/")
    return getattr(result.model if above else result, key)


def test_every_table_that_was_written_is_an_attribute_with_a_unit_and_a_meaning_for_each_column(processed):
    written = sorted(p.relative_to(processed.folder).as_posix() for p in processed.folder.rglob("*.csv"))
    assert len(written) > 20
    for name in written:
        table, plain = attribute(processed, name), pd.read_csv(processed.folder / name)
        assert list(table) == list(plain) == list(FILES[name].units)
        assert list(table.attrs["units"]) == list(table.attrs["long_name"]) == list(plain)
        for column in (name for name, unit in table.attrs["units"].items() if unit):
            np.testing.assert_array_equal(table[column].to_numpy(float), plain[column].to_numpy(float))


def test_a_table_that_the_test_has_not_got_is_none(processed):
    assert processed.cell_calibration is None
    assert processed.fit is None
    assert processed.fit_force is None


def test_every_table_of_the_catalogue_has_an_attribute():
    for name in FILES:
        above, _, key = name.removesuffix(".csv").rpartition("/")
        assert FILES[name].about in getattr(ModelTables if above else Result, key).__doc__


def test_what_process_returned_is_what_load_results_gives_later(processed):
    again = load_results(processed.folder.parent)
    for name in ("name", "complete", "faults", "warnings", "steps", "metrics"):
        assert getattr(again, name) == getattr(processed, name)
    assert again.folder.samefile(processed.folder)
    assert again.report.samefile(processed.report)
    pd.testing.assert_frame_equal(again.force, processed.force)


def test_a_result_travels_as_the_outcome_that_it_is(processed):
    told = json.loads(json.dumps(processed.to_json()))
    assert Outcome.from_json(told) == Outcome(**{k: getattr(processed, k) for k in told})


def test_units_are_those_of_the_quantities(result):
    assert result.force.attrs["units"]["force_N"] == "N"
    assert result.layers.attrs["units"]["layer"] == "mm"
    assert result.layers.attrs["long_name"]["x_mm"] == "place along the travel, from the initial face"
    assert result.increments.attrs["units"]["velocity_x"] == "1"
    assert result.layers["frame"].dtype == np.int64


def test_a_table_is_read_once_and_only_when_it_is_asked_for(own_folder):
    result = load_results(own_folder)
    (own_folder / "bands.csv").write_text("spoiled\n")
    force = result.force
    (own_folder / "force.csv").unlink()
    assert result.force is force
    with pytest.raises(DataError, match=r"bands\.csv: columns band"):
        result.bands  # noqa: B018


def test_tracks_carry_units_and_the_calibration_turns_them_into_pixels(processed):
    assert isinstance(processed.tracks, xr.Dataset)
    assert {v.attrs["units"] for v in processed.tracks.data_vars.values()} == {"mm", "1", "s"}
    scale = processed.calibration.mm_per_px
    ends = processed.calibration.to_px(np.array([[0.0, 0.0], [8.0, 0.0]]))
    assert np.hypot(*(ends[1] - ends[0])) == pytest.approx(8.0 / scale, rel=1e-9)


def test_load_cells_measure_less_of_a_rough_blades_force_and_the_table_says_how_much(own_folder):
    record = json.loads((own_folder / "run.json").read_text())
    record["settings"]["soil"]["wall_friction_deg"] = 20.0
    (own_folder / "run.json").write_text(json.dumps(record))
    result = load_results(own_folder)
    plain = pd.read_csv(own_folder / "model" / "force.csv")
    np.testing.assert_array_equal(result.model.force["force_N"], plain["force_N"])
    assert result.model.force.attrs["horizontal_share"] == pytest.approx(np.cos(np.radians(20.0)), abs=1e-15)


def test_metrics_are_a_mapping_and_a_table(result):
    table = result.metrics_table.set_index("metric")
    assert result.metrics["first_peak_N"]["experiment"] == table.loc["first_peak_N", "experiment"] == 12.0
    assert np.isnan(table.loc["line_of_action_mm", "experiment"])
    assert table.loc["line_of_action_mm", "note"] == "the model has no line of action"


def test_the_ledger_says_what_became_of_each_photograph(result):
    lost = result.frames[result.frames["status"] == "lost"]
    assert lost["frame"].tolist() == [5]
    assert lost["reason"].tolist() == ["truncated file"]
    assert np.isnan(lost["u_mm"]).all()


def test_a_summary_names_what_was_lost_and_the_chief_metrics_and_escapes_the_words_of_users(own_folder):
    record = json.loads((own_folder / "run.json").read_text())
    record["test"], record["complete"] = "<d30>", False
    (own_folder / "run.json").write_text(json.dumps(record))
    shown = load_results(own_folder)._repr_html_()
    assert "<b>&lt;d30&gt;</b> (incomplete)" in shown
    assert "frame 5: truncated file" in shown
    assert "First peak, N" in shown
    assert "<d30>" not in shown


def test_a_result_says_in_a_line_what_it_is(result, result_folder):
    assert repr(result) == f"<Result of d30-01: incomplete, 7 metrics, in {result_folder}>"


def test_an_export_is_that_of_the_command(result, tmp_path):
    (own,), (other,) = (
        result.export("mat", tmp_path / "a"),
        export_results(result.folder, "mat", tmp_path / "b"),
    )
    assert own.read_bytes() == other.read_bytes()


def test_a_name_that_is_no_table_is_refused_with_those_that_are(result):
    with pytest.raises(DataError, match=r"bands\.txt: is no table of results; expected one of force\.csv"):
        result.table("bands.txt")


def test_results_behind_a_url_are_refused_in_words():
    result = Result("d30", "s3://lab/d30/results", True, (), (), {}, (), 1.0)
    with pytest.raises(DataError, match="s3://lab/d30/results: is behind a URL; copy"):
        result.force  # noqa: B018
    assert result._repr_html_() is None  # a notebook shows the line of text
    assert "s3://lab/d30/results" in repr(result)


@pytest.mark.parametrize("what", ["nothing", "part"])
def test_results_that_are_not_there_or_not_whole_are_refused(tmp_path, make_results, what):
    if what == "part":
        (make_results(tmp_path / "results") / "run.json").unlink()
    with pytest.raises(DataError, match="holds no results; process it first"):
        load_results(tmp_path)


def test_the_package_names_its_version_and_nothing_that_it_has_not_got():
    assert ploughval.__version__ == "0.1.0"
    with pytest.raises(AttributeError, match="no attribute 'versions'"):
        ploughval.versions  # noqa: B018
