"""Subset correlation: displacements between two pictures, and points tracked through a series."""

from ploughval.piv.correlate import Tracks, correlate
from ploughval.piv.movement import UNMOVED, CameraMovement
from ploughval.piv.sequence import Tracker
from ploughval.piv.state import FramePoints
from ploughval.piv.steady import CameraWatch
from ploughval.piv.strain import StrainField, StrainMeasure, strain_field
from ploughval.piv.subsets import Description

__all__ = [
    "UNMOVED",
    "CameraMovement",
    "CameraWatch",
    "Description",
    "FramePoints",
    "StrainField",
    "StrainMeasure",
    "Tracker",
    "Tracks",
    "correlate",
    "strain_field",
]
