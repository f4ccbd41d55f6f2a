"""Scalars of a force history: levels, peaks, places and spacing, in N and mm and in units of P0 and d."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.force.curve import Curve, Shared
from ploughval.compare.force.initial import Initial
from ploughval.compare.force.period import dominant_period
from ploughval.compare.force.reading import Reading
from ploughval.compare.quantity import MISSING, Quantity

Floats = NDArray[np.float64]


def force_quantities(
    reading: Reading, depth_mm: float, *, limit_mm: float | None = None
) -> Mapping[str, Quantity]:
    """Scalars of a force history.

    Parameters
    ----------
    reading : Reading
        Curve up to the travel that both sides have in common, extremes and initial force.
    depth_mm : float
        Depth of the tip.
    limit_mm : float or None
        The common travel; a curve that ends before it has no mean, no work and no number of peaks.

    Returns
    -------
    mapping of str to Quantity
        NaN where the history has no such value. Values in P0 are over this history's own initial force.
    """
    curve, initial = reading.curve, reading.initial
    peaks, switches, trough = reading.peaks, reading.switches, reading.first_trough
    common = curve.since(reading.begin_mm)
    travel_mm = curve.end_mm - reading.begin_mm
    whole = travel_mm > 0 and (limit_mm is None or curve.end_mm >= limit_mm * (1 - 1e-6))
    mean = _mean(common) if whole else MISSING
    shared = curve.shared

    def in_P0(force: Quantity) -> Quantity:
        return over_initial(force, initial, shared)

    found = {
        "force_mean_N": mean,
        "work_mJ": Quantity(mean.value * travel_mm, mean.std * travel_mm),
        "first_peak_N": Quantity(initial.force_N, initial.force_std_N),
        "first_trough_N": _entry(trough, "force_N", "force_std_N"),
        "first_switch_u_mm": _entry(switches, "u_mm", "u_std_mm"),
        "first_switch_N": _entry(switches, "force_N", "force_std_N"),
        "first_switch_drop_N": _entry(switches, "drop_N", "drop_std_N"),
        "peaks_count": Quantity(float(len(peaks)), 0.0) if whole else MISSING,
        "peak_spacing_mm": mean_spacing(peaks),
        "dominant_period_mm": dominant_period(common, len(switches)) if whole else MISSING,
    }
    for name in ("force_mean", "first_trough", "first_switch"):
        found[f"{name}_P0"] = in_P0(found[f"{name}_N"])
    found["first_switch_drop_P0"] = over_initial(found["first_switch_drop_N"], initial, shared, offsets=0.0)
    for name in ("first_switch_u", "peak_spacing", "dominant_period"):
        value, std = found[f"{name}_mm"]
        found[f"{name}_d"] = Quantity(value / depth_mm, std / depth_mm)
    found["switches_per_depth"] = Quantity(len(switches) * depth_mm / travel_mm, 0.0) if whole else MISSING
    return found


def mean_spacing(peaks: pd.DataFrame) -> Quantity:
    """Mean travel between neighbouring peaks, mm; what the places between the ends are cancels."""
    gaps = len(peaks) - 1
    if gaps < 1:
        return MISSING
    u, std = peaks["u_mm"].to_numpy(), peaks["u_std_mm"].to_numpy()
    return Quantity(float(u[-1] - u[0]) / gaps, float(np.hypot(std[0], std[-1])) / gaps)


def over_initial(force: Quantity, initial: Initial, shared: Shared, *, offsets: float = 1.0) -> Quantity:
    """A force over the initial force of the same record.

    docs/theory-comparison.md, Eq. (5): the gain cancels, an offset acts on both with opposite sign, and what
    is fresh at either place adds.

    Parameters
    ----------
    force : Quantity
        N, with all of its uncertainty.
    initial : Initial
        The initial force.
    shared : Shared
        What both have in common.
    offsets : float
        How many offsets the force holds: 1 a level, 0 a difference of two levels.
    """
    if not (np.isfinite(force.value) and initial.force_N > 0):
        return MISSING
    ratio = force.value / initial.force_N

    common = shared.variance(force.value) if offsets else (shared.gain * force.value) ** 2
    own = max(force.std**2 - common, 0.0)
    own += ratio**2 * max(initial.force_std_N**2 - shared.variance(initial.force_N), 0.0)
    std = np.sqrt(own + (shared.offset_N * (offsets - ratio)) ** 2) / initial.force_N
    return Quantity(ratio, float(std))


def _entry(table: pd.DataFrame, value: str, std: str) -> Quantity:
    return Quantity(float(table[value].iloc[0]), float(table[std].iloc[0])) if len(table) else MISSING


def _mean(curve: Curve) -> Quantity:
    span = curve.end_mm - float(curve.u_mm[0])
    if span <= 0:
        return MISSING
    value = float(np.trapezoid(curve.force_N, curve.u_mm)) / span
    shared = float(np.trapezoid(curve.shared_std_N, curve.u_mm)) / span
    noise = float(np.sqrt(np.mean(curve.noise_std_N**2) / curve.u_mm.size))
    return Quantity(value, float(np.hypot(shared, noise)))
