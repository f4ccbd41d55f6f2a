"""Subset correlation: displacements between two pictures, and points tracked through a series."""

from ploughval.piv.correlate import Tracks, correlate
from ploughval.piv.sequence import Tracker
from ploughval.piv.state import FramePoints
from ploughval.piv.strain import StrainField, StrainMeasure, strain_field

__all__ = ["FramePoints", "StrainField", "StrainMeasure", "Tracker", "Tracks", "correlate", "strain_field"]
