"""test.toml as frozen, validated settings; decides which steps a test needs."""

import hashlib
import json
import tomllib
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from ploughval.axes import Direction
from ploughval.errors import ConfigError, Fault

Positive = Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Angle = Annotated[float, Field(gt=0, lt=90, allow_inf_nan=False)]
Pixel = tuple[Finite, Finite]


class Step(StrEnum):
    """The steps of a run, in their order; a scene asks for some of them."""

    CALIBRATION = "calibration"
    BLADE = "blade"
    FORCE = "force"
    SURFACE = "surface"
    TRACKS = "tracks"
    LAYERS = "layers"
    DYE = "dye"
    BANDS = "bands"
    MODEL = "model"
    COMPARE = "compare"
    REPORT = "report"


class Table(BaseModel):
    """Base of every table of test.toml: frozen, and unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)


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


class Box(Table):
    """[box]: the strongbox."""

    length_mm: Positive | None = Field(None, description="inner length along the travel, mm")


class Soil(Table):
    """[soil]: the sand, with the standard uncertainties that the validation carries."""

    unit_weight_kN_m3: Annotated[float, Field(gt=0, le=100, description="unit weight, kN/m3")]
    peak_friction_deg: Angle = Field(description="peak friction angle, degrees")
    residual_friction_deg: Angle = Field(description="residual friction angle, degrees")
    mobilization_length_mm: NotNegative = Field(1.0, description="slip from peak to residual, mm")
    wall_friction_deg: Annotated[float, Field(ge=0, lt=90)] = Field(
        0.0, description="blade-sand friction angle, degrees"
    )
    repose_deg: Angle | None = Field(None, description="slope at which the surface avalanches, degrees")
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
    def softens(self) -> bool:
        """Whether the friction angle falls with slip at all."""
        return self.peak_friction_deg > self.residual_friction_deg

    @model_validator(mode="after")
    def _angles_are_possible(self) -> Self:
        if self.residual_friction_deg > self.peak_friction_deg:
            raise ValueError(
                f"residual_friction_deg {self.residual_friction_deg} above "
                f"peak_friction_deg {self.peak_friction_deg}"
            )
        if self.peak_friction_deg + self.wall_friction_deg >= 90:
            raise ValueError("peak_friction_deg + wall_friction_deg must stay below 90 degrees")
        return self


class Interval(Table):
    """Times of photographs taken at a constant interval."""

    start_s: Finite = Field(description="time of the first photograph, s")
    interval_s: Positive = Field(description="time between two photographs, s")


class Board(Table):
    """A calibration board photographed in the window plane."""

    kind: Literal["charuco", "chessboard", "dots"] = Field(description="pattern of the board")
    picture: str = Field(description="photograph of the board, relative to the test folder")
    columns: Annotated[int, Field(ge=3, le=100)] = Field(
        description="squares (charuco), inner corners or dots in a row"
    )
    rows: Annotated[int, Field(ge=3, le=100)] = Field(
        description="squares (charuco), inner corners or dots in a column"
    )
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
    view_px: tuple[int, int, int, int] | None = Field(
        None, description="[x0, y0, x1, y1] part of the photograph that shows the test, px"
    )

    @model_validator(mode="after")
    def _one_calibration(self) -> Self:
        given = [k for k in ("mm_per_px", "control_points", "board") if getattr(self, k) is not None]
        if len(given) != 1:
            raise ValueError(
                "exactly one of mm_per_px, control_points and board must be given; "
                f"got {', '.join(given) if given else 'none'}"
            )
        if self.control_points is None and self.tip_px is None:
            raise ValueError(f"tip_px is needed with {given[0]}")
        if self.control_points is not None and len(self.control_points) < 4:
            raise ValueError(f"control_points holds {len(self.control_points)} points; at least 4 are needed")
        return self


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

    @model_validator(mode="after")
    def _rest_is_a_window(self) -> Self:
        if self.rest_s is not None and not self.rest_s[0] < self.rest_s[1]:
            raise ValueError(f"rest_s must be [start, end] with start < end; got {list(self.rest_s)}")
        return self


class Tracers(Table):
    """[tracers]: material lines to follow."""

    layers_mm: tuple[Finite, ...] = Field(description="initial heights above the tip, mm")
    dyed: bool | tuple[bool, ...] = Field(
        False, description="whether the layers are dyed sand, for all or each"
    )
    dye: Literal["dark", "pale"] = Field("dark", description="dyed sand against the rest")
    thickness_mm: Positive | None = Field(None, description="thickness of a dyed layer, mm")

    @model_validator(mode="after")
    def _one_flag_each(self) -> Self:
        if not isinstance(self.dyed, bool) and len(self.dyed) != len(self.layers_mm):
            raise ValueError(f"dyed holds {len(self.dyed)} values for {len(self.layers_mm)} layers")
        if len(set(self.layers_mm)) != len(self.layers_mm):
            raise ValueError("layers_mm holds the same height twice")
        return self

    @property
    def dyed_layers_mm(self) -> tuple[float, ...]:
        """Heights of those layers that are dyed sand, mm."""
        flags = [self.dyed] * len(self.layers_mm) if isinstance(self.dyed, bool) else self.dyed
        return tuple(h for h, dyed in zip(self.layers_mm, flags, strict=True) if dyed)


class Piv(Table):
    """[piv]: subset correlation."""

    track: bool = Field(True, description="false: texture too poor to track points; layers only where dyed")
    subset_px: Annotated[int, Field(ge=9, le=201)] = Field(31, description="side of a subset, px (odd)")
    spacing_px: Positive | None = Field(None, description="distance of points, px; absent: from the subset")
    order: Literal[0, 1, 2] = Field(1, description="order of the shape function")
    spline: Literal[3, 5] = Field(5, description="order of the interpolating B-spline")
    zncc_min: Annotated[float, Field(ge=0, le=1)] = Field(
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

    run: bool = Field(True, description="false: no model for this test")
    displacement_mm: Positive | None = Field(
        None, description="blade travel; absent: the test's own, or 3 depths"
    )
    tolerance: Annotated[float, Field(gt=0, le=0.1)] = Field(
        1e-3, description="relative numerical error aimed at"
    )
    outcrop: Literal["stationary", "riding"] = Field("stationary", description="rule for the band's outcrop")
    initial_surface_mm: tuple[Pixel, ...] | None = Field(
        None, description="[x, y] of the initial surface ahead of the blade, mm; absent: flat"
    )


class Compare(Table):
    """[compare]: peaks and matching."""

    prominence: Annotated[float, Field(gt=0)] | None = Field(
        None, description="least prominence of a force peak, in P0"
    )


class Report(Table):
    """[report]: the page."""

    frames_shown: Annotated[int, Field(ge=1, le=60)] = Field(4, description="stages shown side by side")


class Scene(Table):
    """One test: the settings of its test.toml and the folder it stands in."""

    folder: Path = Field(Path(), exclude=True)
    source: Path = Field(Path("test.toml"), exclude=True)
    test: TestTable
    blade: Blade
    box: Box = Box()
    soil: Soil | None = None
    camera: Camera | None = None
    loadcells: LoadCells | None = None
    tracers: Tracers | None = None
    piv: Piv = Piv()
    bands: Bands = Bands()
    model: ModelTable = ModelTable()
    compare: Compare = Compare()
    report: Report = Report()

    @model_validator(mode="after")
    def _tables_fit_together(self) -> Self:
        if self.tracers is not None and self.camera is None and self.soil is None:
            raise ValueError("[tracers] needs [camera] or [soil]: nothing else shows or predicts layers")
        if self.camera is None and self.loadcells is None and self.soil is None:
            raise ValueError("nothing to do: give at least one of [camera], [loadcells] and [soil]")
        return self

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps that this scene calls for, in the order in which they run."""
        photographs = self.camera is not None
        tracked = photographs and self.piv.track
        layers = self.tracers is not None and bool(self.tracers.layers_mm)
        measured = photographs or self.loadcells is not None
        modelled = self.soil is not None and self.model.run
        wanted = {
            Step.CALIBRATION: photographs,
            Step.BLADE: photographs,
            Step.FORCE: self.loadcells is not None,
            Step.SURFACE: photographs,
            Step.TRACKS: tracked,
            Step.LAYERS: tracked and layers,
            Step.DYE: photographs and self.tracers is not None and bool(self.tracers.dyed_layers_mm),
            Step.BANDS: tracked,
            Step.MODEL: modelled,
            Step.COMPARE: modelled and measured,
            Step.REPORT: True,
        }
        return tuple(step for step in Step if wanted[step])

    @property
    def settings_json(self) -> str:
        """All settings, defaults included, as one JSON string with sorted keys."""
        return json.dumps(self.model_dump(mode="json"), sort_keys=True)

    @property
    def settings_hash(self) -> str:
        """SHA-256 of :attr:`settings_json`, hexadecimal."""
        return hashlib.sha256(self.settings_json.encode()).hexdigest()

    def path(self, name: str) -> Path:
        """A file named in test.toml as a path: relative names start at the test folder."""
        return self.folder / name

    def matches(self, pattern: str) -> list[Path]:
        """Files of the test folder that match a pattern, sorted by name."""
        return sorted(p for p in self.folder.glob(pattern) if p.is_file())


