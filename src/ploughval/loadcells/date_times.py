"""Date-times and times of day written as text, read to numpy times; a date that can mean two is refused."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.errors import DataError

Stamps = NDArray[np.datetime64]

_DATE = r"(?P<a>\d{1,4})(?P<s>[./-])(?P<b>\d{1,2}|[A-Za-z]{3,9})(?P=s)(?P<c>\d{2,4})"
_TIME = r"(?P<H>\d{1,2}):(?P<M>\d{2})(?P<S>:\d{2}(?P<f>[.,]\d+)?)?(?P<ap> ?[AaPp][Mm])?"
_DATE_TIME = re.compile(rf"{_DATE}(?:(?P<join>[T ,_]\s*){_TIME}(?P<z> ?(?:Z|[+-]\d\d:?\d\d))?)?")
_TIME_OF_DAY = re.compile(r"(?:\d+:)?\d{1,2}:\d{2}(?P<f>[.,]\d+)?(?P<ap> ?[AaPp][Mm])?")
_KNOWN = (
    "2026-11-27 10:15:03.25, 27.11.2026 10:15:03,25, 11/27/2026 10:15:03 AM or 10:15:03.25 "
    "(a date may stand in a column of its own: columns.date)"
)
_ORDERS = {"dd/mm": True, "d/m": True, "mm/dd": False, "m/d": False}


@dataclass(frozen=True, slots=True)
class _Form:
    """How date-times are written: the parts in their order, with what stands between them."""

    year_first: bool
    short_year: bool
    sign: str
    month: str  # %m, %b or %B
    join: str
    twelve: bool
    zone: bool

    def formats(self, *, day_first: bool) -> list[str]:
        """Formats for strptime, with and without fractions and seconds."""
        year = "%y" if self.short_year else "%Y"
        parts = [year, self.month, "%d"] if self.year_first else ["%d", self.month, year]
        if not self.year_first and not day_first:
            parts = [self.month, "%d", year]
        date = self.sign.join(parts)
        if not self.join:
            return [date]
        hour, tail = ("%I", " %p") if self.twelve else ("%H", "")
        return [
            f"{date} {hour}:%M{seconds}{tail}{' %z' if self.zone else ''}"
            for seconds in (":%S.%f", ":%S", "")
        ]


def is_date_time(text: str) -> bool:
    """Whether a text begins with a date in one of the forms that are read.

    >>> is_date_time("27.11.2026 10:15:03,25"), is_date_time("10:15:03"), is_date_time("27.5")
    (True, False, False)
    """
    return _DATE_TIME.fullmatch(text.strip()) is not None


def is_time_of_day(text: str) -> bool:
    """Whether a text is hours, minutes and seconds, or minutes and seconds.

    >>> is_time_of_day("10:15:03.25"), is_time_of_day("9:05 PM"), is_time_of_day("10.15")
    (True, True, False)
    """
    return _TIME_OF_DAY.fullmatch(text.strip()) is not None


def read_date_times(columns: Sequence[pd.Series], hint: str, path: Path) -> list[Stamps]:
    """Read columns of date-times of one form; they may come from several files.

    Whether the day or the month stands first is told by ``hint``, by a part above 12, or does not matter as
    all dates are the same; a date with points has its day first. With a zone times are UTC, without one as
    the clock showed them.

    Parameters
    ----------
    columns : sequence of (N,) Series
        Text; what is not in the form of the first becomes NaT.
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
    texts = [_clean(column) for column in columns]
    sample = next((t for text in texts for t in text.head(1000) if is_date_time(t)), None)
    found = None if sample is None else _DATE_TIME.fullmatch(sample)
    if found is None:
        shown = next((repr(t[:40]) for text in texts for t in text if t), "nothing")
        raise DataError(f"times as {shown} are not understood; expected {_KNOWN}", path=path)
    form = _form(found)
    day_first = True
    if not form.year_first and form.month == "%m":
        day_first = _day_first(texts, form, hint, path)
    formats = form.formats(day_first=day_first)
    return [_stamps(text, formats, zone=form.zone, twelve=form.twelve) for text in texts]


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
        Two numbers that can be hours and minutes or minutes and seconds.
    """
    text = _clean(column)
    found = next((m for t in text.head(1000) if (m := _TIME_OF_DAY.fullmatch(t))), None)
    if found is None:
        raise DataError(f"no time of day was found; expected {_KNOWN}", path=path)
    if found["ap"]:
        midnight = np.datetime64("2000-01-01", "us")
        dated = "2000-01-01 " + text
        formats = [f"%Y-%m-%d %I:%M{s} %p" for s in (":%S.%f", ":%S", "")]
        return _seconds(_stamps(dated, formats, zone=False, twelve=True) - midnight), 86_400.0
    text = text.str.replace(",", ".", regex=False)
    period = 86_400.0
    if found[0].count(":") == 1:
        told = hint.casefold()
        if not found["f"] and "mm:ss" not in told and "hh:mm" not in told:
            raise DataError(
                f"times as {found[0]!r} can be hours and minutes or minutes and seconds: write [hh:mm] or "
                "[mm:ss] after the name of the column in [loadcells.columns] of test.toml",
                path=path,
            )
        minutes = bool(found["f"]) or "hh" not in told
        text, period = ("00:" + text, 3600.0) if minutes else (text + ":00", 86_400.0)
    spans = pd.to_timedelta(text, errors="coerce").to_numpy(dtype="timedelta64[us]")
    return _seconds(spans), period


def without_summer_time(stamps: Stamps) -> tuple[Stamps, list[tuple[int, int]]]:
    """Times of a clock that was set by an hour at night taken on as if it had not been.

    Parameters
    ----------
    stamps : (N,) datetime64[us]
        As the clock showed them, without a zone.

    Returns
    -------
    stamps : (N,) datetime64[us]
    changes : list of (place, hours)
        First row of the new time, and the hours by which the clock was set.
    """
    good = np.flatnonzero(~np.isnat(stamps))
    moments = stamps[good].astype(np.int64)
    steps = np.diff(moments)
    if steps.size == 0:
        return stamps, []
    hour = 3_600_000_000
    usual = max(int(np.median(np.abs(steps))), 0)
    near = np.abs(np.abs(steps) - hour) <= min(max(3 * usual, 100_000), hour // 60)
    changes = []
    for k in np.flatnonzero(near):
        sign = 1 if steps[k] > 0 else -1
        before = moments[k] % (24 * hour)
        at_night = before // hour <= 3 and hour - before % hour <= max(3 * usual, 100_000)
        if at_night and usual < hour // 60:
            changes.append((int(good[k + 1]), sign))
    stamps = stamps.copy()
    for place, sign in changes:
        stamps[place:] -= np.timedelta64(sign * hour, "us")
    return stamps, changes


def _clean(column: pd.Series) -> pd.Series:
    return column.astype(object).where(column.notna(), "").astype(str).str.strip().str.strip('"')


def _seconds(spans: NDArray[np.timedelta64]) -> NDArray[np.float64]:
    return np.where(np.isnat(spans), np.nan, spans.astype("timedelta64[us]").astype(np.int64) * 1e-6)


def _form(found: re.Match[str]) -> _Form:
    month = "%m" if found["b"].isdecimal() else ("%b" if len(found["b"]) == 3 else "%B")
    year_first = len(found["a"]) == 4
    short = len(found["a"] if year_first else found["c"]) == 2
    return _Form(
        year_first, short, found["s"], month, found["join"] or "", bool(found["ap"]), bool(found["z"])
    )


def _stamps(text: pd.Series, formats: Sequence[str], *, zone: bool, twelve: bool) -> Stamps:
    """Parse with the first format, what is left over with the others."""
    plain = text.str.replace(",", ".", regex=False)
    if len(formats) > 1:
        plain = plain.str.replace(r"^([^T :]+?)[T ._]\s*(?=\d+:)", r"\1 ", regex=True)
    if zone:
        plain = plain.str.replace(r" ?(Z|[+-]\d\d:?\d\d)$", r" \1", regex=True)
    if twelve:
        plain = plain.str.replace(r" ?([AaPp][Mm])", r" \1", regex=True)
    stamps = np.full(len(text), np.datetime64("NaT"), dtype="datetime64[us]")
    left = np.ones(len(text), dtype=bool)
    for pattern in formats:
        if left.any():
            parsed = pd.to_datetime(plain[left], format=pattern, errors="coerce", utc=zone)
            stamps[left] = parsed.dt.tz_localize(None).to_numpy(dtype="datetime64[us]")
            left = np.isnat(stamps)
    return stamps


def _day_first(texts: Sequence[pd.Series], form: _Form, hint: str, path: Path) -> bool:
    """Whether the day stands before the month."""
    said = re.sub(r"[.\-\s]", "/", hint.casefold())
    told = [first for words, first in _ORDERS.items() if said.startswith(words)]
    dates = {
        (int(m["a"]), int(m["b"]), m["c"])
        for text in texts
        for t in text.str.slice(0, 10).unique()
        if (m := re.match(_DATE, t)) and m["b"].isdecimal()
    }
    if told:
        return told[0]
    if form.short_year and form.sign == "-" and len(dates) > 1:
        raise DataError(_two_ways(dates), path=path)
    day, month = any(a > 12 for a, _, _ in dates), any(b > 12 for _, b, _ in dates)
    if day and month:
        raise DataError(
            "dates with a day before the month and dates with a month before the day stand in one log; "
            "expected one order. Correct the dates",
            path=path,
        )
    if day or month:
        return day
    if len(dates) > 1 and form.sign != ".":
        raise DataError(_two_ways(dates), path=path)
    return True  # of a single date both readings give the same seconds


def _two_ways(dates: set[tuple[int, int, str]]) -> str:
    a, b, c = min(dates)
    return (
        f"dates as {a:02d}, {b:02d}, {c} can mean day and month or month and day: write [dd/mm/yyyy] or "
        "[mm/dd/yyyy] after the name of the column in [loadcells.columns] of test.toml, "
        'as in "Time [mm/dd/yyyy]"'
    )
