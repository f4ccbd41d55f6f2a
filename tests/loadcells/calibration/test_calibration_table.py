"""Calibration tables in the dialects of laboratories; runs and directions from the order of the loads."""

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError
from ploughval.loadcells.calibration.table import read_table, run_numbers, with_moments, with_runs

ROWS = [(0.0, 50.0, 100.25, -50.5), (10.0, 50.0, 280.0, 33.75), (0.0, 50.0, 100.5, -50.25)]


def written(path, separator=",", decimal=".", preamble="", header="load_N,arm_mm,upper,lower", end="\n"):
    lines = [separator.join(header.split(","))]
    lines += [separator.join(str(v).replace(".", decimal) for v in row) for row in ROWS]
    path.write_bytes((preamble + end.join(lines) + end).encode("utf-8-sig"))
    return read_table(path, path.name, g_m_s2=9.80665)


@pytest.mark.parametrize(
    "dialect",
    [
        {},
        {"separator": ";", "decimal": ","},
        {"separator": "\t", "end": "\r\n"},
        {"preamble": "Calibration of 3 May, S. Miller\n\n"},
        {"header": "Load_N,ARM_mm,Upper,Lower"},
        {"header": "load_N,arm_mm,upper [mV/V],lower [mV/V]"},
    ],
)
def test_every_dialect_gives_the_written_numbers(tmp_path, dialect):
    table = written(tmp_path / "cells.csv", **dialect)
    np.testing.assert_array_equal(table[["load_N", "arm_mm", "upper", "lower"]].to_numpy(), ROWS)
    first = 2 + dialect.get("preamble", "").count("\n")
    assert table["line"].tolist() == [first, first + 1, first + 2]
    assert table["row"].tolist() == [0, 1, 2]


def test_masses_become_loads_by_the_stated_gravity(tmp_path):
    path = tmp_path / "cells.csv"
    path.write_text("mass_kg,arm_mm,upper,lower\n1,50,3,4\n2,50,6,8\n")
    assert read_table(path, "cells.csv", g_m_s2=9.81)["load_N"].tolist() == [9.81, 19.62]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("load_N,upper,lower\n1,2,3\n2,3,4\n", "no column arm_mm"),
        ("arm_mm,upper,lower\n1,2,3\n2,3,4\n", "no column load_N or mass_kg"),
        ("load_N,arm_mm,upper\n1,2,3\n2,3,4\n", "no column lower"),
        ("load_N,arm_mm,upper,lower,direction\n1,2,3,4,sideways\n", "line 2: direction is 'sideways'"),
        ("load_N,arm_mm,upper,lower\n1,2,3,4\n2,2,3,x4\n", "line 3: lower is 'x4'; expected a number"),
        ("load_N,load_N,arm_mm,upper,lower\n1,2,3,4,5\n", "2 columns are called 'load_N'"),
        ("", "no row of numbers"),
    ],
)
def test_what_is_wrong_with_a_table_is_said_with_its_line(tmp_path, text, message):
    path = tmp_path / "cells.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=message):
        read_table(path, "cells.csv", g_m_s2=9.81)


def points(loads, *, run="", direction="", files=None, moments=None):
    given = [np.nan] * len(loads)
    table = pd.DataFrame(
        {
            "file": files or ["a.csv"] * len(loads),
            "load_N": loads,
            "arm_mm": 60.0,
            "run": run,
            "direction": direction,
            "moment_upper_Nm": given if moments is None else moments,
            "moment_lower_Nm": given if moments is None else moments,
        }
    )
    return with_moments(table, spacing_mm=150.0, lower_to_tip_mm=260.0)


def test_moments_are_load_times_height_of_the_cell_above_it():
    made = points([0.0, 20.0])
    assert made["moment_upper_Nm"].tolist() == pytest.approx([0.0, 20 * 0.35])
    assert made["moment_lower_Nm"].tolist() == pytest.approx([0.0, 20 * 0.20])


def test_without_load_there_is_no_moment_though_the_arm_is_empty():
    made = points([0.0, 20.0]).assign(arm_mm=np.nan, moment_upper_Nm=np.nan, moment_lower_Nm=np.nan)
    again = with_moments(made, spacing_mm=150.0, lower_to_tip_mm=260.0)
    assert again["moment_lower_Nm"].iloc[0] == 0.0
    assert np.isnan(again["moment_lower_Nm"].iloc[1])


def test_moments_that_are_given_are_kept():
    assert points([5.0, 5.0], moments=[1.0, 2.0])["moment_upper_Nm"].tolist() == [1.0, 2.0]


def test_runs_start_anew_after_a_return_to_zero_and_in_every_file():
    made = with_runs(points([0, 10, 20, 10, 0, 0, 10, 0, 0, 10.0], files=["a"] * 8 + ["b"] * 2))
    assert made["run"].tolist() == ["1"] * 5 + ["2"] * 3 + ["1"] * 2
    assert run_numbers(made).tolist() == [0] * 5 + [1] * 3 + [2] * 2


def test_directions_follow_the_size_of_the_load():
    made = with_runs(points([0.0, -10.0, -20.0, -20.0, -10.0, -10.0, 0.0]))
    assert made["direction"].tolist() == ["up"] * 4 + ["down"] * 3


def test_named_runs_and_directions_are_kept():
    made = with_runs(points([0.0, 10.0, 0.0], run=["x", "x", "y"], direction=["down", "", ""]))
    assert made["run"].tolist() == ["x", "x", "y"]
    assert made["direction"].tolist() == ["down", "up", "up"]
