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
_WEAK_P0 = 0.02
_PROMINENCE_NOISE = 6.0
_PROMINENCE_RIPPLE = 2.5
_RIPPLES = 30  # local peaks from which on most of them are no bands'


class Weak(NamedTuple):
    """A stretch of travel, from the start, in which a lesser prominence (N) makes a peak."""

    before_mm: float
    prominence_N: float


def least_prominence(curve: Curve, P0_N: float, setting_P0: float | None) -> float:
    """Prominence (N) that a peak needs to be one: the setting or a tenth of P0, and more than the ripple."""
    return max((setting_P0 if setting_P0 is not None else _PROMINENCE_P0) * P0_N, ripple_prominence(curve))


def weak_prominence(curve: Curve, P0_N: float) -> float:
    """Prominence (N) that the initial peak needs: a fiftieth of P0, and more than the ripple."""
    return max(_WEAK_P0 * P0_N, ripple_prominence(curve))


def ripple_prominence(curve: Curve) -> float:
    """Prominence (N) that neither noise nor ripple reaches.

    6 times the noise, and 2.5 times the ripple of stick and slip: what 80 % of all the local peaks of the
    curve stay below, where there are enough of them.
    """
    floor = _PROMINENCE_NOISE * float(np.median(curve.noise_std_N))
    ripples = find_peaks(curve.force_N, prominence=0.0)[1]["prominences"]
    if ripples.size >= _RIPPLES:
        floor = max(floor, _PROMINENCE_RIPPLE * float(np.percentile(ripples, 80)))
    return floor


def find_extremes(
    curve: Curve, prominence_N: float, *, rebound_mm: float = 0.0, weak: Weak | None = None
) -> pd.DataFrame:
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
    weak : Weak or None
        Where one peak of less prominence is let in: the most prominent there.

    Returns
    -------
    DataFrame
        PEAK_COLUMNS, in order of travel. ``drop_N`` is the fall from a peak to its trough (an offset that
        both share cancels in its uncertainty, a gain does not), ``spacing_mm`` the travel to the next extreme
        of the same kind (NaN for the last). A trough at the very end of the curve is not one: the force may
        fall further.
    """
    force = curve.force_N
    least = prominence_N if weak is None else min(prominence_N, weak.prominence_N)
    found, properties = find_peaks(np.concatenate([[0.0], force]), prominence=least)
    tops, prominences = found - 1, properties["prominences"]
    kept = prominences >= prominence_N
    if weak is not None:
        early = np.flatnonzero(~kept & (curve.u_mm[tops] < weak.before_mm))
        kept[early[np.argmax(prominences[early])] if early.size else []] = True
    tops, prominences = tops[kept], prominences[kept]
    own = _without_rebounds(curve, tops, rebound_mm)
    tops, prominences = tops[own], prominences[own]
    lows = _lows(force, tops)
    inner = lows < force.size - 1
    both = np.concatenate([tops, lows])
    peaks, troughs = _Extremes.of(curve, tops, both, 1), _Extremes.of(curve, lows, both, -1)
    drop = peaks.force_N - troughs.force_N
    drop_std = np.sqrt(peaks.fresh_std_N**2 + troughs.fresh_std_N**2 + (curve.shared.gain * drop) ** 2)
    troughs = _Extremes._make(values[inner] for values in troughs)
    unknown = np.full((3, int(inner.sum())), np.nan)
    columns = [
        np.concatenate(pair)
        for pair in zip(
            (*peaks[:4], prominences, drop, drop_std, *_spacings(*peaks[:2])),
            (*troughs[:4], *unknown, *_spacings(*troughs[:2])),
            strict=True,
        )
    ]
    kind = np.repeat(["peak", "trough"], [tops.size, int(inner.sum())])
    order = np.argsort(columns[0], kind="stable")
    return pd.DataFrame(
        {name: values[order] for name, values in zip(PEAK_COLUMNS, (kind, *columns), strict=True)}
    )


class _Extremes(NamedTuple):
    """Extremes of one kind; all (K,). ``fresh_std_N`` is the part of the force's that is not shared."""

    u_mm: Floats
    u_std_mm: Floats
    force_N: Floats
    force_std_N: Floats
    fresh_std_N: Floats

    @classmethod
    def of(cls, curve: Curve, places: NDArray[np.intp], extremes: NDArray[np.intp], sign: int) -> "_Extremes":
        rows = np.array([_extreme(curve, int(k), sign, extremes) for k in places]).reshape(-1, 4)
        u, u_std, force, std = rows.T
        fresh = np.sqrt(np.maximum(std**2 - curve.shared_std_N[places] ** 2, 0.0))
        return cls(u, u_std, force, std, fresh)


def _spacings(u_mm: Floats, std_mm: Floats) -> tuple[Floats, Floats]:
    """Travel to the next place, NaN for the last, with its uncertainty."""
    gaps = np.append(np.diff(u_mm), np.nan)[: u_mm.size]
    return gaps, np.append(np.hypot(std_mm[1:], std_mm[:-1]), np.nan)[: u_mm.size]


def _lows(force: Floats, tops: NDArray[np.intp]) -> NDArray[np.intp]:
    """The lowest point between each peak and the next, or the end."""
    ends = np.append(tops[1:], force.size)[: len(tops)]
    return np.array([a + int(np.argmin(force[a:b])) for a, b in zip(tops, ends, strict=True)], dtype=np.intp)


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
            # Between the rows of a log nobody saw the force: a step is no less than two of them.
            u_std = max(corner.u_std_mm, curve.step_mm / float(np.sqrt(12.0)))
            return corner.u_mm, u_std, corner.force_N, std
        return round_extreme(curve, near, k, (first, last))
    return float(curve.u_mm[k]), 0.0, float(curve.force_N[k]), float(curve.std_N[k])


def _near(curve: Curve, k: int, sign: int) -> tuple[int, int]:
    """First and last point around an extreme that lie within three noise widths of it."""
    force = sign * curve.force_N
    limit = force[k] - 3 * curve.noise_std_N[k]
    # Six noise widths down the flank no neighbour belongs to this extreme any more.
    away = np.flatnonzero(force <= limit - 3 * curve.noise_std_N[k])
    left = int(away[away < k].max(initial=-1)) + 1
    right = int(away[away > k].min(initial=force.size))
    near = left + np.flatnonzero(force[left:right] >= limit)
    return int(near[0]), int(near[-1])
