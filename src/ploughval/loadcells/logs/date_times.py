"""Date-times and times of day written as text, read to numpy times; a date that can mean two is refused."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.loadcells.logs.stamp_fields import Fields, read_fields

Stamps = NDArray[np.datetime64]

_DATE = r"(?P<a>\d{1,4})(?P<sign>[./-])(?P<b>\d{1,2}|[A-Za-z]{3,9})(?P=sign)(?P<c>\d{4}|\d{1,2})"
_END = r"(?P<ap> ?[AaPp][Mm])?"
_TIME = rf"(?P<H>\d{{1,2}}):(?P<M>\d{{2}})(?::(?P<S>\d{{2}})(?:[.,](?P<f>\d+))?)?{_END}"
_DATE_TIME = re.compile(rf"\s*{_DATE}(?:[T ,_]\s*{_TIME}(?P<z> ?(?:Z|[+-]\d\d:?\d\d))?)?\s*")
_TIME_OF_DAY = re.compile(
    rf"\s*(?:(?P<H>\d{{1,5}}):)?(?P<M>\d{{1,2}}):(?P<S>\d{{2}})(?:[.,](?P<f>\d+))?{_END}\s*"
)
KNOWN = (
    "2026-11-27 10:15:03.25, 27.11.2026 10:15:03,25, 11/27/2026 10:15:03 AM or 10:15:03.25 "
    "(a date may stand in a column of its own: columns.date)"
)
_ORDERS = {"dd/mm": True, "d/m": True, "mm/dd": False, "m/d": False}
_CENTURY = 2000  # of years of two digits
_ROWS = 1000  # looked at for the form


def is_date_time(text: str) -> bool:
    """Whether a text is a date, or date and time, in one of the forms that are read.

    >>> is_date_time("27.11.2026 10:15:03,25"), is_date_time("10:15:03"), is_date_time("27.5")
    (True, False, False)
    """
    return _DATE_TIME.fullmatch(text) is not None


def is_time_of_day(text: str) -> bool:
    """Whether a text is hours, minutes and seconds, or minutes and seconds.

    >>> is_time_of_day("10:15:03.25"), is_time_of_day("9:05 PM"), is_time_of_day("10.15")
    (True, True, False)
    """
    return _TIME_OF_DAY.fullmatch(text) is not None


def read_date_times(columns: Sequence[pd.Series], hint: str, path: Path) -> list[Stamps]:
    """Read columns of dates or date-times; they may come from several files.

    Whether the day or the month stands first is told by ``hint``, by a part above 12, or does not matter as
    all dates are the same; a date with points has its day first. With a zone times are UTC, without one as
    the clock showed them.

    Parameters
    ----------
    columns : sequence of (N,) Series
        Text; what is no date-time becomes NaT.
    hint : str
        What the header says in brackets, as dd/mm/yyyy; '' for nothing.
    path : Path
        For messages.

    Returns
    -------
    list of (N,) datetime64[us]

    Raises
    ------
    DataError
        A form that is not known, or dates that can mean two things.
    """
    read = [read_fields(column, _DATE_TIME) for column in columns]
    if not any(fields.matched.any() for fields in read):
        shown = next((repr(str(t)[:40]) for column in columns for t in column if str(t).strip()), "nothing")
        raise DataError(f"times as {shown} are not understood; expected {KNOWN}", path=path)
    day_first = _day_first(read, _first_match(columns)["sign"], hint, path)
    return [_stamps(fields, day_first=day_first) for fields in read]


def read_times_of_day(column: pd.Series, hint: str, path: Path) -> tuple[NDArray[np.float64], float]:
    """Read a column of times of day, or of time gone by, as seconds; NaN for what is none.

    Parameters
    ----------
    column : (N,) Series
        hh:mm:ss with or without fractions and AM or PM, or mm:ss with fractions.
    hint : str
        What the header says in brackets: hh:mm or mm:ss where that is not clear.
    path : Path
        For messages.

    Returns
    -------
    seconds : (N,) float
    period : float, s
        After which the clock starts from 0 again.

    Raises
    ------
    DataError
        Two numbers that can be hours and minutes or minutes and seconds, or no time at all.
    """
    fields = read_fields(column, _TIME_OF_DAY)
    if not fields.matched.any():
        raise DataError(f"no time of day was found; expected {KNOWN}", path=path)
    n, first = fields.numbers, int(np.argmax(fields.matched))
    hours, minutes, seconds, period = np.maximum(n["H"], 0), n["M"], n["S"], 86_400.0
    if n["H"][first] < 0:
        told = hint.casefold()
        whole = n["f"][first] < 0
        if whole and n["ap"][first] < 0 and "mm:ss" not in told and "hh:mm" not in told:
            raise DataError(
                f"times as '{minutes[first]}:{seconds[first]:02d}' can be hours and minutes or minutes and "
                "seconds: write [hh:mm] or [mm:ss] after the name of the column in [loadcells.columns] of "
                "test.toml",
                path=path,
            )
        if whole and (n["ap"][first] >= 0 or "hh" in told):
            hours, minutes, seconds = minutes, seconds, np.zeros_like(seconds)
        else:
            period = 3600.0
    good = fields.matched & (minutes < 60) & (seconds < 61)
    total = 3600 * _hours(hours, n["ap"]) + 60 * minutes + seconds
    return np.where(good, total + 1e-6 * np.maximum(n["f"], 0), np.nan), period


def _first_match(columns: Sequence[pd.Series]) -> dict[str, str]:
    """Parts of the first date-time."""
    for column in columns:
        for text in column:
            found = _DATE_TIME.fullmatch(str(text))
            if found:
                return found.groupdict("")
    return {"sign": ""}


def _hours(hours: NDArray[np.int32], half_day: NDArray[np.int32]) -> NDArray[np.int32]:
    """Hours from 0, given 0 for AM, 12 for PM and -1 for neither."""
    return np.where(half_day < 0, hours, hours % 12 + half_day)


def _stamps(fields: Fields, *, day_first: bool) -> Stamps:
    n = fields.numbers
    year_first, named = n["a_digits"] == 4, n["b_digits"] == 0
    year = np.where(year_first, n["a"], n["c"])
    year += np.where(np.where(year_first, 4, n["c_digits"]) < 4, _CENTURY, 0)
    month = n["b"] if day_first else np.where(year_first | named, n["b"], n["a"])
    day = np.where(year_first, n["c"], n["a"] if day_first else np.where(named, n["a"], n["b"]))
    clock = [np.maximum(n[name], 0) for name in ("M", "S", "f")]
    hour = _hours(np.maximum(n["H"], 0), n["ap"])
    good = fields.matched & (month >= 1) & (month <= 12) & (day >= 1)
    good &= (hour < 24) & (clock[0] < 60) & (clock[1] < 61)
    months = np.where(good, (year - 1970) * 12 + month - 1, 0).astype("datetime64[M]")
    days = months.astype("datetime64[D]") + np.where(good, day - 1, 0).astype("timedelta64[D]")
    good &= days.astype("datetime64[M]") == months  # there is no 31st of April
    zone = np.where(n["z"] < 0, 0, n["z"] - 1440)
    seconds = 3600 * hour + 60 * (clock[0] - zone) + clock[1]
    micro = 1_000_000 * seconds.astype(np.int64) + clock[2]
    stamps = days.astype("datetime64[us]") + micro.astype("timedelta64[us]")
    return np.where(good, stamps, np.datetime64("NaT", "us"))


def _day_first(read: Sequence[Fields], sign: str, hint: str, path: Path) -> bool:
    """Whether the day stands before the month, where the year and names of months do not tell it."""
    said = re.sub(r"[.\-\s]", "/", hint.casefold())
    told = [first for words, first in _ORDERS.items() if said.startswith(words)]
    dates = {date for fields in read for date in _open_dates(fields)}
    if told or not dates:
        return told[0] if told else True
    if sign == "-" and len(dates) > 1 and any(digits < 4 for *_, digits in dates):
        raise DataError(_two_ways(dates), path=path)
    day, month = any(a > 12 for a, *_ in dates), any(b > 12 for _, b, *_ in dates)
    if day and month:
        raise DataError(
            "dates with a day before the month and dates with a month before the day stand in one log; "
            "expected one order. Correct the dates",
            path=path,
        )
    if day or month:
        return day
    if len(dates) > 1 and sign != ".":
        raise DataError(_two_ways(dates), path=path)
    return True  # of a single date both readings give the same seconds


def _open_dates(fields: Fields) -> set[tuple[int, int, int, int]]:
    """The dates whose order is not told by themselves: first and second number, year, digits of the year."""
    n = fields.numbers
    rows = np.flatnonzero(fields.matched & (n["a_digits"] < 4) & (n["b_digits"] > 0))
    table = np.stack([n[name][rows] for name in ("a", "b", "c", "c_digits")], axis=1)
    changes = np.flatnonzero((np.diff(table, axis=0) != 0).any(axis=1)) + 1
    return {
        (int(a), int(b), int(c), int(d)) for a, b, c, d in table[[0, *changes.tolist()] if rows.size else []]
    }


def _two_ways(dates: set[tuple[int, int, int, int]]) -> str:
    a, b, c, _ = min(dates)
    return (
        f"dates as {a:02d}, {b:02d}, {c} can mean day and month or month and day: write [dd/mm/yyyy] or "
        "[mm/dd/yyyy] after the name of the column in [loadcells.columns] of test.toml, "
        'as in "Time [mm/dd/yyyy]"'
    )
