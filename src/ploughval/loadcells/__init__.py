"""Load-cell logs to force, line of action and their uncertainties."""

from ploughval.loadcells.at_times import force_at
from ploughval.loadcells.bending import CellGeometry, horizontal_force, line_of_action
from ploughval.loadcells.calibration import CellCalibrationResult, calibrate_cells, fit_response
from ploughval.loadcells.drift import ZeroLine, zero_line
from ploughval.loadcells.force import ForceResult, measure_force
from ploughval.loadcells.friction import Friction, empty_run, friction_of
from ploughval.loadcells.logs import Log, read_log
from ploughval.loadcells.motion import find_motion
from ploughval.loadcells.record import ForceArrays, Rig, force_from_readings
from ploughval.loadcells.response import CellResponse
from ploughval.loadcells.smoothing import smooth
from ploughval.loadcells.zero import Zero, zero_of

__all__ = [
    "CellCalibrationResult",
    "CellGeometry",
    "CellResponse",
    "ForceArrays",
    "ForceResult",
    "Friction",
    "Log",
    "Rig",
    "Zero",
    "ZeroLine",
    "calibrate_cells",
    "empty_run",
    "find_motion",
    "fit_response",
    "force_at",
    "force_from_readings",
    "friction_of",
    "horizontal_force",
    "line_of_action",
    "measure_force",
    "read_log",
    "smooth",
    "zero_line",
    "zero_of",
]
