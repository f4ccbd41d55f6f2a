"""Logs that are no logs, or larger than any that is read, are refused with the line and what to do."""

import gzip

import pytest

from ploughval.errors import DataError
from ploughval.loadcells.logs import read_log, text_bytes
from ploughval.scene import LogColumns

HEADER = "time_s,displacement_mm,moment_upper_Nm,moment_lower_Nm\n"
ROWS = [f"{k / 10},{k / 100},{k % 7 / 8},{k % 5 / 8}\n" for k in range(50)]


def refused(path, data):
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    with pytest.raises(DataError) as caught:
        read_log(path, LogColumns())
    return str(caught.value)


def test_more_rows_than_the_limit_are_refused_before_they_are_parsed(tmp_path, monkeypatch):
    monkeypatch.setattr(text_bytes, "LOG_ROWS", 20)
    monkeypatch.setattr(text_bytes, "_ABOVE", 0)
    told = refused(tmp_path / "a.csv", HEADER + "".join(ROWS))
    assert "rows; expected at most as many. Thin it out or part it" in told


@pytest.mark.parametrize("end", ["\n", "\r", "\r\n"])
def test_a_line_without_end_is_refused_by_its_number(tmp_path, end):
    long = "1," * (1 << 20) + "\n"
    text = (HEADER + "".join([*ROWS[:9], long, *ROWS[9:]])).replace("\n", end)
    assert "line 11 is longer than 1.05 MB" in refused(tmp_path / "a.csv", text)


def test_a_long_line_across_blocks_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr(text_bytes, "_BLOCK", 1000)
    monkeypatch.setattr(text_bytes, "LINE_BYTES", 2500)
    text = HEADER + "".join(ROWS) + "1," * 1300 + "\n"
    assert "line 52 is longer than" in refused(tmp_path / "a.csv", text)


def test_a_file_that_was_allotted_more_than_was_written_is_read(tmp_path):
    (tmp_path / "a.csv").write_bytes((HEADER + "".join(ROWS)).encode() + bytes(3 << 20))
    assert len(read_log(tmp_path / "a.csv", LogColumns()).data) == len(ROWS)


def test_a_packed_file_is_refused_by_its_kind(tmp_path):
    told = refused(tmp_path / "a.csv", gzip.compress((HEADER + "".join(ROWS)).encode()))
    assert "is packed (gzip); expected a text table. Unpack it" in told


def test_decimal_commas_between_commas_are_refused_rather_than_read_in_two_ways(tmp_path):
    told = refused(tmp_path / "a.csv", HEADER + "".join(row.replace(".", ",") for row in ROWS))
    assert "numbers under 4 headers" in told
    assert "semicolons between columns, or with decimal points" in told


def test_a_further_column_without_header_is_still_passed_over(tmp_path):
    (tmp_path / "a.csv").write_text(HEADER + "".join(f"{row.strip()},7\n" for row in ROWS))
    assert len(read_log(tmp_path / "a.csv", LogColumns()).data) == len(ROWS)


@pytest.mark.parametrize("cell", ["nan", "", "1e300", "off"])
def test_a_cell_without_any_reading_is_named(tmp_path, cell):
    rows = [",".join([*row.split(",")[:2], cell, row.split(",")[3]]) for row in ROWS]
    assert "moment_upper" in refused(tmp_path / "a.csv", HEADER + "".join(rows))


def test_times_that_rise_by_next_to_nothing_are_refused_as_the_same(tmp_path):
    """Found by spoiling sound files: the smallest numbers there are, whose squares are zero."""
    rows = [f"{k}e-320,{row.split(',', 1)[1]}" for k, row in enumerate(ROWS)]
    assert "all times in column 'time_s' are the same" in refused(tmp_path / "a.csv", HEADER + "".join(rows))


@pytest.mark.parametrize("digits", [400, 5000])
def test_a_reading_of_hundreds_of_digits_is_left_empty_by_its_row(tmp_path, digits):
    """Such a whole number is larger than any float; found by spoiling sound files."""
    rows = [*ROWS[:9], f"0.9,0.09,{'2' * digits},0.5\n", *ROWS[10:]]
    (tmp_path / "a.csv").write_text(HEADER + "".join(rows))
    log = read_log(tmp_path / "a.csv", LogColumns())
    assert log.faults == ("moment_upper is not finite in row 9 (line 11): left empty",)
    assert log.data["moment_upper"].isna().sum() == 1
