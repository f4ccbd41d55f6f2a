"""Photographs: reading, order, times, noise, and calibration from px to mm."""

from ploughval.photos.calibration.calibrate import calibrate
from ploughval.photos.calibration.mapping import Calibration
from ploughval.photos.noise import NoiseCurve, noise_curve
from ploughval.photos.series.frames import FrameSeries
from ploughval.photos.series.opening import open_frames

__all__ = ["Calibration", "FrameSeries", "NoiseCurve", "calibrate", "noise_curve", "open_frames"]
