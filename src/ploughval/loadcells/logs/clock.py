"""The times of logs in seconds: from seconds or other units, sample numbers, date-times or times of day."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.loadcells.logs.date_times import (
    KNOWN,
    is_date_time,
    is_time_of_day,
    read_date_times,
    read_times_of_day,
)
from ploughval.loadcells.logs.raw import RawLog
from ploughval.loadcells.logs.rows import name_rows
from ploughval.loadcells.logs.summer_time import without_summer_time
from ploughval.loadcells.logs.text_table import numbers
from ploughval.loadcells.logs.units import counts_samples, unit_factor

Floats = NDArray[np.float64]
_LATEST_S = 1e12
_LONG_STEP_S = 9.0  # a step above this in a column that names no unit makes the unit doubtful


class Kind(Enum):
    """What the times of a log are."""

    ROWS = "no times"
    SAMPLES = "sample numbers"
    NUMBERS = "numbers"
    DATE_TIMES = "date-times"
    TIMES_OF_DAY = "times of day"


@dataclass(frozen=True, slots=True)
class Clock:
    """Seconds of the rows of each file, and what there is to say of them.

    Attributes
    ----------
    seconds : tuple of (N,) float, s
        NaN where a row has no time.
    kind : Kind
    faults, notes : tuple of str
    """

    seconds: tuple[Floats, ...]
    kind: Kind
    faults: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def read_clock(logs: Sequence[RawLog], *, rate_hz: float | None) -> Clock:
    """Times of all files of one log, s.

    Numbers are in the unit that the header names (seconds where it names none) and keep their zero. Sample
    numbers, or rows where there are no times, are divided by ``rate_hz``. Date-times and times of day count
    from the first row of the log; times of day go on after midnight.

    Parameters
    ----------
    logs : sequence of RawLog
        The files of the log.
    rate_hz : float or None
        Rows a second.

    Returns
    -------
    Clock

    Raises
    ------
    DataError
        Times that cannot be read, can mean two things, or are of different kinds; a rate that is missing, or
        contradicts the times.
    """
    kinds = [_kind(log, rate_hz) for log in logs]
    for log, kind in zip(logs, kinds, strict=True):
        if kind is not kinds[0]:
            raise DataError(
                f"holds {kind.value}, {logs[0].path.name} holds {kinds[0].value}; expected one kind of times "
                "in all files of a log",
                path=log.path,
            )
    if rate_hz is not None and kinds[0] in (Kind.DATE_TIMES, Kind.TIMES_OF_DAY):
        raise DataError(
            f"holds {kinds[0].value}, and rate_hz = {rate_hz:g} is given: take rate_hz out, or let "
            'columns.time_s name a column of sample numbers (or "" to count the rows)',
            path=logs[0].path,
        )
    if kinds[0] is Kind.DATE_TIMES:
        return _date_times(logs)
    if kinds[0] is Kind.TIMES_OF_DAY:
        return _times_of_day(logs)
    if kinds[0] is Kind.ROWS:
        seconds, start = [], 0
        for log in logs:
            rows = start + log.rows.numbers()  # a row that was dropped took its time as well
            start = int(rows[-1]) + 1 if rows.size else start
            seconds.append(rows / (rate_hz or 1.0))
        note = f"time: rows counted at {rate_hz:g} a second"
        return Clock(tuple(seconds), Kind.ROWS, (), (note,))
    return _numbers(logs, kinds[0], rate_hz)


def _kind(log: RawLog, rate_hz: float | None) -> Kind:
    if log.time is None:
        return Kind.ROWS
    named = log.headers.get("time_s", "")
    if log.time.dtype.kind == "M":
        return Kind.DATE_TIMES
    if log.date is not None:
        return Kind.DATE_TIMES
    if log.time.dtype.kind not in "fiu":
        words = [str(t).strip().strip('"') for t in log.time[log.time.notna()].head(1000)]
        for kind, test in ((Kind.DATE_TIMES, is_date_time), (Kind.TIMES_OF_DAY, is_time_of_day)):
            if words and 2 * sum(map(test, words)) > len(words):
                return kind
        count = int(np.isfinite(numbers(log.time, ",")).sum())
        if words and 2 * count < len(log.time[log.time.notna()]):
            raise DataError(f"times as {words[0][:40]!r} are not understood; expected {KNOWN}", path=log.path)
    told = counts_samples(named, log.units.get("time_s", ""))
    if told and rate_hz is None:
        raise DataError(
            f"column {named!r} counts samples; expected [loadcells] rate_hz, the samples a second, beside it",
            path=log.path,
        )
    return Kind.SAMPLES if rate_hz is not None else Kind.NUMBERS


def _numbers(logs: Sequence[RawLog], kind: Kind, rate_hz: float | None) -> Clock:
    seconds, faults, notes = [], list[str](), list[str]()
    for log in logs:
        name, unit = log.headers.get("time_s", "time"), log.units.get("time_s", "")
        written = numbers(pd.Series() if log.time is None else log.time, ",")
        factor = unit_factor(unit, "time") if unit else None
        if kind is Kind.SAMPLES:
            _check_samples(written, name, factor, rate_hz, log.path)
            factor = 1.0
            written = written / (rate_hz or 1.0)
            notes.append(f"time: {name!r} counts samples, {rate_hz:g} a second")
        elif factor is None:
            if unit:
                faults.append(f"the unit {unit!r} of the column {name!r} is not known: read as seconds")
            factor = 1.0
            faults += _doubts(written, name)
        elif factor != 1.0:
            notes.append(f"time: {name!r} is in {unit}, times {factor:g} for s")
        # A quotient keeps decimal numbers what they are: 23.682, not 23.682000000000002.
        scaled = written
        if factor != 1:
            scaled = written / round(1 / factor) if factor < 1 else written * factor
        scaled[~(np.abs(scaled) < _LATEST_S)] = np.nan
        seconds.append(scaled)
    return Clock(tuple(seconds), kind, tuple(dict.fromkeys(faults)), tuple(dict.fromkeys(notes)))


def _check_samples(
    written: Floats, name: str, factor: float | None, rate_hz: float | None, path: Path
) -> None:
    finite = written[np.isfinite(written)]
    whole = bool((finite[:1000] == np.round(finite[:1000])).all())
    if factor is not None or not whole:
        why = "is in a unit of time" if factor is not None else "holds no whole numbers"
        raise DataError(
            f"rate_hz = {rate_hz:g} asks for sample numbers, but column {name!r} {why}: take rate_hz out, or "
            'let columns.time_s name a column of sample numbers (or "" to count the rows)',
            path=path,
        )


def _doubts(written: Floats, name: str) -> list[str]:
    """Whether whole numbers in large steps may be milliseconds or samples."""
    steps = np.diff(written[:10_000])
    steps = steps[np.isfinite(steps)]
    if steps.size < 2 or float(np.median(steps)) < _LONG_STEP_S or (steps != np.round(steps)).any():
        return []
    rise = float(np.median(steps))
    return [
        f"column {name!r} names no unit and rises by {rise:g} a row: read as seconds. If it "
        f'is in milliseconds, write time_s = "{name} [ms]" in [loadcells.columns]'
    ]


def _date_times(logs: Sequence[RawLog]) -> Clock:
    path = logs[0].path
    times = [log.time for log in logs if log.time is not None]
    if all(time.dtype.kind == "M" for time in times):
        stamps = [time.to_numpy(dtype="datetime64[us]") for time in times]
        local = False
    else:
        dates = [time if log.date is None else log.date for log, time in zip(logs, times, strict=True)]
        hint = logs[0].units.get("date") or logs[0].units.get("time_s", "")
        stamps = [
            _on_day(log, stamp) for log, stamp in zip(logs, read_date_times(dates, hint, path), strict=True)
        ]
        local = True
    faults: list[str] = []
    if local:
        for k, log in enumerate(logs):
            stamps[k], changes = without_summer_time(stamps[k])
            for place, hours in changes:
                row = name_rows(np.array([place]), [log.rows])
                faults.append(
                    f"the clock was set {'on' if hours > 0 else 'back'} by an hour at {log.path.name} {row}, "
                    "as for summer time: later times put right by that"
                )
    first = [s[~np.isnat(s)][:1] for s in stamps]
    starts = np.concatenate(first)
    if starts.size == 0:
        raise DataError("holds no date-time that can be read", path=path)
    zero = first[0][0] if len(logs) == 1 else starts.min()
    seconds = [
        np.where(np.isnat(s), np.nan, (s - zero).astype("timedelta64[us]").astype(np.int64) * 1e-6)
        for s in stamps
    ]
    for column in seconds:
        column[~(np.abs(column) < _LATEST_S)] = np.nan
    shown = str(zero).replace("T", " ").rstrip("0").rstrip(".")
    note = f"time: date-times, in seconds from the log's first row at {shown}"
    return Clock(tuple(seconds), Kind.DATE_TIMES, tuple(faults), (note,))


def _on_day(log: RawLog, stamps: NDArray[np.datetime64]) -> NDArray[np.datetime64]:
    """Date-times of a log whose times of day stand in a column beside the dates."""
    if log.date is None or log.time is None:
        return stamps
    seconds, _ = read_times_of_day(log.time, log.units.get("time_s", ""), log.path)
    known = np.isfinite(seconds)
    spans = (1e6 * np.where(known, seconds, 0.0)).round().astype("timedelta64[us]")
    return np.where(known, stamps + spans, np.datetime64("NaT", "us"))


def _times_of_day(logs: Sequence[RawLog]) -> Clock:
    read = [
        read_times_of_day(log.time, log.units.get("time_s", ""), log.path)
        for log in logs
        if log.time is not None
    ]
    counts = np.cumsum([seconds.size for seconds, _ in read])[:-1]
    seconds, period = np.concatenate([s for s, _ in read]), read[0][1]
    good = np.isfinite(seconds)
    if not good.any():
        raise DataError("holds no time of day that can be read", path=logs[0].path)
    notes = []
    shown = float(seconds[good][0])
    if (np.abs(np.diff(seconds[good])) > 0.5 * period).any():
        turns = np.unwrap(seconds[good], period=period)
        seconds[good] += period * np.round((turns - seconds[good]) / period)
        notes.append(f"the time of day starts from 0 again after {period:g} s: later times go on")
    seconds -= shown
    hours, rest = divmod(shown, 3600)
    notes.insert(
        0,
        f"time: times of day, in seconds from the log's first row at "
        f"{hours:02.0f}:{rest // 60:02.0f}:{rest % 60:06.3f}",
    )
    return Clock(tuple(np.split(seconds, counts)), Kind.TIMES_OF_DAY, (), tuple(notes))
