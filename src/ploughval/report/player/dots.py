"""Tracked points as dots: where they are, how far they moved, and how much the sand sheared there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ploughval.piv.strain import StrainMeasure, max_shear, strain_field
from ploughval.report.figures.layers import Extent
from ploughval.report.player.coding import letters, pack, zigzag
from ploughval.report.player.frames import Moment
from ploughval.report.shear import gauge_mm
from ploughval.results import Results

Floats = NDArray[np.float64]

MOST_DOTS = 600
DOT_BYTES = 900_000  # of all frames together
_BYTES = 4.5  # of a dot in a frame, about
_FINEST_MM, _COARSEST_MM = 0.01, 0.05
_MOTION_TOP = 1.6  # millimetres a millimetre of the blade: a block on a band of 50 degrees
_LEAST_STEP_MM = 1e-3


@dataclass(frozen=True, slots=True)
class FrameDots:
    """Dots of one frame as text, empty where no point was tracked.

    ``places`` holds 0 for a lost dot, 1 for one that stands, else 2 and more for folded differences in x
    and y from where it was last seen; ``motion`` and ``shear`` a letter a dot.
    """

    places: str = ""
    motion: str = ""
    shear: str = ""


@dataclass(frozen=True, slots=True)
class Dots:
    """Dots of all frames; ``shear_top`` and ``motion_top`` are what the last letter stands for.

    ``start`` holds the places before the blade moved in quanta, x and y in turn.
    """

    start: tuple[int, ...]
    tracked: int
    quantum_mm: float
    motion_top: float
    shear_top: float
    gauge_mm: float
    frames: tuple[FrameDots, ...]

    @property
    def count(self) -> int:
        """Number of dots."""
        return len(self.start) // 2


@dataclass(frozen=True, slots=True)
class _Paths:
    """Displacement of the blade (F,), places (F, N, 2) and their std (F, N), mm."""

    u_mm: Floats
    places: Floats
    std: Floats
    measured: NDArray[np.bool_]

    @classmethod
    def of(cls, tracks: xr.Dataset) -> "_Paths":
        places = np.stack([tracks["x_mm"].to_numpy(), tracks["y_mm"].to_numpy()], axis=-1)
        seen = np.isfinite(places[..., 0]).any(axis=1)
        return cls(tracks["u_mm"].to_numpy(), places, tracks["std_mm"].to_numpy(), seen)


def frame_dots(results: Results, moments: Sequence[Moment], extent: Extent) -> Dots | None:
    """Dots of some frames, thinned evenly; None without tracks.

    Parameters
    ----------
    results : Results
        Its tracks are used.
    moments : sequence of Moment
        Frames of the player; the motion of one is that since the photograph before it.
    extent : tuple of float, mm
        Part of the world that is shown.
    """
    tracks = results.tracks
    if tracks is None or not moments:
        return None
    start = np.column_stack([tracks["x0_mm"].to_numpy(), tracks["y0_mm"].to_numpy()])
    most = max(50, min(MOST_DOTS, int(DOT_BYTES / _BYTES / len(moments))))
    chosen = even_choice(start, extent, most)
    rows = {int(frame): row for row, frame in enumerate(tracks["frame"].to_numpy())}
    at = [rows.get(moment.frame) for moment in moments]
    gauge, paths = gauge_mm(results), _Paths.of(tracks)
    motion = [None if row is None else _increment(paths, row, chosen, gauge) for row in at]
    sizes = [shear[np.isfinite(shear)] for _, shear in filter(None, motion)]
    top = _round_up(float(np.percentile(np.concatenate(sizes), 97)) if any(map(len, sizes)) else 0.01)
    steps = np.abs(np.diff(paths.u_mm[np.isfinite(paths.u_mm)]))
    pace = float(np.median(steps)) if steps.size else 1.0
    quantum = min(max(pace / 60.0, _FINEST_MM), _COARSEST_MM)
    first = last = np.round(start[chosen] / quantum).astype(np.int64)
    frames = []
    for row, moved in zip(at, motion, strict=True):
        if row is None or moved is None:
            frames.append(FrameDots())
            continue
        places, last = _packed(paths.places[row, chosen], last, quantum)
        frames.append(FrameDots(places, letters(moved[0], _MOTION_TOP), letters(moved[1], top)))
    return Dots(tuple(first.ravel().tolist()), len(start), quantum, _MOTION_TOP, top, gauge, tuple(frames))


def even_choice(start: Floats, extent: Extent, most: int) -> NDArray[np.int64]:
    """Points in view, at most so many and evenly spread: of every cell of a grid the first."""
    x0, x1, y0, y1 = extent
    x, y = start.T
    seen = np.flatnonzero((x >= x0) & (x <= x1) & (y >= y0) & (y <= y1))
    if len(seen) <= most:
        return seen
    side = np.sqrt(np.ptp(x[seen]) * np.ptp(y[seen]) / most) or 1.0
    while True:
        cells = np.floor(start[seen] / side).astype(np.int64)
        _, first = np.unique(cells, axis=0, return_index=True)
        if len(first) <= most:
            return seen[np.sort(first)]
        side *= 1.03


def _increment(paths: _Paths, row: int, chosen: NDArray[np.int64], gauge: float) -> tuple[Floats, Floats]:
    """Motion over the blade's and maximum shear of some points since the measured row before, NaN without."""
    motion, shear = np.full((2, len(chosen)), np.nan)
    u, places = paths.u_mm, paths.places
    earlier = np.flatnonzero(paths.measured[:row] & (u[:row] < u[row] - _LEAST_STEP_MM))
    if not earlier.size:
        return motion, shear
    before = int(earlier[-1])
    moved = places[row] - places[before]
    motion = np.hypot(*moved[chosen].T) / (u[row] - u[before])
    good = np.isfinite(moved).all(axis=1)
    known = good[chosen]
    if good.sum() >= 4 and known.any():
        std = np.sqrt(2.0) * paths.std[row]
        field = strain_field(
            places[row][good], moved[good], gauge_px=gauge, std_px=std[good],
            measure=StrainMeasure.SMALL, at=places[row][chosen[known]],
        )  # fmt: skip
        shear[known] = max_shear(field.strain)
    return motion, shear


def _packed(places: Floats, last: NDArray[np.int64], quantum: float) -> tuple[str, NDArray[np.int64]]:
    """Places of a frame as text, and where each dot was last seen after it."""
    good: NDArray[np.bool_] = np.isfinite(places[:, 0]) & np.isfinite(places[:, 1])
    now = np.where(good[:, np.newaxis], np.round(np.nan_to_num(places) / quantum), last).astype(np.int64)
    numbers: list[int] = []
    for there, (dx, dy) in zip(good.tolist(), zigzag(now - last).tolist(), strict=True):
        if not there:
            numbers.append(0)
        elif dx == 0 and dy == 0:
            numbers.append(1)
        else:
            numbers += [dx + 2, dy]
    return pack(numbers), now


def _round_up(value: float) -> float:
    """The next of a few round numbers.

    >>> _round_up(0.037), _round_up(0.21)
    (0.04, 0.3)
    """
    power = 10.0 ** np.floor(np.log10(max(value, 1e-4)))
    steps = (1, 1.5, 2, 3, 4, 5, 6, 8, 10)
    return float(round(next(s for s in steps if value <= s * power * (1 + 1e-9)) * power, 9))
