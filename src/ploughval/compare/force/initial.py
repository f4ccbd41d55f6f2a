"""The initial force P0 of a history: its first peak, or where its first steep rise ends."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.force.curve import Curve

Floats = NDArray[np.float64]
LATEST_DEPTHS = 0.5  # a peak later than this is no initial peak
_LATE_DEPTHS = 0.01  # a record whose first point lies beyond this has not seen the rise
_LEAST = 4  # points of a straight line
_STEEPER = 3.0  # the first rise against what follows, to be one
_STRAIGHT = 0.7  # a rise whose last third gains this share of the middle one goes straight to its top
_ROUNDED_DEPTHS = (0.005, 0.01, 0.02, 0.04)  # travel to either side of a peak that may be rounded
NAN = float("nan")


class Initial(NamedTuple):
    """The initial force: travel and force with their standard uncertainties, and how it was read.

    ``row`` is its row among the extremes, -1 where it is none of them; NaN with a ``note`` that says why
    where it could not be had.
    """

    u_mm: float
    u_std_mm: float
    force_N: float
    force_std_N: float
    row: int
    note: str


def find_initial(curve: Curve, extremes: pd.DataFrame, depth_mm: float) -> Initial:
    """Initial force of a history.

    The model's is its first value: there nothing comes before the mechanism. A measured force first has to
    rise. Its initial force is the first peak, if that comes within half a depth; a fresh band may come as
    early, but there the force rises straight to the top after a much steeper first rise. Without such a peak
    it is where the first steep rise ends: two straight lines that meet, fitted up to the first peak.

    Parameters
    ----------
    curve : Curve
        From the first travel on.
    extremes : DataFrame
        PEAK_COLUMNS of the same curve.
    depth_mm : float
        Depth of the tip.

    Returns
    -------
    Initial
    """
    if curve.step_mm == 0:
        first = extremes.index[(extremes["kind"] == "peak") & (extremes["u_mm"] == curve.u_mm[0])]
        row = int(first[0]) if len(first) else -1
        values = (float(curve.u_mm[0]), 0.0, float(curve.force_N[0]), float(curve.std_N[0]))
        return Initial(*values, row, "")
    peaks = extremes[extremes["kind"] == "peak"]
    limit = LATEST_DEPTHS * depth_mm
    begin = float(curve.u_mm[0])
    late = begins_late(curve, depth_mm)
    early = peaks[peaks["u_mm"] <= limit]
    if len(early):
        top = early.iloc[0]
        if late and float(top["u_mm"]) < begin + 1.5 * curve.step_mm:
            return _missing(f"the record begins at u = {begin:.3g} mm, past the initial peak")
        if not _goes_straight(curve, float(top["u_mm"])):
            u, u_std, force, std = (float(top[n]) for n in ("u_mm", "u_std_mm", "force_N", "force_std_N"))
            rounding = rounding_of(curve, u, force, depth_mm)
            return Initial(u, u_std, force, float(np.hypot(std, rounding)), int(early.index[0]), "")
        limit = float(top["u_mm"])
    return _knee(curve.until(limit), late=late)


def begins_late(curve: Curve, depth_mm: float) -> bool:
    """Whether a record has not seen the rise of the force from the first travel on."""
    return bool(curve.u_mm[0] > max(3 * curve.step_mm, _LATE_DEPTHS * depth_mm))


def _missing(why: str) -> Initial:
    return Initial(NAN, NAN, NAN, NAN, -1, why)


def _goes_straight(curve: Curve, top_mm: float) -> bool:
    """Whether a rise is steep first and then goes straight to its top, as it does before a fresh band."""
    stations = np.linspace(curve.u_mm[0], top_mm, 4)
    levels = np.interp(stations, curve.u_mm, curve.force_N)
    middle, last = levels[2] - levels[1], levels[3] - levels[2]
    gained = levels[1] > 2 * max(middle, last)
    return bool(gained and middle > 0 and last >= _STRAIGHT * middle)


def rounding_of(curve: Curve, u_mm: float, force_N: float, depth_mm: float) -> float:
    """What rounding may have taken off a peak, as a standard uncertainty, N.

    Sand that fails bit by bit and a log that filters both round a peak, and the curve does not tell which.
    A sharp peak would stand where straight lines meet that are fitted to its flanks, the nearest travel left
    out. The greatest height of that corner above the peak, where it is more than noise, bounds a rectangle.

    Parameters
    ----------
    curve : Curve
        A measured one.
    u_mm, force_N : float
        The peak.
    depth_mm : float
        Depth of the tip: shares of it are left out to either side.
    """
    highest = 0.0
    for gap in (share * depth_mm for share in _ROUNDED_DEPTHS):
        flanks = [(u_mm - 2 * gap, u_mm - gap), (u_mm + gap, u_mm + 2 * gap)]
        parts = [(curve.u_mm >= low) & (curve.u_mm <= high) for low, high in flanks]
        if min(int(part.sum()) for part in parts) < _LEAST:
            continue
        lines = [np.polyfit(curve.u_mm[part] - u_mm, curve.force_N[part], 1) for part in parts]
        turn = lines[0][0] - lines[1][0]
        at = (lines[1][1] - lines[0][1]) / turn if turn > 0 else np.inf
        if abs(at) > gap:
            continue
        above = float(lines[0][0] * at + lines[0][1]) - force_N
        # A line of n points carried on by one and a half of its lengths: its noise grows to 6 / sqrt(n).
        noise = 6 * float(np.median(curve.noise_std_N)) / np.sqrt(min(int(part.sum()) for part in parts))
        if above > 3 * noise:
            highest = max(highest, above)
    return highest / float(np.sqrt(3.0))


def _knee(curve: Curve, *, late: bool) -> Initial:
    """Where the first steep rise ends: the hinge of two lines that fit best."""
    u, force = curve.u_mm, curve.force_N
    begin_mm = float(u[0])
    if u.size < 2 * _LEAST + 1:
        return _missing("no initial peak, and too few points for the end of the first rise")
    start = np.append(0.0, u), np.append(0.0, force)  # contact
    fits = [_hinge(*start, place) for place in u[:-_LEAST]]
    hinge, before, after, squares = min(fits, key=lambda fit: fit[3])
    if before < _STEEPER * max(after, 0.0):
        return _missing("no initial peak, and no steep rise that ends within half a depth")
    if late and hinge <= begin_mm:
        return _missing(
            f"no initial peak, and the record begins at u = {begin_mm:.3g} mm, past the first rise"
        )
    level = before * hinge
    rounded = level - float(np.interp(hinge, u, force))
    noise = float(np.sqrt(squares / max(u.size - 2, 1) / _LEAST))
    std = float(np.sqrt(noise**2 + rounded**2 / 3 + np.interp(hinge, u, curve.shared_std_N) ** 2))
    u_std = float(np.hypot(curve.step_mm / np.sqrt(12.0), std / max(before - after, 1e-300)))
    return Initial(hinge, u_std, level, std, -1, "no initial peak: where the first steep rise ends")


def _hinge(u: Floats, force: Floats, place: float) -> tuple[float, float, float, float]:
    """Place, slopes before and after it, and sum of squares of two lines from zero that meet there."""
    basis = np.column_stack([np.minimum(u, place), np.maximum(u - place, 0.0)])
    slopes = np.linalg.lstsq(basis, force, rcond=None)[0]
    left = force - basis @ slopes
    return float(place), float(slopes[0]), float(slopes[1]), float(left @ left)
