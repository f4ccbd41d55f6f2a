"""Several files that make up one log: their order, overlaps, and clocks that start anew in each file."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.logs.rows import FileRows, name_rows

Floats = NDArray[np.float64]
Columns = Mapping[str, Floats]
_ANEW = 0.5  # a file that begins this part of the one before earlier than its end has a clock of its own


def join_files(
    parts: Sequence[Columns], rows: Sequence[FileRows]
) -> tuple[dict[str, Floats], tuple[FileRows, ...], list[str]]:
    """Put the columns of several files one after the other.

    Files follow one another in time where their times do not overlap, else as they are given. A file that
    begins before the one before has ended repeats its last rows, which are dropped; one that begins more
    than half the length of the one before earlier has a clock that started anew: its times go on one step
    after the end of the one before.

    Parameters
    ----------
    parts : sequence of mapping of (N,) float
        Columns of each file, time_s among them, s; in the order to take where times do not tell.
    rows : sequence of FileRows
        Where the rows of each file stand.

    Returns
    -------
    columns : dict of (N,) float
    rows : tuple of FileRows
        In the order in which the files now stand.
    faults : list of str
    """
    faults: list[str] = []
    used = [k for k, part in enumerate(parts) if np.isfinite(part["time_s"]).any()]
    for k in sorted(set(range(len(parts))) - set(used)):
        faults.append(f"{rows[k].name} holds no row with a time: left out")
    spans = {k: _span(parts[k]["time_s"]) for k in used}
    by_time = sorted(used, key=lambda k: spans[k])
    if all(spans[a][1] <= spans[b][0] for a, b in pairwise(by_time)):
        if by_time != used:
            faults.append(f"files put in order of time: {', '.join(rows[k].name for k in by_time)}")
        used = by_time
    kept: list[dict[str, Floats]] = []
    places: list[FileRows] = []
    for k in used:
        part, where = dict(parts[k]), rows[k]
        if kept:
            part, where = _follow(kept[-1]["time_s"], part, where, faults)
        if where.count:
            kept.append(part)
            places.append(where)
    names = kept[0] if kept else parts[0]
    columns = {name: np.concatenate([part[name] for part in kept or parts[:1]]) for name in names}
    return columns, tuple(places or rows[:1]), faults


def _span(time: Floats) -> tuple[float, float]:
    return float(np.nanmin(time)), float(np.nanmax(time))


def _follow(
    before: Floats, part: dict[str, Floats], where: FileRows, faults: list[str]
) -> tuple[dict[str, Floats], FileRows]:
    """A file's columns as they go on after the times of the file before."""
    (start, end), begin = _span(before), _span(part["time_s"])[0]
    if begin > end:
        return part, where
    if end - begin > _ANEW * (end - start):
        steps = np.diff(part["time_s"])
        step = float(np.nanmedian(steps)) if np.isfinite(steps).any() else 0.0
        shift = end + step - begin
        part["time_s"] = part["time_s"] + shift
        faults.append(
            f"the clock starts anew in {where.name}: its times moved on by {shift:.9g} s, to go on one step "
            "after the file before (how long the pause was is not known)"
        )
        return part, where
    repeated = part["time_s"] <= end
    shown = name_rows(np.flatnonzero(repeated), [where])
    faults.append(f"{where.name} {shown} from before the end of the file before ({end:.9g} s): dropped")
    return {name: column[~repeated] for name, column in part.items()}, where.take(np.flatnonzero(~repeated))
