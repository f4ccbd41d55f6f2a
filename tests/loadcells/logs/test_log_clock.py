"""Times of logs as seconds, other units, date-times, times of day and sample numbers."""

import re

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError
from ploughval.loadcells import read_log
from ploughval.scene import LogColumns

N = 200
REST = [f"{0.01 * k:.2f},{1 + 0.1 * (k % 7):.1f},{2 + 0.1 * (k % 5):.1f}" for k in range(N)]


def read(tmp_path, times, header="time_s", columns=None, separator=";", **options):
    """A log with these cells as its times."""
    path = tmp_path / "log.csv"
    names = ["displacement_mm", "moment_upper_Nm", "moment_lower_Nm"]
    lines = [separator.join([header, *names])]
    lines += [separator.join([t, *r.split(",")]) for t, r in zip(times, REST, strict=False)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    named = {"time_s": header.split(separator)[0]} if columns is None else columns
    return read_log(path, LogColumns(**named), **options)


def stamps(pattern, start="2026-11-27 10:15:03.25", step="250ms"):
    return pd.date_range(start, periods=N, freq=step).strftime(pattern).tolist()


SECONDS = 0.25 * np.arange(N)


@pytest.mark.parametrize(
    ("header", "factor"),
    [
        ("time_s", 1),
        ("Time (ms)", 1000),
        ("t [s]", 1),
        ("Zeit [min]", 1 / 60),
        ("elapsed_ms", 1000),
        ("time / us", 1e6),
        ("millis", 1000),
        ("t in h", 1 / 3600),
    ],
)
def test_times_in_other_units_become_seconds(tmp_path, header, factor):
    log = read(tmp_path, [f"{0.25 * k * factor:.12g}" for k in range(N)], header)
    np.testing.assert_allclose(log.data["time_s"], SECONDS, atol=1e-9)
    assert log.faults == ()
    assert any("time:" in note for note in log.notes) == (factor != 1)


def test_a_unit_in_the_settings_is_that_of_a_header_without_one(tmp_path):
    log = read(tmp_path, [str(250 * k) for k in range(N)], "clock", {"time_s": "clock [ms]"})
    np.testing.assert_array_equal(log.data["time_s"], SECONDS)


def test_units_that_contradict_each_other_are_refused(tmp_path):
    with pytest.raises(DataError, match="said to be in 's' and in 'ms'"):
        read(tmp_path, ["0", "1", "2"], "clock (s)", {"time_s": "clock [ms]"})


def test_whole_numbers_in_large_steps_without_a_unit_are_doubted(tmp_path):
    log = read(tmp_path, [str(100 * k) for k in range(N)], "clock")
    assert any("rises by 100 a row: read as seconds" in fault and "[ms]" in fault for fault in log.faults)


@pytest.mark.parametrize(
    "pattern",
    [
        "%Y-%m-%d %H:%M:%S.%f",
        "%Y-%m-%dT%H:%M:%S.%f",
        "%Y-%m-%dT%H:%M:%S.%fZ",
        "%Y-%m-%d %H:%M:%S.%f+01:00",
        "%Y/%m/%d %H:%M:%S.%f",
        "%d.%m.%Y %H:%M:%S.%f",
        "%d.%m.%y %H:%M:%S.%f",
        "%m/%d/%Y %I:%M:%S.%f %p",
        "%d/%m/%Y %H:%M:%S.%f",
        "%d-%b-%Y %H:%M:%S.%f",
        "%H:%M:%S.%f",
        "%I:%M:%S.%f %p",
        "%M:%S.%f",
    ],
)
@pytest.mark.parametrize("decimal", [".", ","])
def test_date_times_count_in_seconds_from_the_first_row(tmp_path, pattern, decimal):
    cells = stamps(pattern)
    if decimal == ",":
        cells = [decimal.join(t.rsplit(".", 1)) for t in cells]
    log = read(tmp_path, cells, "Zeit", columns={"time_s": "Zeit"})
    np.testing.assert_allclose(log.data["time_s"], SECONDS, atol=1e-9)
    assert log.faults == ()
    assert any("in seconds from the log's first row" in note for note in log.notes)


def test_fractions_and_seconds_of_zero_may_be_left_out(tmp_path):
    full = stamps("%d.%m.%Y %H:%M:%S.%f", start="2026-11-27 10:15:33.25")
    cells = [re.sub(r"(:00)?\.0+$|(?<=[1-9])0+$", "", t) for t in full]
    assert (cells[1], cells[27], cells[107]) == (
        "27.11.2026 10:15:33.5",
        "27.11.2026 10:15:40",
        "27.11.2026 10:16",
    )
    log = read(tmp_path, cells)
    np.testing.assert_allclose(log.data["time_s"], SECONDS, atol=1e-9)


def test_month_before_day_is_told_by_a_part_above_12(tmp_path):
    us = stamps("%m/%d/%Y %H:%M:%S", start="2026-11-12 23:59:00", step="1s")
    log = read(tmp_path, us, columns={"time_s": "time_s"})
    np.testing.assert_array_equal(log.data["time_s"], np.arange(N))
    assert log.faults == ()


def test_a_date_that_can_be_two_is_refused_where_it_changes_and_read_where_the_header_says(tmp_path):
    cells = stamps("%m/%d/%Y %H:%M:%S", start="2026-03-04 23:59:00", step="1s")
    with pytest.raises(DataError, match=r"\[dd/mm/yyyy\] or \[mm/dd/yyyy\]"):
        read(tmp_path, cells, "stamp")
    for header, named in (("stamp (MM/DD/YYYY)", "stamp"), ("stamp", "stamp [mm/dd/yyyy]")):
        log = read(tmp_path, cells, header, {"time_s": named})
        np.testing.assert_array_equal(log.data["time_s"], np.arange(N))


def test_of_a_single_date_both_readings_are_the_same_seconds(tmp_path):
    log = read(tmp_path, stamps("%m/%d/%Y %H:%M:%S", start="2026-03-04 10:00:00", step="1s"))
    np.testing.assert_array_equal(log.data["time_s"], np.arange(N))


def test_dates_of_two_orders_are_refused(tmp_path):
    cells = stamps("%m/%d/%Y %H:%M:%S", start="2026-03-24 10:00:00", step="1s")
    cells[50:] = stamps("%d/%m/%Y %H:%M:%S", start="2026-03-24 10:00:50", step="1s")[: N - 50]
    with pytest.raises(DataError, match="a day before the month and dates with a month before"):
        read(tmp_path, cells)


def test_date_and_time_in_two_columns_are_one_time(tmp_path):
    cells = stamps("%H:%M:%S;%d.%m.%Y", start="2026-11-27 23:59:00", step="1s")
    log = read(tmp_path, cells, "Zeit;Datum", {"time_s": "Zeit", "date": "Datum"})
    np.testing.assert_array_equal(log.data["time_s"], np.arange(N))


def test_times_of_day_go_on_after_midnight(tmp_path):
    log = read(tmp_path, stamps("%H:%M:%S", start="2026-11-27 23:59:00", step="1s"))
    np.testing.assert_array_equal(log.data["time_s"], np.arange(N))
    assert any("starts from 0 again after 86400 s" in note for note in log.notes)


def test_minutes_and_seconds_go_on_after_the_hour(tmp_path):
    log = read(tmp_path, [t[3:-4] for t in stamps("%H:%M:%S.%f", start="2026-11-27 10:59:50")])
    np.testing.assert_allclose(log.data["time_s"], SECONDS, atol=1e-9)


def test_two_numbers_with_a_colon_are_refused_unless_the_header_says_which(tmp_path):
    cells = stamps("%H:%M", step="60s")
    with pytest.raises(DataError, match=r"\[hh:mm\] or \[mm:ss\]"):
        read(tmp_path, cells, "clock")
    np.testing.assert_array_equal(read(tmp_path, cells, "clock [hh:mm]").data["time_s"], 60 * np.arange(N))
    np.testing.assert_array_equal(read(tmp_path, cells, "clock [mm:ss]").data["time_s"], np.arange(N))


@pytest.mark.parametrize(("day", "way"), [("2026-03-29", "on"), ("2026-10-25", "back")])
def test_a_clock_set_by_an_hour_for_summer_time_is_put_right(tmp_path, day, way):
    # From an hour in UTC before Berlin's clocks are set, second by second.
    utc = pd.date_range(f"{day} 00:58:20", periods=N, freq="1s", tz="UTC")
    log = read(tmp_path, utc.tz_convert("Europe/Berlin").strftime("%Y-%m-%d %H:%M:%S").tolist())
    np.testing.assert_array_equal(log.data["time_s"], np.arange(N))
    assert len(log.faults) == 1
    assert f"the clock was set {way} by an hour at log.csv row 100 (line 102)" in log.faults[0]


def test_date_times_with_a_zone_know_no_summer_time(tmp_path):
    utc = pd.date_range("2026-03-29 00:58:20", periods=N, freq="1s", tz="UTC")
    log = read(tmp_path, utc.tz_convert("Europe/Berlin").strftime("%Y-%m-%dT%H:%M:%S%z").tolist())
    np.testing.assert_array_equal(log.data["time_s"], np.arange(N))
    assert log.faults == ()


@pytest.mark.parametrize("header", ["Sample", "n [samples]", "scan"])
def test_sample_numbers_are_divided_by_the_rate(tmp_path, header):
    log = read(tmp_path, [str(k + 1) for k in range(N)], header, rate_hz=12.5)
    np.testing.assert_array_equal(log.data["time_s"], (np.arange(N) + 1) / 12.5)
    assert any("12.5 a second" in note for note in log.notes)


def test_a_log_without_times_counts_its_rows(tmp_path):
    for columns in ({}, {"time_s": ""}):
        log = read(tmp_path, ["x"] * N, "", columns, rate_hz=4.0)
        np.testing.assert_array_equal(log.data["time_s"], SECONDS)


def test_sample_numbers_without_a_rate_ask_for_it(tmp_path):
    with pytest.raises(DataError, match=r"counts samples; expected \[loadcells\] rate_hz"):
        read(tmp_path, ["1", "2", "3"], "Sample")


@pytest.mark.parametrize(
    ("cells", "header", "why"),
    [
        (["0.0", "0.25", "0.5"], "time", "holds no whole numbers"),
        (["0", "1", "2"], "time (s)", "is in a unit of time"),
        (["10:00:00", "10:00:01", "10:00:02"], "time", "holds times of day, and rate_hz = 10 is given"),
    ],
)
def test_a_rate_that_contradicts_the_times_is_refused(tmp_path, cells, header, why):
    with pytest.raises(DataError, match=why):
        read(tmp_path, cells, header, rate_hz=10.0)


def test_times_that_are_not_understood_are_shown(tmp_path):
    with pytest.raises(DataError, match="times as 'noon' are not understood"):
        read(tmp_path, ["noon", "one", "two"])


def test_a_time_that_is_no_time_loses_its_row_alone(tmp_path):
    cells = stamps("%d.%m.%Y %H:%M:%S.%f")
    cells[7] = "??.11.2026"
    log = read(tmp_path, cells)
    np.testing.assert_allclose(log.data["time_s"], np.delete(SECONDS, 7), atol=1e-9)
    assert log.faults == ("row 7 (line 9) without a time: dropped",)
