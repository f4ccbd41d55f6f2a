"""Lines that do not fit: each is named with row and line, and dropped or left empty by a stated rule."""

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError
from ploughval.loadcells import read_log
from ploughval.scene import LogColumns

NAMES = ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
KEYS = ["time_s", "displacement_mm", "moment_upper", "moment_lower"]
HEAD = ",".join(NAMES)
N = 100


def table():
    k = np.arange(N)
    return np.column_stack([0.1 * k, 0.01 * (k % 7), 1 + 0.1 * (k % 9), 2 + 0.1 * (k % 5)])


def lines():
    """Line 0 is the header; row k stands in lines[k + 1], line k + 2 of the file."""
    return [HEAD, *(",".join(f"{v:.4f}" for v in row) for row in table())]


def read(tmp_path, content):
    path = tmp_path / "log.csv"
    path.write_bytes(content if isinstance(content, bytes) else ("\n".join(content) + "\n").encode())
    return read_log(path, LogColumns())


def check(log, without=(), faults=()):
    np.testing.assert_allclose(log.data[KEYS], np.delete(table(), list(without), axis=0), rtol=1e-12)
    assert log.faults == faults


def test_too_few_fields_drop_the_row(tmp_path):
    text = lines()
    text[41] = "4.0,0.05"
    check(read(tmp_path, text), [40], ("too few fields in row 40 (line 42): dropped",))


def test_an_empty_cell_at_the_end_is_a_missing_value_and_keeps_its_row(tmp_path):
    text = lines()
    text[41] = "4.0000,0.0500,1.4000,"
    log = read(tmp_path, text)
    assert len(log.data) == N
    assert log.faults == ("moment_lower is not finite in row 40 (line 42): left empty",)
    assert log.data["moment_upper"][40] == 1.4


def test_too_many_fields_drop_the_row_and_later_rows_keep_their_numbers(tmp_path):
    text = lines()
    text[41] += ",1"
    text[61] = text[61].replace(text[61].split(",")[2], "OVL")
    log = read(tmp_path, text)
    assert log.faults == (
        "too many fields in line 42 (expected 4): dropped",
        "moment_upper holds text where a number was expected ('OVL') in row 60 (line 62)",
        "moment_upper is not finite in row 60 (line 62): left empty",
    )


def test_a_header_repeated_inside_is_dropped(tmp_path):
    text = lines()
    text[51:51] = [HEAD]
    check(read(tmp_path, text), (), ("the headers once more in row 50 (line 52): dropped",))


def test_a_remark_between_rows_is_dropped_by_name(tmp_path):
    text = lines()
    text[51:51] = ["# paused,,,"]
    log = read(tmp_path, text)
    np.testing.assert_allclose(log.data[KEYS], table(), rtol=1e-12)
    assert "row 50 (line 52) without a time: dropped" in log.faults


def test_blank_lines_are_no_rows(tmp_path):
    text = lines()
    text[31:31] = ["", ""]
    text[61] = "5.8000,0.0200,x,2.3000"
    log = read(tmp_path, text)
    assert len(log.data) == N
    assert log.faults[-1] == "moment_upper is not finite in row 58 (line 62): left empty"


@pytest.mark.parametrize(
    ("end", "cut"), [("9.90", True), ("9.9000,0.01", True), ("9.9000,0.0100,1.0000,2.4", True)]
)
def test_a_last_line_that_is_cut_off_is_dropped(tmp_path, end, cut):
    content = "\n".join([*lines()[:-1], end]).encode()
    check(read(tmp_path, content), [99], ("the last line is cut off in row 99 (line 101): dropped",))
    assert cut


def test_a_last_line_without_its_end_but_whole_is_kept(tmp_path):
    check(read(tmp_path, "\n".join(lines()).encode()))


def test_nul_bytes_at_the_end_are_taken_off(tmp_path):
    content = ("\n".join(lines()) + "\n").encode() + b"\0" * 4096
    expected = "NUL bytes at the end: taken off (the file was not closed as it should)"
    check(read(tmp_path, content), (), (expected,))


def test_nul_bytes_inside_spoil_their_row_alone(tmp_path):
    text = [line.encode() for line in lines()]
    text[41] = text[41][:12] + b"\0" * 7 + text[41][19:]
    log = read(tmp_path, b"\n".join(text) + b"\n")
    assert log.faults[0] == "NUL bytes, first in line 42: what they stand in is no number"
    rest = np.delete(np.arange(N), 40)
    np.testing.assert_allclose(log.data[log.data["time_s"] != 4.0][KEYS], table()[rest], rtol=1e-12)


