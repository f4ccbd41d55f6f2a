"""Photographs: reading, order, times, and calibration from px to mm."""

from ploughval.photos.calibration import calibrate
from ploughval.photos.frames import FrameSeries
from ploughval.photos.mapping import Calibration
from ploughval.photos.opening import open_frames

__all__ = ["Calibration", "FrameSeries", "calibrate", "open_frames"]
