"""The logs of a folder: which is the test, in one file or several, and which are runs in the empty box."""

import logging
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import PloughvalError
from ploughval.loadcells.logs import read_log
from ploughval.loadcells.motion import find_motion
from ploughval.photos.series.order import natural_key
from ploughval.run.setup.log_words import WANTED
from ploughval.run.setup.survey_tables import TableFile
from ploughval.scene import LogColumns

log = logging.getLogger(__name__)

Floats = NDArray[np.float64]

_EMPTY_SHARE = 0.5  # a run whose load is less than this share of the largest may be one without sand
_LEAST_ROWS = 10
_FOLLOWS_SHARE = 0.05  # of the travel, by which a file may begin elsewhere than the one before has ended


@dataclass(frozen=True, slots=True, eq=False)
class LogFound:
    """The log of the test.

    Attributes
    ----------
    names : tuple of str
        Its files, relative to the folder.
    header : tuple of str
        Names of its columns; ``columns`` those that are recognised, by the key of [loadcells.columns].
    rest_s, speed_mm_s, travel_mm : what its displacement says; None where it does not
    rate_hz : rows a second, by its times
    time_s, u_mm : (N,) float, empty where it could not be read
    trouble : what stands against it
    notes : how it was read
    """

    names: tuple[str, ...]
    header: tuple[str, ...]
    columns: dict[str, str]
    rest_s: tuple[float, float] | None = None
    speed_mm_s: float | None = None
    travel_mm: float | None = None
    rate_hz: float | None = None
    time_s: Floats | None = None
    u_mm: Floats | None = None
    trouble: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Logs:
    """The log of the test, files that by their loads may be empty runs, and others that are left over."""

    log: LogFound | None = None
    empty_by_load: tuple[tuple[str, float], ...] = ()  # name, load over that of the test
    left: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class _Run:
    """A log that can be read; ``load``: how far the cells' difference goes, in its own unit."""

    table: TableFile
    time_s: Floats
    u_mm: Floats
    load: float
    notes: tuple[str, ...]


def find_logs(tables: Sequence[TableFile], folder: Path) -> Logs:
    """Sort the logs of a folder, without those known to be of an empty box."""
    if not tables:
        return Logs()
    most = max(len(t.columns) for t in tables)
    best = [t for t in tables if len(t.columns) == most]
    header = Counter(t.names for t in best).most_common(1)[0][0]
    alike = sorted((t for t in best if t.names == header), key=lambda t: natural_key(t.path.as_posix()))
    others = tuple(_name(t.path, folder) for t in tables if t not in alike)
    if most < len(WANTED):
        return Logs(_unread(alike[:1], folder), left=(*others, *(_name(t.path, folder) for t in alike[1:])))
    runs, trouble = [], ""
    for table in alike:
        try:
            runs.append(_read(table))
        except PloughvalError as error:
            log.warning("%s", error)
            trouble = trouble or str(error)
            others = (*others, _name(table.path, folder))
    if not runs:
        return Logs(_unread(alike[:1], folder, trouble), left=others[1:])
    if len(runs) > 1 and _follow_on(runs):
        return Logs(_joined(runs, folder), left=others)
    test = max(runs, key=lambda run: run.load)
    rest = [run for run in runs if run is not test]
    light = [run for run in rest if run.load < _EMPTY_SHARE * test.load]
    return Logs(
        _described(test, (_name(test.table.path, folder),)),
        tuple((_name(run.table.path, folder), run.load / test.load) for run in light),
        (*others, *(_name(run.table.path, folder) for run in rest if run not in light)),
    )


def _name(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()


def _unread(tables: Sequence[TableFile], folder: Path, trouble: str = "") -> LogFound:
    first = tables[0]
    return LogFound((_name(first.path, folder),), first.names, first.columns, trouble=trouble)


def _read(table: TableFile) -> _Run:
    """Read a log; its load is the largest change of the cells' difference, strays left out."""
    found = read_log(table.path, LogColumns(**table.columns))
    data = found.data
    apart = (data["moment_upper"] - data["moment_lower"]).to_numpy()
    known = apart[np.isfinite(apart)]
    load = 0.0
    if known.size >= _LEAST_ROWS:
        start = np.median(known[: max(_LEAST_ROWS, known.size // 50)])
        load = float(np.percentile(np.abs(known - start), 99.0))
    return _Run(table, data["time_s"].to_numpy(), data["displacement_mm"].to_numpy(), load, found.notes)


def _follow_on(runs: Sequence[_Run]) -> bool:
    """Whether each file begins where the one before has ended, and later or in the middle of the travel.

    Clocks may start anew in each file (date-times count from a file's first row): then a travel that goes on
    from where no run starts is what tells.
    """
    travel = max(float(np.nanmax(r.u_mm)) for r in runs) - min(float(np.nanmin(r.u_mm)) for r in runs)
    near = _FOLLOWS_SHARE * travel
    start = float(runs[0].u_mm[np.isfinite(runs[0].u_mm)][0])
    later, away = True, False
    for before, after in pairwise(runs):
        ends, begins = (r.u_mm[np.isfinite(r.u_mm)] for r in (before, after))
        if abs(begins[0] - ends[-1]) > near:
            return False
        later &= bool(after.time_s[0] > before.time_s[-1])
        away |= abs(float(ends[-1]) - start) > near
    return later or away


def _joined(runs: Sequence[_Run], folder: Path) -> LogFound:
    """Several files as one log."""
    names = tuple(_name(run.table.path, folder) for run in runs)
    first = runs[0]
    try:
        found = read_log([run.table.path for run in runs], LogColumns(**first.table.columns))
    except PloughvalError as error:
        return LogFound(names, first.table.names, first.table.columns, trouble=str(error))
    time_s, u_mm = (found.data[key].to_numpy() for key in ("time_s", "displacement_mm"))
    return _described(_Run(first.table, time_s, u_mm, first.load, found.notes), names)


def _described(run: _Run, names: tuple[str, ...]) -> LogFound:
    """What the displacement of a log says of rest and motion."""
    time, u, table = run.time_s, run.u_mm, run.table
    steps = np.diff(time)
    rate = 1 / float(np.median(steps[steps > 0])) if (steps > 0).any() else None
    motion = find_motion(u)
    if motion is None:
        return LogFound(
            names, table.names, table.columns, rate_hz=rate, time_s=time, u_mm=u, notes=run.notes,
            trouble="the displacement does not move",
        )  # fmt: skip
    rest = None
    if motion.rest_end > 1:
        start, end = np.ceil(100 * time[0]) / 100, np.floor(100 * time[motion.rest_end - 1]) / 100
        rest = (float(start), float(end)) if start < end else None
    steady = slice(motion.steady_start, motion.steady_end)
    kept = np.isfinite(time[steady]) & np.isfinite(u[steady])
    speed = abs(float(np.polyfit(time[steady][kept], u[steady][kept], 1)[0])) if kept.sum() > 2 else None
    return LogFound(
        names, table.names, table.columns, rest, speed, abs(motion.travel_mm), rate, time, u, notes=run.notes
    )