def load_scene(path: Path | str) -> Scene:
    """Read and validate a test folder's settings.

    Parameters
    ----------
    path : path-like
        A test folder, or its test.toml.

    Returns
    -------
    Scene
        Frozen settings; ``scene.steps`` says what the test needs.

    Raises
    ------
    ConfigError
        Unreadable file, unknown keys, wrong values, missing files: all faults together.
    """
    path = Path(path)
    source = path / "test.toml" if path.is_dir() else path
    data = _read_toml(source)
    for reserved in ("folder", "source"):
        if reserved in data:
            raise ConfigError(source, [Fault(reserved, "a key", "no such key", "Remove it.")])
    try:
        scene = Scene.model_validate({**data, "folder": source.parent, "source": source})
    except ValidationError as error:
        raise ConfigError(source, _faults(error)) from None
    faults = _missing_files(scene)
    if faults:
        raise ConfigError(source, faults)
    return scene


def _read_toml(source: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(source.read_bytes().decode("utf-8-sig"))
    except FileNotFoundError:
        fault = Fault("file", "nothing", "a test.toml", f"Write one with: ploughval init {source.parent}")
    except (OSError, UnicodeDecodeError) as error:
        fault = Fault("file", f"{type(error).__name__}", "a readable UTF-8 file", str(error))
    except tomllib.TOMLDecodeError as error:
        fault = Fault("file", "a line that is not TOML", "TOML", f"{error}.")
    raise ConfigError(source, [fault])


def _faults(error: ValidationError) -> list[Fault]:
    faults = []
    for item in error.errors(include_url=False):
        place = ".".join(str(part) for part in item["loc"]) or "test.toml"
        if item["type"] == "missing":
            faults.append(Fault(place, "nothing", "a value", f"Add it: {_describe(item['loc'])}"))
        elif item["type"] == "extra_forbidden":
            faults.append(
                Fault(place, repr(item["input"])[:80], "no such key", "Remove it or correct its name.")
            )
        else:
            shown = repr(item["input"])[:80] if not isinstance(item["input"], dict) else "this table"
            faults.append(
                Fault(place, shown, item["msg"].removeprefix("Value error, "), _describe(item["loc"]))
            )
    return faults


def _describe(location: tuple[int | str, ...]) -> str:
    """The description of the field at a location of the settings, or an empty string."""
    table: Any = Scene
    text = ""
    for part in location:
        fields = getattr(table, "model_fields", {})
        if part not in fields:
            break
        text = fields[part].description or text
        kinds = [fields[part].annotation, *getattr(fields[part].annotation, "__args__", ())]
        table = next((k for k in kinds if isinstance(k, type) and issubclass(k, Table)), None)
    return f"It is the {text}." if text else ""


def _missing_files(scene: Scene) -> list[Fault]:
    """Faults for files and patterns of the scene that match nothing or leave the folder."""
    wanted: list[tuple[str, str]] = []
    if scene.camera is not None:
        wanted.append(("camera.photos", scene.camera.photos))
        if isinstance(scene.camera.times, str) and scene.camera.times != "exif":
            wanted.append(("camera.times", scene.camera.times))
        if scene.camera.board is not None:
            wanted.append(("camera.board.picture", scene.camera.board.picture))
    if scene.loadcells is not None:
        wanted.append(("loadcells.log", scene.loadcells.log))
        wanted += [(f"loadcells.empty.{k}", name) for k, name in enumerate(scene.loadcells.empty)]
    faults = []
    for place, pattern in wanted:
        if not pattern or Path(pattern).is_absolute() or ".." in Path(pattern).parts or "\0" in pattern:
            faults.append(Fault(place, repr(pattern), "a path inside the test folder"))
        elif not scene.matches(pattern):
            faults.append(
                Fault(
                    place,
                    repr(pattern),
                    "at least one file that matches",
                    f"Nothing matches in {scene.folder}.",
                )
            )
    return faults
