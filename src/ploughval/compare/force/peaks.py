"""Peaks and troughs of a force history."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import find_peaks

from ploughval.compare.force.corner import find_corner
from ploughval.compare.force.curve import Curve
from ploughval.compare.force.rounded import round_extreme

Floats = NDArray[np.float64]
PEAK_COLUMNS = (
    "kind", "u_mm", "u_std_mm", "force_N", "force_std_N", "prominence_N",
    "drop_N", "drop_std_N", "spacing_mm", "spacing_std_mm",
)  # fmt: skip
_PROMINENCE_P0 = 0.1
_PROMINENCE_NOISE = 6.0
_PROMINENCE_RIPPLE = 2.5
_RIPPLES = 30  # local peaks from which on most of them are no bands'


class Quantity(NamedTuple):
    """A value with its standard uncertainty; NaN where it could not be had."""

    value: float
    std: float


MISSING = Quantity(float("nan"), float("nan"))


def least_prominence(curve: Curve, P0_N: float, setting_P0: float | None) -> float:
    """Prominence (N) that a peak needs to be one.

    The setting or a tenth of P0, at least 6 times the noise, and at least 2.5 times the ripple of stick
    and slip: what 80 % of all the local peaks of the curve stay below, where there are enough of them.
    """
    floor = _PROMINENCE_NOISE * float(np.median(curve.noise_std_N))
    ripples = find_peaks(curve.force_N, prominence=0.0)[1]["prominences"]
    if ripples.size >= _RIPPLES:
        floor = max(floor, _PROMINENCE_RIPPLE * float(np.percentile(ripples, 80)))
    return max((setting_P0 if setting_P0 is not None else _PROMINENCE_P0) * P0_N, floor)


def find_extremes(curve: Curve, prominence_N: float, *, rebound_mm: float = 0.0) -> pd.DataFrame:
    """Peaks of a prominence, and the lowest point after each.

    Parameters
    ----------
    curve : Curve
        Taken to rise from zero force at its start, so that a fall from the first point on follows a peak.
    prominence_N : float
        Least fall to either side of a peak, N.
    rebound_mm : float
        A lower peak within this travel after another one, from which the force falls further than before, is
        a rebound in the fall and no peak of its own, mm.

    Returns
    -------
    DataFrame
        PEAK_COLUMNS, in order of travel. ``drop_N`` is the fall from a peak to its trough (what both share
        cancels in its uncertainty), ``spacing_mm`` the travel to the next extreme of the same kind (NaN for
        the last). A trough at the very end of the curve is not one: the force may fall further.
    """
    force = curve.force_N
    found, properties = find_peaks(np.concatenate([[0.0], force]), prominence=prominence_N)
    tops = found - 1
    kept = _without_rebounds(curve, tops, rebound_mm)
    tops, prominences = tops[kept], properties["prominences"][kept]
    lows = _lows(force, tops)
    inner = lows < force.size - 1
    both = np.concatenate([tops, lows])
    peaks = _table(curve, tops, both, "peak")
    troughs = _table(curve, lows, both, "trough")
    peaks["prominence_N"] = prominences
    peaks["drop_N"] = peaks["force_N"] - troughs["force_N"]
    fresh = [table["force_std_N"] ** 2 - table["shared_std_N"] ** 2 for table in (peaks, troughs)]
    peaks["drop_std_N"] = np.sqrt(np.maximum(fresh[0] + fresh[1], 0.0))
    troughs = troughs[inner]
    for table in (peaks, troughs):
        u, std = table["u_mm"].to_numpy(), table["u_std_mm"].to_numpy()
        table["spacing_mm"] = np.append(np.diff(u), np.nan)[: len(table)]
        table["spacing_std_mm"] = np.append(np.hypot(std[1:], std[:-1]), np.nan)[: len(table)]
    table = pd.concat([peaks, troughs], ignore_index=True).sort_values(
        "u_mm", kind="stable", ignore_index=True
    )
    return table.reindex(columns=list(PEAK_COLUMNS))


def _lows(force: Floats, tops: NDArray[np.intp]) -> NDArray[np.intp]:
    """The lowest point between each peak and the next, or the end."""
    ends = np.append(tops[1:], force.size - 1)[: len(tops)]
    return np.array(
        [a + int(np.argmin(force[a : b + 1])) for a, b in zip(tops, ends, strict=True)], dtype=np.intp
    )


def _without_rebounds(curve: Curve, tops: NDArray[np.intp], rebound_mm: float) -> NDArray[np.intp]:
    """Places in ``tops`` of the peaks that are none of another one's fall."""
    lows = _lows(curve.force_N, tops)
    kept: list[int] = []
    floor = np.inf
    for j, (top, low) in enumerate(zip(tops, lows, strict=True)):
        if kept:
            before = tops[kept[-1]]
            near = curve.u_mm[top] - curve.u_mm[before] <= rebound_mm
            if near and curve.force_N[top] < curve.force_N[before] and curve.force_N[low] < floor:
                floor = curve.force_N[low]
                continue
        kept.append(j)
        floor = curve.force_N[low]
    return np.array(kept, dtype=np.intp)


