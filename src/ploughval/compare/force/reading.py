"""A force history with its extremes, its initial force and its switches."""

from dataclasses import dataclass

import pandas as pd

from ploughval.compare.force.curve import Curve
from ploughval.compare.force.initial import Initial, find_initial
from ploughval.compare.force.peaks import find_extremes

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
    """

    curve: Curve
    extremes: pd.DataFrame
    initial: Initial

    @property
    def peaks(self) -> pd.DataFrame:
        """Rows of the peaks, the initial one included."""
        return self.extremes[self.extremes["kind"] == "peak"]

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


def read_force(curve: Curve, prominence_N: float, depth_mm: float) -> Reading:
    """Find peaks, troughs and the initial force of a history.

    Parameters
    ----------
    curve : Curve
        Up to the common travel.
    prominence_N : float
        Least prominence of a peak, N.
    depth_mm : float
        Depth of the tip.
    """
    extremes = find_extremes(curve, prominence_N, rebound_mm=REBOUND_DEPTHS * depth_mm)
    return Reading(curve, extremes, find_initial(curve, extremes, depth_mm))
