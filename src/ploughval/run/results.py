"""The files of a result folder, written aside and renamed."""

from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike

from ploughval import axes
from ploughval.compare import metrics_mapping
from ploughval.disk import unwritable
from ploughval.errors import ConfigError, DataError, Fault
from ploughval.loadcells.calibration import CHOICE_COLUMNS, QUALITY_COLUMNS, RESULT_COLUMNS
from ploughval.model import History
from ploughval.photos.calibration.file import calibration_record
from ploughval.run import provenance
from ploughval.run.findings import Findings
from ploughval.run.kept.netcdf import netcdf_bytes
from ploughval.run.kept.written import sync_folder, write_bytes, write_csv, write_json
from ploughval.run.load_cells import force_at_frames, load_cell_record
from ploughval.run.practice import good_practice, shot_of
from ploughval.run.tables import blade_table
from ploughval.run.walk.noise import noise_record
from ploughval.run.walk.pattern import pattern_record
from ploughval.scene import Scene

MODEL_FILES = {
    "force": axes.MODEL_FORCE_COLUMNS,
    "bands": axes.BAND_COLUMNS,
    "layers": axes.LAYER_COLUMNS,
    "surface": axes.SURFACE_COLUMNS,
}
MODEL_STAGES = 31  # displacements at which layers and surface are written where no photographs ask for them

FILES = (
    "force.csv",
    "force_frames.csv",
    "tracks.nc",
    "layers.csv",
    "surface.csv",
    "volume.csv",
    "bands.csv",
    "model/force.csv",
    "model/layers.csv",
    "model/bands.csv",
    "model/surface.csv",
    "metrics.json",
    "blade.csv",
    "calibration.json",
    "increments.csv",
    "budget.csv",
    "cell_calibration.csv",
    "cell_models.csv",
    "cell_quality.csv",
    "mobilised.csv",
    "mobilised_curve.csv",
    "softening.csv",
    "peaks.csv",
    "peak_pairs.csv",
    "force_envelope.csv",
    "layer_distances.csv",
    "mound.csv",
    "band_pairs.csv",
    "good_practice.csv",
    "report.html",
    "run.json",
)


def write_results(scene: Scene, found: Findings, folder: Path) -> list[Path]:
    """Write every file but run.json that the findings call for; remove those of an earlier run.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    DataError
        When the disk refuses.
    """
    forget(folder)
    writer = _Writer(folder)
    _write_measured(writer, found)
    if found.history is not None:
        write_model(scene, found.history, folder / "model", stages_mm=found.frame_displacement_mm())
        writer.written += [folder / "model" / f"{name}.csv" for name in MODEL_FILES]
    _write_comparison(scene, writer, found)
    practice = good_practice(scene, found)
    writer.csv("good_practice.csv", practice if len(practice) else None, axes.PRACTICE_COLUMNS)
    _remove_stale(folder, writer.written)
    return writer.written


def forget(folder: Path) -> None:
    """Take back what says that a result folder is whole: its record and its page."""
    for name in ("run.json", "report.html"):
        with suppress(OSError):
            (folder / name).unlink(missing_ok=True)
    sync_folder(folder)  # before any other file changes


def refuse_inputs(scene: Scene, folder: Path, found: Findings) -> None:
    """Refuse a result folder in which a file of the test itself would be written over.

    Raises
    ------
    ConfigError
        Naming the files.
    """
    inputs = {(scene.folder / name).resolve() for name in found.input_digests}
    taken = [name for name in FILES if (folder / name).resolve() in inputs]
    if taken:
        names = ", ".join(taken)
        fault = Fault(
            "--out", str(folder), f"a folder apart from the test's own {names}", "Choose another place."
        )
        raise ConfigError(scene.source, [fault])