def test_numbers_that_no_cell_gives_are_not_read(tmp_path):
    text = lines()
    text[41] = "4.0000,0.0500,1e300,2.0000"
    text[42] = "4.1000,-1e308,1.5000,inf"
    log = read(tmp_path, text)
    assert log.faults == (
        "displacement_mm is not finite in row 41 (line 43): left empty",
        "moment_upper is not finite in row 40 (line 42): left empty",
        "moment_lower is not finite in row 41 (line 43): left empty",
    )


def test_a_stray_quote_spoils_its_cell_alone(tmp_path):
    text = lines()
    text[41] = '4.0000,0.0500,"1.4000,2.0000'
    log = read(tmp_path, text)
    assert len(log.data) == N
    assert np.isnan(log.data["moment_upper"]).sum() == 1


def test_lines_lost_in_a_quote_that_is_not_closed_are_said(tmp_path):
    text = [",".join(f'"{cell}"' for cell in line.split(",")) for line in lines()]
    text[41] = text[41][:-1]
    text[43] = text[43][:-1]
    log = read(tmp_path, text)
    assert any("a quote that is not closed" in fault for fault in log.faults)


def test_a_point_among_decimal_commas_is_no_decimal_point(tmp_path):
    text = [line.replace(",", ";").replace(".", ",") for line in lines()]
    text[0] = HEAD.replace(",", ";")
    text[41] = "4,0000;0,0500;1.400;2,0000"
    log = read(tmp_path, text)
    assert np.flatnonzero(log.data["moment_upper"].isna()).tolist() == [40]
    assert "('1.400') in row 40" in log.faults[0]


def test_columns_with_different_decimal_signs_are_refused(tmp_path):
    text = [line.replace(",", ";") for line in lines()]
    text[1:] = [";".join([*row.split(";")[:2], "1,234", "2,345"]) for row in text[1:]]
    with pytest.raises(DataError, match=r"numbers as 0\.0000, another as 1,234: expected one decimal sign"):
        read(tmp_path, text)


@pytest.mark.parametrize("start", [b"PK\x03\x04", b"\xd0\xcf\x11\xe0"])
def test_spreadsheets_are_refused_with_what_to_do(tmp_path, start):
    with pytest.raises(DataError, match=r"is a spreadsheet; expected a text table. Save it as CSV"):
        read(tmp_path, start + bytes(range(256)) * 8)


def test_a_clock_that_stands_still_is_refused_with_what_to_do(tmp_path):
    text = [HEAD, *("7," + line.split(",", 1)[1] for line in lines()[1:])]
    with pytest.raises(DataError, match="all times in column 'time_s' are the same"):
        read(tmp_path, text)


def test_rows_that_are_dropped_keep_their_place_where_rows_are_counted(tmp_path):
    text = lines()
    text[11] = text[11][:9]
    text[31] += ",1"
    (tmp_path / "log.csv").write_text("\n".join(text) + "\n")
    log = read_log(tmp_path / "log.csv", LogColumns(time_s=""), rate_hz=10.0)
    np.testing.assert_allclose(log.data["time_s"], np.delete(0.1 * np.arange(N), [10, 30]), rtol=1e-12)


@pytest.mark.parametrize("rows", [0, 1])
def test_a_log_of_one_row_or_none_is_refused(tmp_path, rows):
    with pytest.raises(DataError, match=r"log\.csv"):
        read(tmp_path, lines()[: 1 + rows])


def test_rows_are_counted_through_several_kinds_of_faults(tmp_path):
    """Where each fault stands is known, whatever was dropped before it."""
    rng = np.random.default_rng(3)
    text = lines()
    places = sorted(rng.choice(np.arange(5, N - 5), 12, replace=False).tolist())
    for place, kind in zip(places, ["many", "few", "text"] * 4, strict=True):
        cells = text[place + 1].split(",")
        if kind == "many":
            text[place + 1] += ",9"
        elif kind == "few":
            text[place + 1] = cells[0]
        else:
            text[place + 1] = ",".join([*cells[:2], "bad", cells[3]])
    log = read(tmp_path, text)
    words = [f"{kind}: {places[k::3]}" for k, kind in enumerate(("many", "few", "text"))]
    assert f"line {places[0] + 2}" in log.faults[0].replace("lines", "line"), words
    assert ", ".join(map(str, places[1::3])) in log.faults[1]
    assert ", ".join(map(str, places[2::3])) in log.faults[2]
    assert ", ".join(str(k + 2) for k in places[2::3]) in log.faults[2]
    pd.testing.assert_index_equal(log.data.index, pd.RangeIndex(N - 8))
