"""Date-times of mixed forms are read to what was written, beside the standard library."""

from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ploughval.errors import DataError
from ploughval.loadcells.logs.date_times import read_date_times, read_times_of_day

PATH = Path("log.csv")
MOMENTS = st.datetimes(datetime(2000, 1, 1), datetime(2099, 12, 31, 23, 59, 59))
DATES = ["%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y", "%d-%b-%Y", "%d-%B-%Y", "%d.%m.%y"]
TIMES = ["%H:%M:%S.%f", "%H:%M:%S,%f", "%H:%M:%S", "%H:%M", "%I:%M:%S.%f %p", "%I:%M:%S%p", "%I:%M %p"]


def read(cells, hint=""):
    return read_date_times([pd.Series(cells, dtype=object)], hint, PATH)[0]


def truth(moment, form):
    """What a form keeps of a moment."""
    if "%f" not in form:
        moment = moment.replace(microsecond=0)
    return np.datetime64(moment.replace(second=0) if "%S" not in form else moment, "us")


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.tuples(MOMENTS, st.sampled_from(TIMES)), min_size=1, max_size=30),
    st.sampled_from(DATES),
    st.data(),
)
def test_date_times_of_any_form_are_what_was_written(rows, date, data):
    join = data.draw(st.sampled_from([" ", "T", ", "]))
    cells = [moment.strftime(f"{date}{join}{form}") for moment, form in rows]
    blanks = data.draw(st.lists(st.sampled_from(["", " "]), min_size=len(cells), max_size=len(cells)))
    found = read([blank + cell + blank for blank, cell in zip(blanks, cells, strict=True)])
    expected = np.array([truth(moment, form) for moment, form in rows])
    np.testing.assert_array_equal(found, expected)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(MOMENTS, st.integers(-720, 840)), min_size=1, max_size=20), st.booleans())
def test_zones_are_taken_off(rows, colon):
    cells, expected = [], []
    for moment, minutes in rows:
        zone = timezone(timedelta(minutes=minutes))
        text = moment.replace(tzinfo=zone).strftime("%Y-%m-%dT%H:%M:%S.%f%z")
        cells.append(f"{text[:-2]}:{text[-2:]}" if colon else text)
        expected.append(np.datetime64(moment - timedelta(minutes=minutes), "us"))
    np.testing.assert_array_equal(read(cells), np.array(expected))


def test_more_forms_than_are_looked_for_at_once_are_read_all_the_same():
    rng = np.random.default_rng(0)
    moments = [datetime(2026, 1, 1) + timedelta(seconds=int(s)) for s in rng.integers(0, 3e7, 5000)]
    digits = rng.integers(1, 7, 5000)
    cells = [
        f"{m.year}-{m.month}-{m.day} {m.hour}:{m:%M:%S}.{123456 // 10 ** (6 - d):0{d}d}"
        for m, d in zip(moments, digits, strict=True)
    ]
    expected = [
        np.datetime64(m, "us") + np.timedelta64(123456 // 10 ** (6 - int(d)) * 10 ** (6 - int(d)), "us")
        for m, d in zip(moments, digits, strict=True)
    ]
    np.testing.assert_array_equal(read(cells), np.array(expected))


@pytest.mark.parametrize(
    "wrong",
    [
        "",
        "x",
        "2026-02-30 10:00:00",
        "2026-13-01 10:00:00",
        "2026-01-01 25:00:00",
        "2026-01-01 10:61:00",
        "2026-01-01 10:00:00 and more",
        "ü026-01-01 10:00:00",
        "2026-01-01 10:00:00" + " " * 40,
        "0-0-0",
        None,
        float("nan"),
        3.5,
    ],
)
def test_what_is_no_date_time_is_no_time_and_spoils_no_other(wrong):
    good = [f"2026-01-01 10:00:{k:02d}" for k in range(20)]
    found = read([*good[:7], wrong, *good[7:]])
    assert np.isnat(found[7]) or wrong == "2026-01-01 10:00:00" + " " * 40
    expected = np.datetime64("2026-01-01T10:00:00", "us") + np.arange(20) * np.timedelta64(1, "s")
    np.testing.assert_array_equal(np.delete(found, 7), expected)


def test_a_leap_day_is_a_day():
    assert read(["2028-02-29 00:00:00"])[0] == np.datetime64("2028-02-29")
    assert np.isnat(read(["2028-02-28 00:00:00", "2026-02-29 00:00:00"])[1])


def test_times_gone_by_may_pass_a_day():
    seconds, period = read_times_of_day(pd.Series(["23:59:59.5", "24:00:00", "100:00:01.25", "x"]), "", PATH)
    np.testing.assert_array_equal(seconds[:3], [86_399.5, 86_400.0, 360_001.25])
    assert np.isnan(seconds[3])
    assert period == 86_400.0


def test_noon_and_midnight_are_told_apart():
    seconds, _ = read_times_of_day(pd.Series(["12:00:00 AM", "12:00:00 PM", "1:30:00 pm"]), "", PATH)
    np.testing.assert_array_equal(seconds, [0, 43_200, 48_600])


def test_a_column_without_any_time_shows_what_is_there():
    with pytest.raises(DataError, match="times as 'soon' are not understood"):
        read(["soon", "later"])


def test_the_order_of_day_and_month_is_found_over_all_files():
    one, two = pd.Series(["03/04/2026 10:00:00"] * 3), pd.Series(["03/27/2026 10:00:00"] * 3)
    first, second = read_date_times([one, two], "", PATH)
    assert first[0] == np.datetime64("2026-03-04T10:00:00")
    assert second[0] == np.datetime64("2026-03-27T10:00:00")
