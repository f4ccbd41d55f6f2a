"""The tables of test.toml: keys with unit, range and meaning, and what contradicts itself within a table."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from ploughval.axes import Direction
from ploughval.errors import Fault
from ploughval.scene_faults import number

# strict: neither text nor true is a number, and no number is text
Positive = Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False, strict=True)]
NotNegative = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False, strict=True)]
Finite = Annotated[float, Field(ge=-1e12, le=1e12, allow_inf_nan=False, strict=True)]
Angle = Annotated[float, Field(gt=0, lt=90, allow_inf_nan=False, strict=True)]
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(ge=3, le=100, strict=True)]
Pixel = tuple[Finite, Finite]


class Table(BaseModel):
    """Base of every table of test.toml: frozen, and unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """What in the table's values contradicts itself; values of wrong type are passed over."""
        return []

    @model_validator(mode="after")
    def _no_conflicts(self) -> Self:
        faults = self.conflicts(vars(self))
        if faults:
            raise ValueError("; ".join(map(str, faults)))
        return self


class TestTable(Table):
    """[test]: what the test is called."""

    __test__ = False
    name: str = Field(min_length=1, max_length=200, description="name of the test, plain text")
    notes: str = Field("", max_length=20_000, description="anything worth keeping, plain text")


class Blade(Table):
    """[blade]: the plough."""

    depth_mm: Positive = Field(description="depth of the tip below the initial surface, mm")
    width_mm: Positive = Field(description="width out of plane, mm; force_N is for this width")
    thickness_mm: Positive = Field(5.0, description="thickness in the direction of travel, mm")
    speed_mm_s: Positive | None = Field(None, description="speed of travel, mm/s")
    inclination_deg: Annotated[Finite, Field(ge=-60, le=60)] = Field(
        0.0, description="of the face to the vertical, degrees; positive: its top leans ahead, over the sand"
    )


class Box(Table):
    """[box]: the strongbox."""

    length_mm: Positive | None = Field(None, description="inner length along the travel, mm")


class Soil(Table):
    """[soil]: the sand, with the standard uncertainties that the validation carries."""

    unit_weight_kN_m3: Annotated[Positive, Field(le=100, description="unit weight, kN/m3")]
    peak_friction_deg: Angle = Field(description="peak friction angle, degrees")
    residual_friction_deg: Angle = Field(description="residual friction angle, degrees")
    mobilization_length_mm: NotNegative = Field(1.0, description="slip from peak to residual, mm")
    wall_friction_deg: Annotated[NotNegative, Field(lt=90)] = Field(
        0.0, description="blade-sand friction angle, degrees"
    )
    repose_deg: Angle | None = Field(None, description="slope at which the surface avalanches, degrees")
    surcharge_kPa: NotNegative = Field(0.0, description="load on the surface, kPa of horizontal area")
    unit_weight_std_kN_m3: NotNegative = Field(0.0, description="standard uncertainty, kN/m3")
    peak_friction_std_deg: NotNegative = Field(0.0, description="standard uncertainty, degrees")
    residual_friction_std_deg: NotNegative = Field(0.0, description="standard uncertainty, degrees")
    mobilization_length_std_mm: NotNegative = Field(0.0, description="standard uncertainty, mm")
    wall_friction_std_deg: NotNegative = Field(0.0, description="standard uncertainty, degrees")

    @property
    def slope_of_repose_deg(self) -> float:
        """Angle at which the surface avalanches: repose_deg, or the residual friction angle, degrees."""
        return self.residual_friction_deg if self.repose_deg is None else self.repose_deg

    @property
    def horizontal_share(self) -> float:
        """Horizontal part of the blade's force P, which wall friction inclines: cos of the angle.

        The model's force is P; load cells measure P times this.
        """
        return math.cos(math.radians(self.wall_friction_deg))

    @property
    def softens(self) -> bool:
        """Whether the friction angle falls with slip at all."""
        return self.peak_friction_deg > self.residual_friction_deg

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """Residual above peak; peak and wall friction that leave no mechanism."""
        peak, residual = (number(values, f"{k}_friction_deg") for k in ("peak", "residual"))
        wall = number(values, "wall_friction_deg", 0.0)
        faults = []
        if peak is not None and residual is not None and residual > peak > 0:
            expected = f"at most peak_friction_deg, {peak:g}"
            faults.append(Fault("residual_friction_deg", f"{residual:g}", expected))
        if peak is not None and wall is not None and 0 < peak < 90 <= peak + wall < 180:
            expected = f"less than {90 - peak:g}, which is 90 - peak_friction_deg"
            faults.append(Fault("wall_friction_deg", f"{wall:g}", expected))
        return faults


class Interval(Table):
    """Times of photographs taken at a constant interval."""

    start_s: Finite = Field(description="time of the first photograph, s")
    interval_s: Positive = Field(description="time between two photographs, s")


class Board(Table):
    """A calibration board photographed in the window plane."""

    kind: Literal["charuco", "chessboard", "dots"] = Field(description="pattern of the board")
    picture: str = Field(description="photograph of the board, relative to the test folder")
    columns: Count = Field(description="squares (charuco), inner corners or dots in a row")
    rows: Count = Field(description="squares (charuco), inner corners or dots in a column")
    spacing_mm: Positive = Field(description="side of a square or distance of dots, mm")
    marker_mm: Positive | None = Field(None, description="side of a ChArUco marker, mm")
    dictionary: str = Field("DICT_4X4_50", description="OpenCV's name of the ChArUco dictionary")