def _table(curve: Curve, places: NDArray[np.intp], extremes: NDArray[np.intp], kind: str) -> pd.DataFrame:
    """Rows of extremes of one kind, with the part of the force's uncertainty that is shared."""
    sign = 1 if kind == "peak" else -1
    rows = [(*_extreme(curve, int(k), sign, extremes), float(curve.shared_std_N[k])) for k in places]
    names = ["u_mm", "u_std_mm", "force_N", "force_std_N", "shared_std_N"]
    return pd.DataFrame(rows, columns=names, dtype=np.float64).assign(kind=kind)


def _extreme(
    curve: Curve, k: int, sign: int, extremes: NDArray[np.intp]
) -> tuple[float, float, float, float]:
    """Travel and force of an extreme, each with its standard uncertainty."""
    near = _near(curve, k, sign)
    if curve.step_mm > 0:
        first = int(extremes[extremes < k].max(initial=0))
        last = int(extremes[extremes > k].min(initial=curve.u_mm.size - 1))
        corner = find_corner(curve, near, first, last)
        if corner is not None:
            std = float(np.hypot(corner.force_std_N, curve.shared_std_N[k]))
            return corner.u_mm, corner.u_std_mm, corner.force_N, std
        return round_extreme(curve, near, k, (first, last))
    return float(curve.u_mm[k]), 0.0, float(curve.force_N[k]), float(curve.std_N[k])


def _near(curve: Curve, k: int, sign: int) -> tuple[int, int]:
    """First and last point around an extreme that lie within three noise widths of it."""
    force = sign * curve.force_N
    limit = force[k] - 3 * curve.noise_std_N[k]
    # Six noise widths down the flank no neighbour belongs to this extreme any more.
    away = np.flatnonzero(force <= limit - 3 * curve.noise_std_N[k])
    left = int(away[away < k].max(initial=-1)) + 1
    right = int(away[away > k].min(initial=force.size)) - 1
    near = left + np.flatnonzero(force[left : right + 1] >= limit)
    return int(near[0]), int(near[-1])


def common_grid(first: Curve, second: Curve, limit_mm: float) -> Floats:
    """Travels at which two curves are compared: even steps over what both cover up to a limit."""
    start = max(float(first.u_mm[0]), float(second.u_mm[0]))
    step = max(first.step_mm, second.step_mm, (limit_mm - start) / 5000)
    return np.linspace(start, limit_mm, max(int((limit_mm - start) / step), 1) + 1)


def aligned_u(u_mm: Floats, to_mm: Floats, from_mm: Floats) -> Floats:
    """Travel of one curve at the same stage between peaks: piecewise linear, shifted beyond the last."""
    count = min(len(to_mm), len(from_mm))
    to_mm, from_mm = np.append(0.0, to_mm[:count]), np.append(0.0, from_mm[:count])
    keep = np.append(True, np.diff(to_mm) > 0)
    mapped = np.interp(u_mm, to_mm[keep], from_mm[keep])
    return np.asarray(np.where(u_mm > to_mm[-1], u_mm - to_mm[-1] + from_mm[-1], mapped))