class _Writer:
    """Writes into one folder and remembers what it wrote."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.written: list[Path] = []

    def csv(self, name: str, table: pd.DataFrame | None, columns: tuple[str, ...]) -> None:
        if table is not None:
            write_csv(self._path(name), table, columns)

    def json(self, name: str, value: Any) -> None:
        write_json(self._path(name), value)

    def netcdf(self, name: str, dataset: xr.Dataset) -> None:
        write_bytes(self._path(name), netcdf_bytes({"": dataset}))

    def _path(self, name: str) -> Path:
        path = self.folder / name
        self.written.append(path)
        return path


def _write_measured(writer: _Writer, found: Findings) -> None:
    if found.force is not None:
        writer.csv("force.csv", found.force.record, axes.FORCE_COLUMNS)
        writer.csv("budget.csv", found.force.budget, axes.BUDGET_COLUMNS)
        writer.csv("force_frames.csv", force_at_frames(found), axes.FORCE_AT_COLUMNS)
        cells = found.force.calibration
        if len(cells.points):
            writer.csv("cell_calibration.csv", cells.points, RESULT_COLUMNS)
            writer.csv("cell_models.csv", cells.choice, CHOICE_COLUMNS)
            writer.csv("cell_quality.csv", cells.quality, QUALITY_COLUMNS)
    if found.tracks is not None:
        writer.netcdf("tracks.nc", found.tracks)
    writer.csv("layers.csv", found.layers, axes.LAYER_COLUMNS)
    writer.csv("surface.csv", found.surface, axes.SURFACE_COLUMNS)
    writer.csv("volume.csv", found.volume, axes.VOLUME_COLUMNS)
    if found.bands is not None:
        writer.csv("bands.csv", found.bands.bands, axes.BAND_COLUMNS)
        writer.csv("increments.csv", found.bands.increments, axes.INCREMENT_COLUMNS)
    if found.calibration is not None:
        writer.json("calibration.json", calibration_record(found.calibration))
    if found.window is not None and found.frames is not None:
        table = blade_table(found.window, found.frames.time_s, found.frame_displacement_mm())
        writer.csv("blade.csv", table, axes.BLADE_COLUMNS)


def _write_comparison(scene: Scene, writer: _Writer, found: Findings) -> None:
    metrics = {} if found.comparison is None else metrics_mapping(found.comparison)
    writer.json("metrics.json", {"test": scene.test.name, "metrics": metrics, "warnings": found.warnings})
    if found.comparison is None:
        return
    names = ("mobilised", "mobilised_curve", "softening", "peaks", "peak_pairs", "force_envelope")
    for name in (*names, "layer_distances", "mound", "band_pairs"):
        table = getattr(found.comparison, name)
        if table is not None:
            writer.csv(f"{name}.csv", table, tuple(table.columns))


def write_model(scene: Scene, history: History, folder: Path, *, stages_mm: ArrayLike = ()) -> None:
    """Write force.csv, bands.csv, layers.csv and surface.csv of a model run.

    Parameters
    ----------
    scene : Scene
        Gives the heights of the tracer layers.
    history : History
        The run.
    folder : Path
        Where the files go.
    stages_mm : (F,) float, mm
        Blade displacements at which layers and surface are wanted (NaN skipped), numbered as frames; empty:
        an even spread over the run.
    """
    with unwritable(folder):  # a disk that fills up must leave no tables of two runs
        for name in MODEL_FILES:
            (folder / f"{name}.csv").unlink(missing_ok=True)
    for name, table in model_tables(scene, history, stages_mm).items():
        write_csv(folder / f"{name}.csv", table, MODEL_FILES[name])


def model_tables(scene: Scene, history: History, stages_mm: ArrayLike = ()) -> dict[str, pd.DataFrame]:
    """A model run as the tables of MODEL_FILES.

    Parameters
    ----------
    scene : Scene
        Gives the heights of the tracer layers.
    history : History
        The run.
    stages_mm : (F,) float, mm
        As of :func:`write_model`.

    Returns
    -------
    dict of str to DataFrame
        force, bands, layers, surface.
    """
    end = float(history.force["u_mm"].iloc[-1])
    stages = np.asarray(stages_mm, float)
    if not np.isfinite(stages).any():
        stages = np.linspace(0.0, end, MODEL_STAGES)
    frames = np.arange(len(stages))
    reached = np.isfinite(stages) & (stages <= end + 1e-9)
    heights = () if scene.tracers is None else scene.tracers.layers_mm
    lines = [
        pd.DataFrame({"frame": frame, "u_mm": u, "x_mm": line[:, 0], "y_mm": line[:, 1]})
        for frame, u in zip(frames[reached], stages[reached], strict=True)
        for line in [history.surface(min(max(u, 0.0), end))]
    ]
    return {
        "force": history.force,
        "bands": history.bands,
        "layers": history.layers(heights, np.clip(stages[reached], 0.0, end), frames[reached]),
        "surface": pd.concat(lines, ignore_index=True)
        if lines
        else pd.DataFrame(columns=axes.SURFACE_COLUMNS),
    }


def results_of(folder: Path) -> Path:
    """The result folder that a user means: the folder itself, or ``results`` in it.

    Raises
    ------
    DataError
        When neither holds a run.json.
    """
    for candidate in (folder, folder / "results"):
        if (candidate / "run.json").is_file():
            return candidate
    raise DataError("holds no results; process it first: ploughval process FOLDER", path=folder)


def run_record(scene: Scene, found: Findings) -> dict[str, Any]:
    """What run.json says: versions, settings, input hashes, timings, frame ledger."""
    return {
        "ploughval": provenance.ploughval_version(),
        "test": scene.test.name,
        "folder": str(scene.folder.resolve()),
        "settings": scene.model_dump(mode="json"),
        "settings_hash": scene.settings_hash,
        "code_hash": provenance.code_digest(),
        "versions": provenance.versions(),
        "inputs": found.input_digests,
        "timings_s": {step: round(seconds, 3) for step, seconds in found.timings_s.items()},
        "steps": [step.value for step in scene.steps],
        "frames": _ledger(found),
        "exif": None if found.frames is None else asdict(shot_of(found.frames.shots)),
        "calibration": _calibration_record(found),
        "noise": None if found.window is None else noise_record(found.window.noise, found.window.noise_line),
        "pattern": pattern_record(found.pattern()),
        "clock": _clock_record(found),
        "loadcells": None if found.force is None else load_cell_record(found.force),
        "complete": found.complete,
        "faults": found.faults,
        "warnings": found.warnings,
    }


def _ledger(found: Findings) -> list[dict[str, Any]]:
    if found.frames is None:
        return []
    u_mm = found.frame_displacement_mm()
    u_mm = u_mm if len(u_mm) else np.full(len(found.frames), np.nan)
    rows = []
    for frame in range(len(found.frames)):
        given_up = "" if found.window is not None else "the photographs were given up"
        reason = found.lost_frames.get(frame, given_up)
        row = {
            "frame": frame,
            "file": found.frames.name(frame),
            "time_s": found.frames.time_s[frame],
            "time_std_s": found.frames.time_std_s[frame],
            "u_mm": u_mm[frame],
        }
        told = found.window
        notes = [] if told is None else [*told.notes.get(frame, []), *told.unseen.get(frame, [])]
        rows.append({**row, "status": "lost" if reason else "ok", "reason": reason, "notes": notes})
    return rows


def _calibration_record(found: Findings) -> dict[str, Any] | None:
    c = found.calibration
    if c is None:
        return None
    names = ("method", "mm_per_px", "scale_std", "residual_px")
    return {name: getattr(c, name) for name in names}


def _clock_record(found: Findings) -> dict[str, Any] | None:
    d = found.displacement
    if d is None:
        return None
    return {
        "source": d.source,
        "offset_s": d.clock_offset_s,
        "offset_std_s": d.clock_offset_std_s,
        "blade_minus_log_rms_mm": d.difference_rms_mm,
        "blade_over_log": d.scale,
        "blade_over_log_std": d.scale_std,
    }


def _remove_stale(folder: Path, written: list[Path]) -> None:
    for name in FILES:
        path = folder / name
        if path not in written:
            with suppress(OSError):
                path.unlink(missing_ok=True)
    with suppress(OSError):
        (folder / "model").rmdir()
