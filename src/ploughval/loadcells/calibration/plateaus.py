"""Levels of a log in which known loads were hung on one after the other and taken off."""

import itertools
from operator import itemgetter

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.errors import DataError

Floats = NDArray[np.float64]
PLATEAU_COLUMNS = ("first_row", "last_row", "load_N", "upper", "lower", "upper_std", "lower_std")
_MEDIAN_ROWS = 5  # dropouts of one or two rows leave no trace
_LEAST_ROWS = 12  # of a plateau
_STILL_NOISE = 8.0  # what stays within this many standard deviations of the noise ...
_STILL_STEP = 0.03  # ... or within this part of the least step between loads is at rest
_MOST_SHORTEST = 3  # times at rest count up to so many times the shortest
_NEAR = 0.4  # of the least step: a level this near to what a load should read belongs to it


def find_plateaus(readings: Floats, loads_N: Floats) -> pd.DataFrame:
    """Find the levels of a staircase of known loads.

    Parameters
    ----------
    readings : (2, N) float
        Of the (upper, lower) cell in order of time, NaN where not measured; the rate need not be constant.
    loads_N : (L,) float, N
        Loads in the order in which they hung; the same load twice in a row is one plateau.

    Returns
    -------
    DataFrame
        PLATEAU_COLUMNS, one row a plateau: medians over the second half of the longest time at rest at each
        level, of which at most three times the shortest counts, and the standard deviation of single rows.

    Raises
    ------
    DataError
        The levels found do not follow the loads.
    """
    from scipy.ndimage import median_filter

    loads = np.array([load for load, _ in itertools.groupby(np.asarray(loads_N, float).tolist())])
    if loads.size < 2:
        raise DataError(f"{loads.size} different loads in a row; expected at least two")
    finite = np.isfinite(readings).all(axis=0)
    rows = np.flatnonzero(finite)
    if rows.size < _LEAST_ROWS * loads.size:
        raise DataError(f"{rows.size} rows for {loads.size} loads; expected at least {_LEAST_ROWS} for each")
    smooth = median_filter(readings[:, finite], size=(1, _MEDIAN_ROWS), mode="nearest")
    span = np.ptp(smooth, axis=1)
    if not (span > 0).any():
        raise DataError("the readings of both cells are constant; expected levels of different loads")
    sign = np.where((smooth[0] - smooth[0].mean()) @ (smooth[1] - smooth[1].mean()) < 0, -1.0, 1.0)
    signal = (smooth * np.array([[1.0], [float(sign)]]) / np.where(span > 0, span, np.inf)[:, None]).sum(
        axis=0
    )
    step = float(np.diff(np.unique(loads)).min() / np.ptp(loads) * np.ptp(signal))
    segments = _segments_at_rest(signal, step)
    found = _follow(signal, segments, loads)
    # Cells creep under load: all levels are read at about the same time after they were reached.
    shortest = min(b - a for a, b in found)
    used = [min(b - a, _MOST_SHORTEST * shortest) for a, b in found]
    parts = [(a + length // 2, a + length) for (a, _), length in zip(found, used, strict=True)]
    return pd.DataFrame(
        [_level(readings[:, rows[a:b]], rows[a:b], load) for (a, b), load in zip(parts, loads, strict=True)],
        columns=list(PLATEAU_COLUMNS),
    )


def _segments_at_rest(signal: Floats, step: float) -> list[tuple[int, int]]:
    """First and one past the last row of every time at rest."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    noise = 1.4826 * float(np.median(np.abs(np.diff(signal)))) / np.sqrt(2.0)
    spread = maximum_filter1d(signal, _LEAST_ROWS) - minimum_filter1d(signal, _LEAST_ROWS)
    still = spread <= max(_STILL_NOISE * noise, _STILL_STEP * step)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    # The window that is still reaches half its length to either side of where it is so.
    half = _LEAST_ROWS // 2 - 1
    return [
        (max(a - half, 0), min(b + half, signal.size)) for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]


def _follow(signal: Floats, segments: list[tuple[int, int]], loads: Floats) -> list[tuple[int, int]]:
    """The longest segment at each level, in the order of the loads."""
    if not segments:
        raise DataError(f"the readings never come to rest; expected {loads.size} levels")
    levels = np.array([float(np.median(signal[a:b])) for a, b in segments])
    tried = []
    for sign in (1.0, -1.0):
        distinct = np.unique(sign * loads)
        per_load = np.ptp(levels) / np.ptp(distinct)
        expected = levels.min() + per_load * (distinct - distinct[0])
        near = np.abs(levels[:, None] - expected).argmin(axis=1)
        close = np.abs(levels - expected[near]) <= _NEAR * per_load * np.diff(distinct).min()
        at_rest = ((int(near[k]), k) for k in np.flatnonzero(close))
        parts = [
            (sign * float(distinct[level]), [k for _, k in members])
            for level, members in itertools.groupby(at_rest, key=itemgetter(0))
        ]
        if [load for load, _ in parts] == loads.tolist():
            return [max((segments[k] for k in members), key=lambda s: s[1] - s[0]) for _, members in parts]
        tried.append([load for load, _ in parts])
    shown = ", ".join(f"{load:g}" for load in min(tried, key=lambda t: abs(len(t) - loads.size)))
    raise DataError(
        f"the levels found are those of the loads {shown} N; expected "
        f"{', '.join(f'{load:g}' for load in loads)} N. Correct loads_N, or cut the log to the calibration"
    )


def _level(readings: Floats, rows: NDArray[np.intp], load: float) -> tuple[float, ...]:
    """One row of the table."""
    middle = np.median(readings, axis=1)
    std = 1.4826 * np.median(np.abs(readings - middle[:, None]), axis=1)
    return int(rows[0]), int(rows[-1]), load, *(float(m) for m in middle), *(float(d) for d in std)
