"""The table of the load cells in test.toml: logs, geometry of the cells, calibration."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field

from ploughval.errors import Fault
from ploughval.scene_base import Finite, NotNegative, Positive, Table
from ploughval.scene_faults import number


class LogColumns(Table):
    """[loadcells.columns]: what the columns of the log are called."""

    time_s: str = "time_s"
    displacement_mm: str = "displacement_mm"
    moment_upper_Nm: str = "moment_upper_Nm"
    moment_lower_Nm: str = "moment_lower_Nm"


class CellCalibration(Table):
    """[loadcells.calibration]: moment per unit of the log, with standard uncertainties."""

    upper_Nm_per_unit: Finite = 1.0
    lower_Nm_per_unit: Finite = 1.0
    upper_Nm_per_unit_std: NotNegative = 0.0
    lower_Nm_per_unit_std: NotNegative = 0.0


class LoadCells(Table):
    """[loadcells]: two bending-moment cells and their log."""

    log: str = Field(description="CSV or TDMS file, relative to the test folder")
    empty: tuple[str, ...] = Field(
        (), description="patterns of empty-box runs; none: no friction compensation"
    )
    spacing_mm: Positive = Field(description="distance between the two cells, mm")
    lower_to_tip_mm: Positive = Field(description="height of the lower cell above the tip, mm")
    spacing_std_mm: NotNegative = 0.0
    lower_to_tip_std_mm: NotNegative = 0.0
    rest_s: tuple[Finite, Finite] | None = Field(None, description="window before motion, s")
    compensation: Literal["per_cell", "force_only"] = Field(
        "per_cell", description="friction taken off each cell, or off the force alone"
    )
    columns: LogColumns = LogColumns()
    calibration: CellCalibration = CellCalibration()

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """A window of rest that ends before it starts."""
        window = values.get("rest_s")
        if not isinstance(window, list | tuple) or len(window) != 2:
            return []
        start, end = (number({"s": s}, "s") for s in window)
        if start is None or end is None or start < end:
            return []
        return [Fault("rest_s", str(list(window)), "[start, end] with start before end")]
