"""What a result folder holds, read from its files; a file that is not there is None."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import xarray as xr
from pydantic import BaseModel, BeforeValidator, ConfigDict

from ploughval.axes import (
    BAND_COLUMNS,
    BLADE_COLUMNS,
    BUDGET_COLUMNS,
    FORCE_COLUMNS,
    INCREMENT_COLUMNS,
    LAYER_COLUMNS,
    MODEL_FORCE_COLUMNS,
    PRACTICE_COLUMNS,
    SURFACE_COLUMNS,
    VOLUME_COLUMNS,
)
from ploughval.errors import DataError
from ploughval.loadcells.calibration import CHOICE_COLUMNS, QUALITY_COLUMNS, RESULT_COLUMNS
from ploughval.photos import Calibration
from ploughval.photos.calibration.file import read_calibration
from ploughval.report.reading import REMEDY, read_record, read_table

MOBILISED_COLUMNS = ("frame", "u_mm", "slip_mm", "band", "phi_deg", "phi_std_deg")
PEAK_COLUMNS = ("source", "kind", "u_mm", "force_N")
TRACK_VARIABLES = ("x0_mm", "y0_mm", "x_mm", "y_mm", "std_mm", "zncc", "status", "time_s", "u_mm")


def _finite(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _text(value: object) -> object:
    return "" if value is None else str(value)


Number = Annotated[float | None, BeforeValidator(_finite)]
Text = Annotated[str, BeforeValidator(_text)]


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", protected_namespaces=())


class FrameEntry(_Entry):
    """One line of the frame ledger."""

    frame: int
    file: Text = ""
    time_s: Number = None
    time_std_s: Number = None
    u_mm: Number = None
    status: Text = "ok"
    reason: Text = ""
    notes: tuple[Text, ...] = ()

    @property
    def used(self) -> bool:
        """Whether the frame went through."""
        return self.status == "ok"


class CalibrationEntry(_Entry):
    """How pixels became millimetres."""

    method: Text = ""
    mm_per_px: Number = None
    scale_std: Number = None
    residual_px: Number = None


class NoiseEntry(_Entry):
    """Noise of the camera against grey level."""

    grey: tuple[float, ...]
    std: tuple[float, ...]
    std_std: tuple[float, ...]
    gain: Number = None
    floor: Number = None
    misfit: Number = None
    mean_grey: Number = None
    std_at_mean_grey: Number = None


class FrictionEntry(_Entry):
    """What was taken off for friction."""

    runs: int = 0
    mean_N: Number = None
    taken_off: Text = ""
    pieces: int = 1


class MeanLoadEntry(_Entry):
    """What the budget of the force adds up to."""

    force_N: Number = None
    force_std_N: Number = None
    arm_mm: Number = None
    arm_std_mm: Number = None


class LoadCellEntry(_Entry):
    """How the force came about; pairs are of the (upper, lower) cell."""

    zero_Nm: tuple[Number, ...] = ()
    zero_std_Nm: tuple[Number, ...] = ()
    noise_std_Nm: tuple[Number, ...] = ()
    noise_std_N: Number = None
    mean_load: MeanLoadEntry | None = None
    drift_Nm: tuple[Number, ...] = ()
    friction: FrictionEntry | None = None
    calibration: Text = ""
    condition: Number = None
    bandwidth_Hz: Number = None
    motion_starts_s: Number = None
    contact_s: Number = None
    contact_u_mm: Number = None
    contact_std_mm: Number = None


class RunRecord(_Entry):
    """run.json: versions, settings, inputs, frames."""

    ploughval: Text = ""
    test: Text = ""
    folder: Text = ""
    settings: dict[str, Any] = {}
    settings_hash: Text = ""
    versions: dict[str, Text] = {}
    inputs: dict[str, Text] = {}
    steps: tuple[str, ...] = ()
    frames: tuple[FrameEntry, ...] = ()
    calibration: CalibrationEntry | None = None
    loadcells: LoadCellEntry | None = None
    noise: NoiseEntry | None = None
    faults: tuple[Text, ...] = ()
    warnings: tuple[Text, ...] = ()


class MetricEntry(_Entry):
    """One metric of metrics.json; None is a value that could not be had."""

    unit: Text = ""
    experiment: Number = None
    experiment_std: Number = None
    model: Number = None
    model_std: Number = None
    error: Number = None
    validation_std: Number = None
    agrees: bool | None = None
    note: Text = ""
    input_std: Number = None
    numerical_std: Number = None
    dominant_input: Text = ""


class MetricsRecord(_Entry):
    """metrics.json."""

    test: Text = ""
    metrics: dict[str, MetricEntry] = {}
    warnings: tuple[Text, ...] = ()


@dataclass(frozen=True, slots=True)
class Results:
    """The files of one result folder; None where a file is not there."""

    folder: Path
    run: RunRecord
    metrics: MetricsRecord | None
    calibration: Calibration | None
    force: pd.DataFrame | None
    tracks: xr.Dataset | None
    layers: pd.DataFrame | None
    surface: pd.DataFrame | None
    volume: pd.DataFrame | None
    bands: pd.DataFrame | None
    increments: pd.DataFrame | None
    budget: pd.DataFrame | None
    cell_calibration: pd.DataFrame | None
    cell_models: pd.DataFrame | None
    cell_quality: pd.DataFrame | None
    mobilised: pd.DataFrame | None
    blade: pd.DataFrame | None
    peaks: pd.DataFrame | None
    practice: pd.DataFrame | None
    model_force: pd.DataFrame | None
    model_layers: pd.DataFrame | None
    model_bands: pd.DataFrame | None
    model_surface: pd.DataFrame | None

    @property
    def name(self) -> str:
        """The test's name, or the folder's where no file gives one."""
        from_metrics = self.metrics.test if self.metrics is not None else ""
        return self.run.test or from_metrics or self.folder.resolve().name

    @property
    def depth_mm(self) -> float | None:
        """Depth of the blade, mm."""
        return _positive(self.setting("blade", "depth_mm"))

    @property
    def thickness_mm(self) -> float:
        """Thickness of the blade, mm."""
        return float(self.setting("blade", "thickness_mm") or 5.0)

    @property
    def P0_N(self) -> float | None:
        """Divisor of forces: the model's first peak, else its first force, else the experiment's."""
        peak = self.metric("first_peak_N")
        first = None
        if self.model_force is not None and len(self.model_force):
            first = float(self.model_force["force_N"].iloc[0])
        candidates = (peak.model if peak else None, first, peak.experiment if peak else None)
        return next((value for value in map(_positive, candidates) if value is not None), None)

    def metric(self, name: str) -> MetricEntry | None:
        """A metric by its name, or None."""
        return None if self.metrics is None else self.metrics.metrics.get(name)

    @property
    def force_only(self) -> bool:
        """Whether friction was taken off the force alone, and not off its line of action."""
        compensated = self.run.loadcells is not None and self.run.loadcells.friction is not None
        return compensated and self.setting("loadcells", "compensation") == "force_only"

    def setting(self, *keys: str) -> Any:
        """A value of the settings by its table and key, or None."""
        value: Any = self.run.settings
        for key in keys:
            value = value.get(key) if isinstance(value, dict) else None
        return value


def _horizontal(model_force: pd.DataFrame | None, settings: Mapping[str, Any]) -> pd.DataFrame | None:
    """The model's force as load cells would measure it: wall friction and a face that leans incline P."""
    if model_force is None:
        return None
    angle_deg = 0.0
    for name, key in (("soil", "wall_friction_deg"), ("blade", "inclination_deg")):
        table = settings.get(name)
        angle_deg += float(table.get(key) or 0.0) if isinstance(table, Mapping) else 0.0
    return model_force.assign(force_N=model_force["force_N"] * math.cos(math.radians(angle_deg)))


