"""Peaks and troughs of a force history, and the scalars that describe it."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import find_peaks

from ploughval.compare.force.corner import find_corner
from ploughval.compare.force.curve import Curve

Floats = NDArray[np.float64]
PEAK_COLUMNS = (
    "kind", "u_mm", "u_std_mm", "force_N", "force_std_N", "prominence_N", "drop_N", "spacing_mm",
)  # fmt: skip
_PROMINENCE_P0 = 0.1
_PROMINENCE_NOISE = 6.0
_FIRST_PEAK_DEPTHS = 0.5  # a peak later than this is no initial peak


class Quantity(NamedTuple):
    """A value with its standard uncertainty; NaN where it could not be had."""

    value: float
    std: float


MISSING = Quantity(float("nan"), float("nan"))


def least_prominence(curve: Curve, P0_N: float, setting_P0: float | None) -> float:
    """Prominence (N) that a peak needs: the setting or a tenth of P0, and at least 6 times the noise."""
    floor = _PROMINENCE_NOISE * float(np.median(curve.noise_std_N))
    return max((setting_P0 if setting_P0 is not None else _PROMINENCE_P0) * P0_N, floor)


def find_extremes(curve: Curve, prominence_N: float) -> pd.DataFrame:
    """Peaks of a prominence, and the lowest point after each.

    Parameters
    ----------
    curve : Curve
        Taken to rise from zero force at its start, so that a fall from the first point on follows a peak.
    prominence_N : float
        Least fall to either side of a peak, N.

    Returns
    -------
    DataFrame
        PEAK_COLUMNS, in order of travel. ``drop_N`` is the fall from a peak to its trough, ``spacing_mm``
        the travel to the next extreme of the same kind (NaN for the last). A trough at the very end of the
        curve is not one: the force may fall further.
    """
    force = curve.force_N
    found, properties = find_peaks(np.concatenate([[0.0], force]), prominence=prominence_N)
    tops = found - 1
    ends = np.append(tops[1:], force.size - 1)[: len(tops)]
    spans = zip(tops, ends, strict=True)
    lows = np.array([a + int(np.argmin(force[a : b + 1])) for a, b in spans], dtype=int)
    inner = lows < force.size - 1
    parts = []
    for kind, places in (("peak", tops), ("trough", lows[inner])):
        found_here = [
            _extreme(curve, k, 1 if kind == "peak" else -1, np.concatenate([tops, lows])) for k in places
        ]
        part = pd.DataFrame(
            found_here, columns=["u_mm", "u_std_mm", "force_N", "force_std_N"], dtype=np.float64
        )
        part["kind"] = kind
        part["prominence_N"] = properties["prominences"] if kind == "peak" else np.nan
        part["spacing_mm"] = np.append(np.diff(part["u_mm"]), np.nan)[: len(part)]
        parts.append(part)
    height = np.concatenate([parts[1]["force_N"], force[lows[~inner]]])
    parts[0]["drop_N"] = parts[0]["force_N"].to_numpy() - height
    parts[1]["drop_N"] = np.nan
    table = pd.concat(parts, ignore_index=True)
    return table.sort_values("u_mm", kind="stable", ignore_index=True)[list(PEAK_COLUMNS)]


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
    width = float(max(curve.step_mm, curve.u_mm[near[1]] - curve.u_mm[near[0]]))
    return float(curve.u_mm[k]), width / float(np.sqrt(12.0)), float(curve.force_N[k]), float(curve.std_N[k])


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


def force_quantities(curve: Curve, extremes: pd.DataFrame, depth_mm: float) -> Mapping[str, Quantity]:
    """Scalars of a force history: mean, work, first peak and trough, first switch, peaks.

    Parameters
    ----------
    curve : Curve
        Up to the travel that both sides have in common.
    extremes : DataFrame
        PEAK_COLUMNS, of the same curve.
    depth_mm : float
        Depth of the tip.
    """
    peaks = extremes[extremes["kind"] == "peak"]
    initial = peaks["u_mm"].to_numpy() <= _FIRST_PEAK_DEPTHS * depth_mm
    begins = bool(initial.any())
    switches = peaks[~initial]
    mean = _mean(curve)
    count = len(peaks)
    spacing = MISSING
    if count > 1:
        u, std = peaks["u_mm"].to_numpy(), peaks["u_std_mm"].to_numpy()
        gaps = count - 1
        spacing = Quantity(float(u[-1] - u[0]) / gaps, float(np.hypot(std[0], std[-1])) / gaps)
    lows = extremes[(extremes["kind"] == "trough")]
    return {
        "force_mean_N": mean,
        "work_mJ": Quantity(mean.value * curve.end_mm, mean.std * curve.end_mm),
        "first_peak_N": _entry(peaks[initial], "force_N", "force_std_N") if begins else MISSING,
        "first_trough_N": _entry(lows, "force_N", "force_std_N") if begins else MISSING,
        "first_switch_u_mm": _entry(switches, "u_mm", "u_std_mm"),
        "first_switch_N": _entry(switches, "force_N", "force_std_N"),
        "first_switch_drop_N": _drop(curve, switches),
        "peaks_count": Quantity(float(count), 0.0),
        "peak_spacing_mm": spacing,
    }


def _entry(table: pd.DataFrame, value: str, std: str) -> Quantity:
    return Quantity(float(table[value].iloc[0]), float(table[std].iloc[0])) if len(table) else MISSING


def _drop(curve: Curve, switches: pd.DataFrame) -> Quantity:
    """Fall after the first switch; what is common to both its ends cancels in the uncertainty."""
    if len(switches) == 0:
        return MISSING
    drop = float(switches["drop_N"].iloc[0])
    return Quantity(drop, float(np.sqrt(2) * np.median(curve.noise_std_N)))


def _mean(curve: Curve) -> Quantity:
    span = curve.end_mm - float(curve.u_mm[0])
    if span <= 0:
        return MISSING
    value = float(np.trapezoid(curve.force_N, curve.u_mm)) / span
    shared = float(np.trapezoid(curve.shared_std_N, curve.u_mm)) / span
    noise = float(np.sqrt(np.mean(curve.noise_std_N**2) / curve.u_mm.size))
    return Quantity(value, float(np.hypot(shared, noise)))


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
