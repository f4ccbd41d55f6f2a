"""Tables made of records and tracks say what the records say."""

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import Status
from ploughval.errors import DataError
from ploughval.results import (
    FILES,
    MADE,
    MetricsRecord,
    RunRecord,
    frames_table,
    metrics_table,
    notes_table,
    read_results,
    table_dataset,
    tracks_table,
    with_units,
)


@pytest.fixture(scope="module")
def results(result_folder):
    return read_results(result_folder)


def test_nothing_makes_no_table():
    assert metrics_table(None) is metrics_table(MetricsRecord()) is None
    assert frames_table(RunRecord()) is notes_table(RunRecord()) is None


def test_tables_have_the_columns_that_are_told(results):
    made = {
        "metrics.csv": metrics_table(results.metrics),
        "frames.csv": frames_table(results.run),
        "notes.csv": notes_table(results.run),
        "tracks.csv": tracks_table(results.tracks),
    }
    assert set(made) == set(MADE)
    for name, table in made.items():
        assert set(table) <= set(MADE[name].units)
        for column in MADE[name].columns:
            if column.name in table:
                words = [isinstance(value, str) for value in table[column.name]]
                assert all(words) if column.is_text else not any(words)


def test_a_verdict_is_one_or_zero_and_nan_where_nothing_was_judged(results):
    agrees = metrics_table(results.metrics).set_index("metric")["agrees"]
    assert agrees["beta_deg"] == 1.0
    assert agrees["outcrop_x_mm"] == 0.0
    assert np.isnan(agrees["line_of_action_mm"])


def test_faults_stand_before_warnings(results):
    told = notes_table(results.run)
    assert told.to_numpy().tolist() == [
        ["fault", "frame 5: truncated file"],
        ["warning", "no empty-box runs"],
    ]


def test_long_tracks_hold_each_value_once_at_its_photograph_and_point(results):
    tracks = results.tracks.copy(deep=True)
    tracks["status"][2, 7], tracks["status"][3, 7] = int(Status.BURIED), 99  # of a later version
    table = tracks_table(tracks).set_index(["frame", "point"])
    assert len(table) == tracks["x_mm"].size
    assert table.loc[[(2, 7), (3, 7), (4, 7)], "status"].tolist() == ["buried", "unknown", "ok"]
    for frame, point in ((0, 0), (2, 7), (12, 100)):
        row = table.loc[(frame, point)]
        assert row["x_mm"] == tracks["x_mm"].to_numpy()[frame, point]
        assert row["x0_mm"] == tracks["x0_mm"].to_numpy()[point]
        assert row["u_mm"] == tracks["u_mm"].to_numpy()[frame]


def test_long_tracks_of_some_photographs_are_those_rows_of_all(results):
    every = tracks_table(results.tracks)
    some = tracks_table(results.tracks, slice(3, 5))
    pd.testing.assert_frame_equal(some, every[every["frame"].isin([3, 4])].reset_index(drop=True))


def test_long_tracks_take_the_numbers_of_photographs_that_stand_in_the_file(results):
    numbered = results.tracks.isel(frame=[2, 7]).assign_coords(frame=[2, 7])
    assert tracks_table(numbered)["frame"].unique().tolist() == [2, 7]
    assert tracks_table(numbered, slice(1, 2))["frame"].unique().tolist() == [7]


def test_counts_are_whole_numbers_unless_one_is_missing_or_broken():
    rows = pd.DataFrame({"frame": [0.0, 1.0], "band": [0.0, np.nan], "u_mm": [0.0, 1.0]})
    for wrong in (0.5, np.inf, 1e300):
        odd = with_units(rows.assign(frame=[0.0, wrong]), FILES["mobilised.csv"])
        assert odd["frame"].tolist() == [0.0, wrong]
    found = with_units(rows, FILES["mobilised.csv"])
    assert [found[name].dtype for name in rows] == [np.int64, np.float64, np.float64]
    assert rows["frame"].dtype == np.float64  # the table that was given is left as it was


def test_a_dataset_has_no_unit_where_rows_differ_in_it():
    rows = pd.DataFrame({"source": ["spacing"], "value": [150.0], "unit": ["mm"], "sensitivity_N": [-0.1]})
    found = table_dataset(rows, FILES["budget.csv"])
    assert set(found) == set(rows)
    assert all("units" not in variable.attrs for variable in found.data_vars.values())
    assert found["unit"].to_numpy().tolist() == ["mm"]


def test_a_status_of_a_force_that_is_not_known_is_not_taken_for_another():
    with pytest.raises(
        DataError, match=r"force\.csv: line 3, status: got 'odd'; expected one of ok, force_too"
    ):
        table_dataset(pd.DataFrame({"status": ["ok", "odd"]}), FILES["force.csv"])
