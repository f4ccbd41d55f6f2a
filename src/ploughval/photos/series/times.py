"""Times of photographs: what is known of them, how regular they are, and where two are the same."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.photos.series.order import CLOCK_STEP_S

Floats = NDArray[np.float64]

LEAST_INTERVALS = 6
"""Intervals that it takes to call a series regular."""
_REGULAR_SHARE = 0.75
_LIKE_THE_MIDDLE = 0.1
_SHOWN = 5


@dataclass(frozen=True, slots=True)
class FrameTimes:
    """Times of the frames in the order of their names, and what was wrong with some of them.

    time_s (F,) float, s, NaN where unknown; its standard uncertainty std_s (F,) float, s; faults by frame;
    notes on what belongs to no frame; missing photographs that have a time.
    """

    time_s: Floats
    std_s: Floats
    faults: dict[int, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()


def exact(time_s: Floats) -> Floats:
    """Standard uncertainties (F,) of times that are taken as given: 0, NaN where there is no time."""
    return np.where(np.isfinite(time_s), 0.0, np.nan)


def interval_times(count: int, start_s: float, interval_s: float) -> FrameTimes:
    """Times of `count` photographs taken at a constant interval, s."""
    time_s = start_s + interval_s * np.arange(count, dtype=float)
    return FrameTimes(time_s, exact(time_s))


def gaps(time_s: Floats, std_s: Floats, names: Sequence[str]) -> list[str]:
    """Where photographs are missing from a series that is regular otherwise.

    Parameters
    ----------
    time_s, std_s : (F,) float, s
        Times in their order and their standard uncertainties.
    names : sequence of str
        The photographs, for the text.

    Returns
    -------
    list of str
        One text a gap: how long it is, what is usual, and how many photographs that makes. Empty where three
        quarters of the intervals are not alike.
    """
    known = np.flatnonzero(np.isfinite(time_s))
    step = np.diff(time_s[known])
    if len(step) < LEAST_INTERVALS:
        return []
    usual = float(np.median(step))
    slack = _LIKE_THE_MIDDLE * usual + 2 * np.hypot(std_s[known][1:], std_s[known][:-1])
    if usual <= 0 or np.mean(np.abs(step - usual) <= slack) < _REGULAR_SHARE:
        return []
    texts = []
    for k in np.flatnonzero(step > 1.5 * usual + slack):
        between = known[k + 1] - known[k] - 1
        count = round(step[k] / usual) - 1 - between
        if count < 1:
            continue
        text = f"{step[k]:.6g} s pass from {names[known[k]]} to {names[known[k + 1]]}, "
        text += f"{usual:.6g} s are usual: "
        rest = (step[k] - usual + CLOCK_STEP_S / 2) % CLOCK_STEP_S - CLOCK_STEP_S / 2
        if step[k] > CLOCK_STEP_S / 2 and abs(rest) <= usual:
            texts.append(f"{text}the clock may have been set, or {count} photographs are missing")
        else:
            texts.append(f"{text}{count} photograph{'s' if count > 1 else ''} may be missing")
    more = [f"and {len(texts) - _SHOWN} more such gaps"] if len(texts) > _SHOWN else []
    return texts[:_SHOWN] + more


def refuse_doubled(time_s: Floats, names: Sequence[str], source: Path) -> None:
    """Refuse two frames at the same time.

    Raises
    ------
    DataError
        Naming the pairs: order and displacement of such frames cannot be told.
    """
    order = np.argsort(time_s, kind="stable")
    same = np.flatnonzero(np.diff(time_s[order]) == 0)
    if same.size:
        pairs = [f"{names[order[k]]} and {names[order[k + 1]]} at {time_s[order[k]]:g} s" for k in same]
        raise DataError(
            f"photographs with the same time: {shorten(pairs)}. Remove copies; where the camera writes no "
            "fractions of a second, give times as a CSV file or as {start_s, interval_s}.",
            path=source,
        )


def shorten(items: Sequence[str]) -> str:
    """The first few of many, and how many more there are."""
    more = f" and {len(items) - _SHOWN} more" if len(items) > _SHOWN else ""
    return ", ".join(items[:_SHOWN]) + more
