"""Photographs: reading, order, times, noise, and calibration from px to mm."""

from ploughval.photos.calibration import calibrate
from ploughval.photos.frames import FrameSeries
from ploughval.photos.mapping import Calibration
from ploughval.photos.noise import NoiseCurve, noise_curve
from ploughval.photos.opening import open_frames

__all__ = ["Calibration", "FrameSeries", "NoiseCurve", "calibrate", "noise_curve", "open_frames"]