class Camera(Table):
    """[camera]: the photographs, their times and their geometry."""

    photos: str = Field(description="pattern of the photographs, relative to the test folder")
    times: Literal["exif"] | str | Interval | None = Field(
        None, description='CSV (file,time_s), "exif", {start_s, interval_s}, or absent: times unknown'
    )
    mm_per_px: Positive | None = Field(None, description="scale, mm per px, with tip_px and direction")
    mm_per_px_std: NotNegative = Field(0.0, description="standard uncertainty of the scale, mm per px")
    tip_px: Pixel | None = Field(None, description="blade face at tip level before the blade moves, px")
    direction: Direction = Field(Direction.RIGHT, description="the way the blade travels in the photograph")
    control_points: tuple[tuple[Finite, Finite, Finite, Finite], ...] | None = Field(
        None, description="[px_x, px_y, x_mm, y_mm] each, at least 4"
    )
    board: Board | None = Field(None, description="board in the window plane, with tip_px and direction")
    clock_offset_s: Finite | Literal["auto"] = Field(0.0, description="photograph clock minus log clock, s")
    channel: Literal["grey", "red", "green", "blue"] = Field("grey", description="what is correlated")
    view_px: tuple[Whole, Whole, Whole, Whole] | None = Field(
        None, description="[x0, y0, x1, y1] part of the photograph that shows the test, px"
    )

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """No calibration or two of them; a scale or board without tip; too few control points."""
        ways = ("mm_per_px", "control_points", "board")
        given = [k for k in ways if values.get(k) is not None]
        faults = []
        if len(given) != 1:
            got = " and ".join(given) or "none"
            faults.append(
                Fault("", got, f"exactly one of {', '.join(ways)}", "It calibrates the photographs.")
            )
        if values.get("tip_px") is None and given and "control_points" not in given:
            faults.append(Fault("tip_px", "nothing", f"a value with {given[0]}", cls._text("tip_px")))
        points = values.get("control_points")
        if isinstance(points, list | tuple) and len(points) < 4:
            faults.append(Fault("control_points", f"{len(points)} points", "at least 4"))
        return faults

    @classmethod
    def _text(cls, key: str) -> str:
        return f"Add {key}: {cls.model_fields[key].description}."


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


class Tracers(Table):
    """[tracers]: material lines to follow."""

    layers_mm: tuple[Finite, ...] = Field(description="initial heights above the tip, mm")
    dyed: Flag | tuple[Flag, ...] = Field(
        False, description="whether the layers are dyed sand, for all or each"
    )
    dye: Literal["dark", "pale"] = Field(
        "dark", description="dyed sand against the rest, for the reader: the first photograph shows which"
    )
    thickness_mm: Positive | None = Field(None, description="thickness of a dyed layer, mm")

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """As many flags as layers; no layer twice."""
        layers, dyed = values.get("layers_mm"), values.get("dyed", False)
        if not isinstance(layers, list | tuple):
            return []
        faults = []
        if isinstance(dyed, list | tuple) and len(dyed) != len(layers):
            faults.append(
                Fault("dyed", f"{len(dyed)} values", f"one for each of {len(layers)} layers, or one")
            )
        twice = sorted({h for h in layers if isinstance(h, int | float) and layers.count(h) > 1})
        if twice:
            faults.append(Fault("layers_mm", f"{', '.join(map(str, twice))} twice", "each height once"))
        return faults

    @property
    def dyed_layers_mm(self) -> tuple[float, ...]:
        """Heights of those layers that are dyed sand, mm."""
        flags = [self.dyed] * len(self.layers_mm) if isinstance(self.dyed, bool) else self.dyed
        return tuple(h for h, dyed in zip(self.layers_mm, flags, strict=True) if dyed)


class Piv(Table):
    """[piv]: subset correlation."""

    track: Flag = Field(True, description="false: texture too poor to track points; layers only where dyed")
    subset_px: Annotated[int, Field(ge=9, le=201, strict=True)] = Field(
        31, description="side of a subset, px (odd)"
    )
    spacing_px: Annotated[Positive, Field(ge=2, le=1000)] | None = Field(
        None, description="distance of points, px; absent: from the subset"
    )
    order: Literal[0, 1, 2] = Field(1, description="order of the shape function")
    spline: Literal[3, 5] = Field(5, description="order of the interpolating B-spline")
    zncc_min: Annotated[NotNegative, Field(le=1)] = Field(
        0.7, description="least correlation of a valid vector"
    )
    noise_grey: NotNegative | None = Field(
        None, description="grey-level noise of one photograph; absent: estimated"
    )


class Bands(Table):
    """[bands]: the shear-band finder."""

    min_slip_mm: NotNegative | None = Field(None, description="least slip of a band that is reported, mm")


class ModelTable(Table):
    """[model]: the incremental-collapse model."""

    run: Flag = Field(True, description="false: no model for this test")
    displacement_mm: Positive | None = Field(
        None, description="blade travel; absent: the test's own, or 3 depths"
    )
    tolerance: Annotated[Positive, Field(ge=1e-6, le=0.1)] = Field(
        1e-3, description="relative numerical error aimed at"
    )
    outcrop: Literal["stationary", "riding"] = Field("stationary", description="rule for the band's outcrop")
    direction: Literal["least_force", "least_softened"] = Field(
        "least_force", description="a fresh band's direction: cheapest at peak friction, or once softened"
    )
    initial_surface_mm: tuple[Pixel, ...] | None = Field(
        None, description="[x, y] of the initial surface ahead of the blade, mm; absent: flat"
    )


class Compare(Table):
    """[compare]: peaks and matching."""

    prominence: Positive | None = Field(None, description="least prominence of a force peak, in P0")


class Report(Table):
    """[report]: the page."""

    frames_shown: Annotated[int, Field(ge=1, le=60, strict=True)] = Field(
        4, description="stages shown side by side"
    )
