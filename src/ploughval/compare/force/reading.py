"""A force history with its extremes, its initial force and its switches."""

from dataclasses import dataclass

import pandas as pd

from ploughval.compare.force.curve import Curve
from ploughval.compare.force.initial import LATEST_DEPTHS, Initial, find_initial
from ploughval.compare.force.peaks import Weak, find_extremes

REBOUND_DEPTHS = 0.1  # a lower peak so soon after another is part of its fall


@dataclass(frozen=True, slots=True)
class Reading:
    """What is read from one side's force history.

    Attributes
    ----------
    curve : Curve
        Up to the common travel.
    extremes : DataFrame
        PEAK_COLUMNS.
    initial : Initial
        The initial force.
    begin_mm : float
        Travel at which the record begins that this one is compared with: peaks before it do not count.
    """

    curve: Curve
    extremes: pd.DataFrame
    initial: Initial
    begin_mm: float = 0.0

    @property
    def peaks(self) -> pd.DataFrame:
        """Rows of the peaks, the initial one included."""
        return self.extremes[(self.extremes["kind"] == "peak") & (self.extremes["u_mm"] >= self.begin_mm)]

    @property
    def switches(self) -> pd.DataFrame:
        """Rows of the peaks after the initial one: there a fresh band takes over."""
        peaks = self.peaks
        return peaks[peaks.index > self.initial.row]

    @property
    def first_trough(self) -> pd.DataFrame:
        """The row of the lowest point after the initial peak; none without that peak."""
        lows = self.extremes[(self.extremes["kind"] == "trough") & (self.extremes.index > self.initial.row)]
        return lows.iloc[: 1 if self.initial.row >= 0 else 0]


def read_force(
    curve: Curve,
    prominence_N: float,
    depth_mm: float,
    *,
    weak_N: float | None = None,
    begin_mm: float = 0.0,
) -> Reading:
    """Find peaks, troughs and the initial force of a history.

    Whether the force falls much or little after its initial peak depends on the sand. Where no peak of full
    prominence is initial, the most prominent lesser one before the first switch is let in, so that noise
    does not decide whether the initial peak counts.

    Parameters
    ----------
    curve : Curve
        Up to the common travel.
    prominence_N : float
        Least prominence of a peak, N.
    depth_mm : float
        Depth of the tip.
    weak_N : float or None
        Least prominence of the initial peak, N; None: that of the others.
    begin_mm : float
        Travel before which peaks do not count.
    """
    rebound = REBOUND_DEPTHS * depth_mm
    extremes = find_extremes(curve, prominence_N, rebound_mm=rebound)
    initial = find_initial(curve, extremes, depth_mm)
    if initial.row < 0 and weak_N is not None:
        switches = extremes["u_mm"][extremes["kind"] == "peak"]
        before = min(LATEST_DEPTHS * depth_mm, float(switches.min()) if len(switches) else float("inf"))
        extremes = find_extremes(curve, prominence_N, rebound_mm=rebound, weak=Weak(before, weak_N))
        initial = find_initial(curve, extremes, depth_mm)
    return Reading(curve, extremes, initial, begin_mm)
