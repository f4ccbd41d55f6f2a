"""One log as arrays, with what its displacement says of rest and motion."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.logs import Log
from ploughval.loadcells.motion import Motion, find_motion
from ploughval.loadcells.pauses import standing

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)  # no slots: what takes a walk through the rows is kept once found
class RunLog:
    """One run.

    ``time_s`` (N,); ``u_mm`` (N,); ``readings`` (2, N) of the (upper, lower) cell in the log's unit;
    ``motion`` None where the displacement shows none; ``unloaded_s`` the time from which the cells are known
    to carry nothing.
    """

    name: str
    time_s: Floats
    u_mm: Floats
    readings: Floats
    motion: Motion | None
    unloaded_s: float = np.inf

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Rows (N,) from the onset of motion on, until the cells are unloaded."""
        rows = np.arange(self.time_s.size)
        started = rows >= (rows.size if self.motion is None else self.motion.onset)
        return np.asarray(started & (self.time_s < self.unloaded_s))

    @property
    def advancing(self) -> NDArray[np.bool_]:
        """Rows (N,) of the forward travel."""
        rows = np.arange(self.time_s.size)
        return np.asarray(self.moving & (rows < (0 if self.motion is None else self.motion.stop)))

    @property
    def resting(self) -> NDArray[np.bool_]:
        """Rows (N,) at rest before motion; all of them without motion."""
        rows = np.arange(self.time_s.size)
        return np.asarray(rows < (rows.size if self.motion is None else self.motion.rest_end))

    @cached_property
    def standing(self) -> NDArray[np.bool_]:
        """Rows (N,) of pauses within the travel."""
        if self.motion is None:
            return np.zeros(self.time_s.size, bool)
        rest_mm = self.u_mm[self.resting & np.isfinite(self.u_mm)]
        return standing(filled(self.u_mm), self.motion, float(rest_mm.std()) if rest_mm.size else 0.0)

    @cached_property
    def speed_mm_s(self) -> float:
        """Mean speed of the steady travel but for its pauses, signed; NaN without one."""
        if self.motion is None:
            return float("nan")
        steady = slice(self.motion.steady_start, self.motion.steady_end)
        t, u = self.time_s[steady], self.u_mm[steady]
        good = np.isfinite(u)
        if good.sum() < 3:
            return float("nan")
        paused_s = np.diff(t[good], prepend=t[good][0]) * self.standing[steady][good]
        moving_s = t[good] - np.cumsum(paused_s)
        moving_s -= moving_s.mean()
        return float(moving_s @ u[good] / (moving_s @ moving_s))


def filled(u_mm: Floats) -> Floats:
    """Displacement (N,) with missing rows interpolated, only to look things up by it."""
    good = np.isfinite(u_mm)
    if good.all() or not good.any():
        return u_mm
    rows = np.arange(u_mm.size)
    return np.interp(rows, rows[good], u_mm[good])


def arrays_of(log: Log, name: str) -> RunLog:
    """The columns of a log as arrays."""
    data = log.data
    readings = np.stack([data["moment_upper"].to_numpy(), data["moment_lower"].to_numpy()])
    u = data["displacement_mm"].to_numpy()
    return RunLog(name, data["time_s"].to_numpy(), u, readings, find_motion(u))
