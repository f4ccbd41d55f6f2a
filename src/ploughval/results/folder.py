"""One result folder with what its files hold; a file that is not there is None."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from ploughval.errors import DataError
from ploughval.photos import Calibration
from ploughval.photos.calibration.file import read_calibration
from ploughval.results.reading import read_record, read_table, read_tracks
from ploughval.results.records import MetricEntry, MetricsRecord, RunRecord


@dataclass(frozen=True, slots=True)
class Results:
    """The files of one result folder; None where a file is not there.

    Columns, units and meanings of the tables are those of :data:`ploughval.results.FILES`.

    Attributes
    ----------
    folder : Path
        The result folder.
    run : RunRecord
        run.json.
    metrics : MetricsRecord or None
        metrics.json.
    calibration : Calibration or None
        calibration.json.
    force, layers, surface, volume, bands, increments, blade, peaks, mobilised : DataFrame or None
        The measured tables of these names.
    budget, cell_calibration, cell_models, cell_quality : DataFrame or None
        Tables of the load cells.
    practice : DataFrame or None
        good_practice.csv.
    tracks : Dataset or None
        tracks.nc.
    model_force, model_layers, model_bands, model_surface : DataFrame or None
        Tables of the model; forces as load cells would measure them.
    shown : tuple of int
        Frames that figures of stages show; empty: as many as the settings ask for.
    """

    folder: Path
    run: RunRecord
    metrics: MetricsRecord | None = None
    calibration: Calibration | None = None
    force: pd.DataFrame | None = None
    tracks: xr.Dataset | None = None
    layers: pd.DataFrame | None = None
    surface: pd.DataFrame | None = None
    volume: pd.DataFrame | None = None
    bands: pd.DataFrame | None = None
    increments: pd.DataFrame | None = None
    budget: pd.DataFrame | None = None
    cell_calibration: pd.DataFrame | None = None
    cell_models: pd.DataFrame | None = None
    cell_quality: pd.DataFrame | None = None
    mobilised: pd.DataFrame | None = None
    blade: pd.DataFrame | None = None
    peaks: pd.DataFrame | None = None
    practice: pd.DataFrame | None = None
    model_force: pd.DataFrame | None = None
    model_layers: pd.DataFrame | None = None
    model_bands: pd.DataFrame | None = None
    model_surface: pd.DataFrame | None = None
    shown: tuple[int, ...] = ()

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

    def table(self, name: str) -> pd.DataFrame | None:
        """A table of the folder by the name of its file, read anew; None where it is not there."""
        return read_table(self.folder, name)

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


def horizontal_share(settings: Mapping[str, Any]) -> float:
    """What load cells measure of the model's P: wall friction and a face that leans incline it.

    Parameters
    ----------
    settings : mapping
        Tables of test.toml as in run.json.

    Returns
    -------
    float
        Cosine of wall friction plus inclination.
    """
    angle_deg = 0.0
    for name, key in (("soil", "wall_friction_deg"), ("blade", "inclination_deg")):
        table = settings.get(name)
        angle_deg += float(table.get(key) or 0.0) if isinstance(table, Mapping) else 0.0
    return math.cos(math.radians(angle_deg))


def _horizontal(model_force: pd.DataFrame | None, settings: Mapping[str, Any]) -> pd.DataFrame | None:
    """The model's force as load cells would measure it."""
    if model_force is None:
        return None
    return model_force.assign(force_N=model_force["force_N"] * horizontal_share(settings))


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
    folder = with_files(Path(folder))
    run = read_record(folder / "run.json", RunRecord) or RunRecord()
    return Results(
        folder=folder,
        run=run,
        metrics=read_record(folder / "metrics.json", MetricsRecord),
        calibration=calibration_in(folder),
        force=read_table(folder, "force.csv"),
        tracks=read_tracks(folder),
        layers=read_table(folder, "layers.csv"),
        surface=read_table(folder, "surface.csv"),
        volume=read_table(folder, "volume.csv"),
        bands=read_table(folder, "bands.csv"),
        increments=read_table(folder, "increments.csv"),
        budget=read_table(folder, "budget.csv"),
        cell_calibration=read_table(folder, "cell_calibration.csv"),
        cell_models=read_table(folder, "cell_models.csv"),
        cell_quality=read_table(folder, "cell_quality.csv"),
        mobilised=read_table(folder, "mobilised.csv"),
        blade=read_table(folder, "blade.csv"),
        peaks=read_table(folder, "peaks.csv"),
        practice=read_table(folder, "good_practice.csv"),
        model_force=_horizontal(read_table(folder, "model/force.csv"), run.settings),
        model_layers=read_table(folder, "model/layers.csv"),
        model_bands=read_table(folder, "model/bands.csv"),
        model_surface=read_table(folder, "model/surface.csv"),
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


def with_files(folder: Path) -> Path:
    """The result folder that a user means: the folder itself, or ``results`` in it.

    Parameters
    ----------
    folder : Path
        A result folder or a test folder.

    Returns
    -------
    Path

    Raises
    ------
    DataError
        When neither holds a file of results.
    """
    for candidate in (folder, folder / "results"):
        if any((candidate / name).is_file() for name in _KNOWN):
            return candidate
    what = "no result files here" if folder.is_dir() else "not a folder"
    raise DataError(
        f"{what}; expected a result folder with at least one of {', '.join(_KNOWN)}. "
        "Make one with: ploughval process FOLDER",
        path=folder,
    )


def calibration_in(folder: Path) -> Calibration | None:
    """The calibration of a result folder; None where it is not there.

    Parameters
    ----------
    folder : Path
        The result folder.

    Returns
    -------
    Calibration or None
    """
    path = folder / "calibration.json"
    return read_calibration(path) if path.is_file() else None
