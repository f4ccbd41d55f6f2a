"""The table of the load cells in test.toml: logs, geometry of the cells, calibration."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from ploughval.errors import Fault
from ploughval.scene_base import Finite, Length, NotNegative, Positive, Table
from ploughval.scene_faults import number


class LogColumns(Table):
    """[loadcells.columns]: what the columns of the log are called; a unit may follow in brackets."""

    time_s: str = Field(
        "time_s", description="column of seconds, date-times or sample numbers; empty for none, with rate_hz"
    )
    displacement_mm: str = Field("displacement_mm", description="column of the blade's displacement, mm")
    moment_upper_Nm: str = Field("moment_upper_Nm", description="column of the upper cell, N m or its units")
    moment_lower_Nm: str = Field("moment_lower_Nm", description="column of the lower cell, N m or its units")
    date: str | None = Field(None, description="column of dates, where time_s is one of times of day alone")


class Staircase(Table):
    """[[loadcells.calibration.staircases]]: a log in which known loads were hung on one after the other."""

    log: str = Field(description="CSV file with the columns of the log, relative to the test folder")
    loads_N: tuple[Finite, ...] = Field(min_length=2, description="loads in the order in which they hung, N")
    arm_mm: Finite = Field(description="height of the loads above the tip, mm")
    load_std_N: NotNegative = Field(0.0, description="standard uncertainty of each load, N")
    arm_std_mm: NotNegative = Field(0.0, description="standard uncertainty of the arm, mm")


class CellCalibration(Table):
    """[loadcells.calibration]: constants with their standard uncertainties, or files of known loads."""

    upper_Nm_per_unit: Finite = Field(1.0, description="moment for a unit of the upper cell's column, N m")
    lower_Nm_per_unit: Finite = Field(1.0, description="moment for a unit of the lower cell's column, N m")
    upper_Nm_per_unit_std: NotNegative = Field(0.0, description="standard uncertainty of the upper, N m")
    lower_Nm_per_unit_std: NotNegative = Field(0.0, description="standard uncertainty of the lower, N m")
    files: tuple[str, ...] = Field((), description="patterns of calibration tables")
    staircases: tuple[Staircase, ...] = ()
    g_m_s2: Positive = Field(9.80665, description="acceleration of gravity where mass_kg is given, m/s^2")

    @property
    def patterns(self) -> tuple[str, ...]:
        """Names or patterns of all files of known loads."""
        return (*self.files, *(staircase.log for staircase in self.staircases))

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """Constants beside files that give them."""
        if not values.get("files") and not values.get("staircases"):
            return []
        both = [
            key
            for key, field in cls.model_fields.items()
            if "_per_unit" in key and values.get(key, field.default) != field.default
        ]
        expected = "either constants or files and staircases"
        return [Fault(key, f"{values[key]!r} beside calibration files", expected) for key in both]


class LoadCells(Table):
    """[loadcells]: two bending-moment cells and their log."""

    log: str | Annotated[tuple[str, ...], Field(min_length=1)] = Field(
        description="CSV or TDMS file, relative to the test folder, or a list of files and patterns"
    )
    rate_hz: Positive | None = Field(
        None, description="rows a second, where the log holds sample numbers or no times"
    )
    empty: tuple[str, ...] = Field(
        (), description="patterns of empty-box runs; none: no friction compensation"
    )
    spacing_mm: Length = Field(description="distance between the two cells, mm")
    lower_to_tip_mm: Length = Field(description="height of the lower cell above the tip, mm")
    spacing_std_mm: NotNegative = Field(0.0, description="standard uncertainty of the spacing, mm")
    lower_to_tip_std_mm: NotNegative = Field(0.0, description="standard uncertainty of that height, mm")
    rest_s: tuple[Finite, Finite] | None = Field(None, description="window before motion, s")
    rest_end_s: tuple[Finite, Finite] | None = Field(
        None, description="window after the test with the cells unloaded again, s: zeros run straight to it"
    )
    bandwidth_Hz: Positive | None = Field(
        None, description="the readings are smoothed to this bandwidth, Hz; absent: not smoothed"
    )
    compensation: Literal["per_cell", "force_only"] = Field(
        "per_cell", description="friction taken off each cell, or off the force alone"
    )
    columns: LogColumns = LogColumns()
    calibration: CellCalibration = CellCalibration()

    @property
    def log_patterns(self) -> tuple[str, ...]:
        """Names or patterns of the files of the log."""
        return (self.log,) if isinstance(self.log, str) else self.log

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """A window of rest that ends before it starts; a second one that is not after the first."""
        first, second = _window(values, "rest_s"), _window(values, "rest_end_s")
        faults = [
            Fault(key, str(list(window)), "[start, end] with start before end")
            for key, window in (("rest_s", first), ("rest_end_s", second))
            if window is not None and not window[0] < window[1]
        ]
        if not faults and first is not None and second is not None and not first[1] < second[0]:
            faults.append(Fault("rest_end_s", str(list(second)), f"a window after rest_s = {list(first)}"))
        return faults


def _window(values: Mapping[str, Any], key: str) -> tuple[float, float] | None:
    """A window of two numbers; None where it is not given or not of that kind."""
    window = values.get(key)
    if not isinstance(window, list | tuple) or len(window) != 2:
        return None
    start, end = (number({"s": s}, "s") for s in window)
    return None if start is None or end is None else (start, end)
