"""When the blade moves: rest, onset and steady travel, from the displacement alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_NOISE_FACTOR = 10.0  # travel below this many standard deviations of the displacement is no motion
_MOST_DIFFERENCES = 100_000
_LEAST_REST_ROWS = 10
_AT_END = 8.0  # standard deviations of the displacement within which the blade is at its last place
_ROWS_AT_END = 3
_TRACED = 20.0  # standard deviations of the rest up to which the way is traced back to its beginning
_LEAST_TRACED = 8  # rows of it; with fewer the noise hides no more than a row or two


@dataclass(frozen=True, slots=True)
class Motion:
    """Rows of a log: at rest to ``rest_end``, moving from ``onset`` to ``stop``, steady from 2 to 98 %."""

    rest_end: int  # exclusive; 0: the log holds no rest before motion
    onset: int
    steady_start: int
    steady_end: int  # exclusive
    travel_mm: float  # signed
    stop: int  # exclusive; end of the forward travel, of the log where that ends first


def find_motion(displacement_mm: NDArray[np.float64]) -> Motion | None:
    """Find the first forward travel in a displacement record.

    Parameters
    ----------
    displacement_mm : (N,) float, mm
        In order of time; NaN rows are passed over.

    Returns
    -------
    Motion or None
        None where the displacement does not leave its own noise.
    """
    rows = np.flatnonzero(np.isfinite(displacement_mm))
    if rows.size < 5:
        return None
    u = displacement_mm[rows]
    start = float(np.median(u[: max(5, u.size // 1000)]))
    far = float(u[np.argmax(np.abs(u - start))] - start)
    rise = np.sign(far) * (u - start)
    size, noise = abs(far), _noise(u)
    if size <= _NOISE_FACTOR * noise:
        return None
    low = int(np.argmax(rise > 0.1 * size))
    below = np.flatnonzero(rise[:low] < 0.02 * size)
    steady_start = int(below[-1]) + 1 if below.size else 0
    crossing = (
        steady_start - 0.02 * max(low - steady_start, 1) / 0.08
    )  # where the line 2 to 10 % reaches zero
    rest = max(int(0.9 * crossing), 0)
    steady_end = int(np.argmax(rise >= 0.98 * size)) + 1
    steady = (int(rows[steady_start]), int(rows[steady_end - 1]) + 1)
    stop = _stop(rise, size, noise, 0.96 * size / max(steady_end - steady_start, 1))
    stop = displacement_mm.size if stop == u.size else int(rows[stop])
    if rest < _LEAST_REST_ROWS:
        return Motion(0, 0, *steady, far, stop)
    level = float(rise[:rest].mean())
    spread = float(rise[:rest].std())
    still = np.flatnonzero(rise[:steady_start] <= level + max(3 * spread, 1e-9 * size))
    onset = _traced_back(rise - level, int(still[-1]) + 1 if still.size else 0, spread)
    return Motion(int(rows[rest]), int(rows[onset]), *steady, far, stop)


def _traced_back(rise: NDArray[np.float64], told: int, spread: float) -> int:
    """Row at which the motion that is told from the noise at row ``told`` began; ``rise`` is 0 at rest.

    A straight line through the rows that follow, traced back to the level at rest. It is not taken where it
    leads to a later row, as that of a blade which gathers speed does.
    """
    end = told + int(np.argmax(rise[told:] > _TRACED * spread))
    if end - told < _LEAST_TRACED:
        return told
    slope, start = np.polyfit(np.arange(end - told), rise[told:end], 1)
    if slope <= 0:
        return told
    return min(max(int(np.ceil(told - start / slope)), 0), told)


def _stop(rise: NDArray[np.float64], size: float, noise: float, row_mm: float) -> int:
    """First row after the forward travel; the record's end where the blade moves as long as that."""
    reached = int(np.argmax(rise >= size - _AT_END * noise)) + 1
    held_mm = (rise.size - reached) * row_mm  # what the rows after that would travel
    return reached if held_mm > 2 * _AT_END * noise + _ROWS_AT_END * row_mm else int(rise.size)


def _noise(values: NDArray[np.float64]) -> float:
    """Standard deviation of white noise on a smooth curve, from the spread of its second differences."""
    if values.size < 4:
        return 0.0
    at = np.arange(0, values.size - 2, max(values.size // _MOST_DIFFERENCES, 1))
    second = values[at] - 2 * values[at + 1] + values[at + 2]
    return float(1.4826 * np.median(np.abs(second - np.median(second))) / np.sqrt(6.0))