def _positive(value: object) -> float | None:
    good = isinstance(value, int | float) and math.isfinite(value) and value > 0
    return float(value) if good else None  # type: ignore[arg-type]


def read_results(folder: Path | str) -> Results:
    """Read a result folder, or the ``results`` of a test folder.

    Parameters
    ----------
    folder : path-like
        Folder with the files of a run; none of them is required, but at least one must be there.

    Returns
    -------
    Results

    Raises
    ------
    DataError
        No result file at all, or one that cannot be read: file, what was expected, what to do.
    """
    folder = _with_files(Path(folder))
    run = read_record(folder / "run.json", RunRecord) or RunRecord()
    return Results(
        folder=folder,
        run=run,
        metrics=read_record(folder / "metrics.json", MetricsRecord),
        calibration=_calibration(folder / "calibration.json"),
        force=read_table(folder / "force.csv", FORCE_COLUMNS),
        tracks=_tracks(folder / "tracks.nc"),
        layers=read_table(folder / "layers.csv", LAYER_COLUMNS),
        surface=read_table(folder / "surface.csv", SURFACE_COLUMNS),
        volume=read_table(folder / "volume.csv", VOLUME_COLUMNS),
        bands=read_table(folder / "bands.csv", BAND_COLUMNS),
        increments=read_table(folder / "increments.csv", INCREMENT_COLUMNS),
        budget=read_table(folder / "budget.csv", BUDGET_COLUMNS),
        cell_calibration=read_table(folder / "cell_calibration.csv", RESULT_COLUMNS),
        cell_models=read_table(folder / "cell_models.csv", CHOICE_COLUMNS),
        cell_quality=read_table(folder / "cell_quality.csv", QUALITY_COLUMNS),
        mobilised=read_table(folder / "mobilised.csv", MOBILISED_COLUMNS),
        blade=read_table(folder / "blade.csv", BLADE_COLUMNS),
        peaks=read_table(folder / "peaks.csv", PEAK_COLUMNS),
        practice=read_table(folder / "good_practice.csv", PRACTICE_COLUMNS),
        model_force=_horizontal(
            read_table(folder / "model" / "force.csv", MODEL_FORCE_COLUMNS), run.settings
        ),
        model_layers=read_table(folder / "model" / "layers.csv", LAYER_COLUMNS),
        model_bands=read_table(folder / "model" / "bands.csv", BAND_COLUMNS),
        model_surface=read_table(folder / "model" / "surface.csv", SURFACE_COLUMNS),
    )


_KNOWN = (
    "run.json",
    "metrics.json",
    "force.csv",
    "tracks.nc",
    "layers.csv",
    "surface.csv",
    "model/force.csv",
    "fit.json",
)


def _with_files(folder: Path) -> Path:
    for candidate in (folder, folder / "results"):
        if any((candidate / name).is_file() for name in _KNOWN):
            return candidate
    what = "no result files here" if folder.is_dir() else "not a folder"
    raise DataError(
        f"{what}; expected a result folder with at least one of {', '.join(_KNOWN)}. "
        "Make one with: ploughval process FOLDER",
        path=folder,
    )


def _calibration(path: Path) -> Calibration | None:
    return read_calibration(path) if path.is_file() else None


def _tracks(path: Path) -> xr.Dataset | None:
    if not path.is_file():
        return None
    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as stored:
            tracks = stored.load()
    except Exception as error:  # a spoiled file can raise anything within HDF5
        raise DataError(f"not readable as netCDF: {error}. {REMEDY}", path=path) from None
    missing = [name for name in TRACK_VARIABLES if name not in tracks]
    if missing:
        raise DataError(f"variables {', '.join(missing)} are missing. {REMEDY}", path=path)
    return tracks
