"""Clocks of local time that were set by an hour at night."""

import numpy as np
from numpy.typing import NDArray

_HOUR_US = 3_600_000_000


def without_summer_time(
    stamps: NDArray[np.datetime64],
) -> tuple[NDArray[np.datetime64], list[tuple[int, int]]]:
    """Times taken on as if the clock had not been set by an hour.

    A step of an hour, at a full hour from midnight to 4 o'clock, between rows that follow one another by less
    than a minute, is a change of summer time.

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
    usual = int(np.median(np.abs(steps))) if steps.size else _HOUR_US
    if usual >= _HOUR_US // 60:
        return stamps, []
    near_us = max(3 * usual, 100_000)
    changes = []
    for k in np.flatnonzero(np.abs(np.abs(steps) - _HOUR_US) <= near_us).tolist():
        hour, within = divmod(int(moments[k]) % (24 * _HOUR_US), _HOUR_US)
        if hour <= 3 and _HOUR_US - within <= near_us:
            changes.append((int(good[k + 1]), 1 if steps[k] > 0 else -1))
    stamps = stamps.copy()
    for place, sign in changes:
        stamps[place:] -= np.timedelta64(sign * _HOUR_US, "us")
    return stamps, changes
