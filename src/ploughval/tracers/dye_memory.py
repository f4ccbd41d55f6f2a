"""Where a dyed layer has been seen, and where it may be in the next photograph."""

from dataclasses import dataclass

import numpy as np

from ploughval.changing import Changing
from ploughval.tracers.dye_kernel import Ints
from ploughval.tracers.view import Floats, Mask

_BRANCHES = 3  # pieces of one layer above each other
_STEEPEST_MOTION = 1.4  # rows a column of travel that sand may rise
_USUAL_MOTION = 0.6  # ... and does, where it was not measured
_LOOSE = 0.25  # of the distance from where sand at rest or moving with the block would stand
_SLACK_PX = 1.0
_BRIDGE_SHARE = 20.0  # gaps up to so many thicknesses are bridged in what is expected next


@dataclass(frozen=True, slots=True)
class Motion:
    """Of the sand before the blade since the frame before: columns ahead, rows up (NaN: not known)."""

    ahead: float
    up: float


class Memory(Changing):
    """One layer's rows in every sampled column, for each of its pieces that lie above each other.

    Parameters
    ----------
    row : (K,) float
        Rows at rest.
    thickness : float
        Of the layer, px.
    step : int
        Columns between two samples.
    """

    CHANGES = ("_low", "_high")

    def __init__(self, row: Floats, thickness: float, step: int) -> None:
        self._low = np.full((_BRANCHES, len(row)), np.nan)
        self._high = self._low.copy()
        self._low[0], self._high[0] = row, row
        self._thickness, self._step = thickness, step

    def reach(self, motion: Motion) -> tuple[Floats, Floats]:
        """Rows between which any piece of the layer may stand in each column, (K,) each."""
        low, high = self._hull(motion)
        everywhere = np.isfinite(low).any(axis=0)
        low, high = np.where(np.isnan(low), np.inf, low), np.where(np.isnan(high), -np.inf, high)
        return np.where(everywhere, low.min(axis=0), np.nan), np.where(everywhere, high.max(axis=0), np.nan)

    def distance(self, column: Floats, row: Floats, motion: Motion) -> Floats:
        """How far places are from where the layer is expected, in thicknesses: (N,).

        Sand stands where it stood, or has moved with the block ahead of the blade; it may have been caught
        by the band half-way. Samples ``column`` count in steps.
        """
        low, high = (self._at(v, column) for v in self._hull(motion))
        outside = np.maximum(np.maximum(low - row, row - high), 0.0)
        near = np.full(low.shape, np.inf)
        for end in self._ends(motion):
            near = np.fmin(near, np.abs(row - self._at(end, column)))
        off = outside + _LOOSE * np.maximum(near - _SLACK_PX, 0.0)
        return np.asarray(np.nan_to_num(np.fmin.reduce(off, axis=0), nan=np.inf) / self._thickness)

    def _hull(self, motion: Motion) -> tuple[Floats, Floats]:
        """Rows between which sand may stand that stood still, moved, or was caught half-way."""
        came_low, came_high = self._came(motion)
        rise = max(motion.up, 0.0) if np.isfinite(motion.up) else _STEEPEST_MOTION * abs(motion.ahead)
        low, high = np.fmin(self._low, came_low - rise), np.fmax(self._high, came_high)
        return low - _SLACK_PX, high + _SLACK_PX

    def _ends(self, motion: Motion) -> tuple[Floats, Floats, Floats, Floats]:
        """Rows of sand that stood still, and of sand that moved with the block."""
        came_low, came_high = self._came(motion)
        up = motion.up if np.isfinite(motion.up) else _USUAL_MOTION * max(motion.ahead, 0.0)
        return self._low, self._high, came_low - up, came_high - up

    def _came(self, motion: Motion) -> tuple[Floats, Floats]:
        """Rows of the sand that the block would bring into each column, before its rise."""
        place: Floats = np.arange(0.0, self._low.shape[1]) - motion.ahead / self._step
        return self._at(self._low, place), self._at(self._high, place)

    def _at(self, value: Floats, column: Floats) -> Floats:
        """Values at fractional samples, of the nearer one where the other is missing: (branches, N)."""
        count = value.shape[1]
        left = np.clip(np.floor(column), 0, count - 2).astype(int)
        part = np.clip(column - left, 0.0, 1.0)
        a, b = value[:, left], value[:, left + 1]
        whole = a + part * (b - a)
        return np.asarray(np.where(np.isnan(whole), np.where(part < 0.5, a, b), whole))

    def keep(self, column: Ints, row: Floats, hidden: Mask, motion: Motion) -> None:
        """Remember the places found in this frame, in order of their samples ``column`` (N,).

        Where the layer could not be seen, ``hidden`` (K,) bool, it stands still or moves with the block.
        """
        still_low, still_high, moved_low, _ = self._ends(motion)
        low, high = np.fmin(still_low, moved_low), still_high
        seen = np.full(self._low.shape, np.nan)
        rank = np.arange(len(column)) - np.searchsorted(column, column)
        fits = rank < _BRANCHES
        seen[rank[fits], column[fits]] = row[fits]
        count = self._low.shape[1]
        where = np.flatnonzero(np.isfinite(seen[0]))
        missing = np.isnan(seen[0])
        self._low[1:], self._high[1:] = seen[1:], seen[1:]
        self._low[0] = np.where(missing, np.where(hidden, low[0], self._low[0]), seen[0])
        self._high[0] = np.where(missing, np.where(hidden, high[0], self._high[0]), seen[0])
        if len(where) == 0:
            return
        index = np.arange(count)
        right = np.clip(np.searchsorted(where, index), 0, len(where) - 1)
        after, before = where[right], where[np.maximum(right - 1, 0)]
        inside = missing & ~hidden & (index > where[0]) & (index < where[-1])
        inside &= (after - before) * self._step < _BRIDGE_SHARE * self._thickness
        both = np.stack([seen[0, before], seen[0, after]])
        self._low[0, inside] = both.min(axis=0)[inside]
        self._high[0, inside] = both.max(axis=0)[inside]
