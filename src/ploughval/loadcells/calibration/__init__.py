"""Calibration of the two cells: known loads to what readings mean, and how good the cells are."""

from ploughval.loadcells.calibration.cells import RESULT_COLUMNS, CellCalibrationResult, calibrate_cells
from ploughval.loadcells.calibration.choice import CHOICE_COLUMNS
from ploughval.loadcells.calibration.fitted import ResponseFit, fit_response
from ploughval.loadcells.calibration.quality import QUALITY_COLUMNS

__all__ = [
    "CHOICE_COLUMNS",
    "QUALITY_COLUMNS",
    "RESULT_COLUMNS",
    "CellCalibrationResult",
    "ResponseFit",
    "calibrate_cells",
    "fit_response",
]
