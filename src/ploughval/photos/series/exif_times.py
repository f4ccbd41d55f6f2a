"""Times of photographs from EXIF: zones, fractions of a second, false tags, a clock that stands still."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.photos.reading.exif import ExifTime
from ploughval.photos.series.times import Floats, FrameTimes, shorten
from ploughval.photos.series.whole_seconds import STAMP_STD_S, steady_times

LONGEST_TEST_S = 86_400.0
"""Photographs further from the others than this are not of the same test."""
FROZEN = 3
"""So many photographs with one time mean that the clock stood still, where nothing else explains it."""
REMEDY = 'Give times as a CSV file (file,time_s) or as {start_s, interval_s} in place of "exif".'


def exif_times(exif: Sequence[ExifTime | None], paths: Sequence[Path]) -> FrameTimes:
    """Times from DateTimeOriginal, SubSecTimeOriginal and OffsetTimeOriginal.

    Parameters
    ----------
    exif : sequence of ExifTime or None
        One a frame, in the order of names; None for a file that could not be read.
    paths : sequence of Path
        The files, for messages.

    Returns
    -------
    FrameTimes
        Seconds since the earliest photograph. Faults are photographs without a time, more than a day away
        from most others, with the time of one before it, or of a run in which the clock stood still. Where
        whole seconds make photographs share a time and a constant interval explains all of them, the times
        are those of the interval (:func:`ploughval.photos.series.whole_seconds.steady_times`).

    Raises
    ------
    DataError
        No photograph holds a time, all hold the same, no day holds most of them, or more than half of them
        have the time of another.
    """
    stamps, notes = stamps_s(exif)
    known = np.isfinite(stamps)
    if not known.any():
        raise DataError(
            f"none of {len(paths)} photographs holds DateTimeOriginal. {REMEDY}", path=paths[0].parent
        )
    if known.sum() > 1 and np.ptp(stamps[known]) == 0:
        raise DataError(
            f"all photographs hold the same DateTimeOriginal: the camera's clock stood still. {REMEDY}",
            path=paths[0].parent,
        )
    false = known & ~_of_one_day(stamps, exif, paths)
    faults = {}
    for k, tags in enumerate(exif):
        if tags is not None and not known[k]:
            faults[k] = f"holds no usable DateTimeOriginal (got {tags.date!r})"
        elif tags is not None and false[k]:
            faults[k] = (
                f"holds DateTimeOriginal {tags.date}, more than a day away from the series: a false tag"
            )
    stamps[false] = np.nan
    digits = np.array([_digits(tags) if tags is not None else 0 for tags in exif])
    std_s = np.where(np.isfinite(stamps), STAMP_STD_S / 10.0**digits, np.nan)
    if len(np.unique(stamps[np.isfinite(stamps)])) < np.isfinite(stamps).sum():
        explained = _explained(stamps, std_s, digits)
        if explained is not None:
            stamps, std_s, told = explained
            notes += told
        else:
            doubled = _doubled(stamps, paths)
            stamps[list(doubled)] = std_s[list(doubled)] = np.nan
            faults |= doubled
    return FrameTimes(stamps - np.nanmin(stamps), std_s, faults, tuple(notes))


def stamps_s(exif: Sequence[ExifTime | None]) -> tuple[Floats, list[str]]:
    """Seconds since 1970 of each photograph (F,), NaN where unknown, in UTC where all have a zone; notes."""
    dated = [e for e in exif if e is not None and e.date]
    zones = sum(bool(e.offset) for e in dated)
    notes = []
    if 0 < zones < len(dated):
        notes.append(f"{zones} of {len(dated)} photographs hold a time zone: none is used")
    seconds = np.array([_second(e, zoned=zones == len(dated)) if e is not None else np.nan for e in exif])
    digits = [_digits(e) if e is not None else 0 for e in exif]
    texts = [e.subsecond if e is not None and d else "0" for e, d in zip(exif, digits, strict=True)]
    stamps = seconds + np.array([float(f"0.{text}") for text in texts])
    if len({d for d in digits if d}) > 1 and _goes_back(stamps):
        counted = seconds + np.array([int(text) for text in texts]) / 10.0 ** max(digits)
        if not _goes_back(counted):
            notes.append(
                "fractions of a second have differing digits, and only as counts without leading zeros do "
                "they follow the order of names: they are read as such"
            )
            return counted, notes
    return stamps, notes


def _goes_back(stamps: Floats) -> bool:
    return bool((np.diff(stamps[np.isfinite(stamps)]) < 0).any())


def _second(tags: ExifTime, *, zoned: bool) -> float:
    """Whole seconds since 1970 of one photograph; NaN if the tag cannot be read."""
    try:
        moment = datetime.strptime(tags.date, "%Y:%m:%d %H:%M:%S").replace(tzinfo=UTC)
    except ValueError:
        return float("nan")
    zone = re.fullmatch(r"([+-])(\d\d):(\d\d)", tags.offset)
    if zoned and zone:
        shift = timedelta(hours=int(zone[2]), minutes=int(zone[3]))
        moment -= shift if zone[1] == "+" else -shift
    return moment.timestamp()


def _digits(tags: ExifTime) -> int:
    """Digits after the second."""
    return len(tags.subsecond) if re.fullmatch(r"[0-9]+", tags.subsecond) else 0


def _of_one_day(stamps: Floats, exif: Sequence[ExifTime | None], paths: Sequence[Path]) -> NDArray[np.bool_]:
    """The photographs (F,) that hang together with no gap of a day: more than half of them."""
    known = np.flatnonzero(np.isfinite(stamps))
    order = known[np.argsort(stamps[known], kind="stable")]
    groups = np.split(order, np.flatnonzero(np.diff(stamps[order]) > LONGEST_TEST_S) + 1)
    largest = max(groups, key=len)
    if 2 * len(largest) <= len(known):
        firsts = [f"{len(group)} from {_date(exif[group[0]])} on" for group in groups]
        raise DataError(
            f"photographs lie days apart: {shorten(firsts)}; the clock was set in between, or they are of "
            f"several tests. {REMEDY}",
            path=paths[0].parent,
        )
    found = np.zeros(len(stamps), bool)
    found[largest] = True
    return found


def _date(tags: ExifTime | None) -> str:
    return "" if tags is None else tags.date


def _explained(
    stamps: Floats, std_s: Floats, digits: NDArray[np.intp]
) -> tuple[Floats, Floats, list[str]] | None:
    """Times, their uncertainties and a note, where whole seconds at a constant interval explain all."""
    known = np.flatnonzero(np.isfinite(stamps))
    if digits[known].any() and (stamps[known] % 1).any():
        return None
    if (np.diff(stamps[known]) < 0).any():
        return None
    steady = steady_times(stamps[known], known)
    sharing = len(known) - len(np.unique(stamps[known]))
    if steady is None:
        return None
    # one copy in a series of whole seconds makes an interval that is shorter by its share
    off_whole = abs(steady.interval_s - round(steady.interval_s)) * (len(known) - 1)
    if sharing == 1 and off_whole > 0.5:
        return None
    time_s, uncertain = stamps.copy(), std_s.copy()
    time_s[known], uncertain[known] = steady.time_s, steady.std_s
    note = (
        f"the camera tells whole seconds, and {sharing} photographs share theirs with the one before; a "
        f"constant interval of {steady.interval_s:.4g} s ({steady.least_s:.4g} to {steady.most_s:.4g} s) "
        f"agrees with all: the times are its, with a standard uncertainty of up to {steady.std_s.max():.2g} s"
    )
    return time_s, uncertain, [note]


def _doubled(stamps: Floats, paths: Sequence[Path]) -> dict[int, str]:
    """Faults of the photographs that have the time of another; DataError where they are more than half."""
    known = np.flatnonzero(np.isfinite(stamps))
    values, count = np.unique(stamps[known], return_counts=True)
    faults: dict[int, str] = {}
    for value in values[count > 1]:
        alike = known[stamps[known] == value]
        head, tail = paths[alike[0]].name, paths[alike[-1]].name
        if len(alike) >= FROZEN:
            text = f"the clock stood still from {head} to {tail}: {len(alike)} photographs hold one time"
            faults |= dict.fromkeys(alike.tolist(), text)
        else:
            text = f"holds the same time as {head}: a copy of it, or taken within the clock's resolution"
            faults[int(alike[1])] = text
    if 2 * len(faults) > len(known):
        named = shorten([paths[k].name for k in faults])
        raise DataError(
            f"{len(faults)} of {len(known)} photographs have the time of another, and no constant interval "
            f"explains it: {named}. {REMEDY}",
            path=paths[0].parent,
        )
    return faults
