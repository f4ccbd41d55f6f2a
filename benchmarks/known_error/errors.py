"""Error of every metric of a made test: as stated, and as it is known to be.

The sand of a made test moves as the model says with the sand's own parameters. So the model's error in a
metric is known: the metric with the settings' parameters less the metric with the sand's. The comparison,
given the truth at the measured places instead of what was measured, yields it; the rest of the stated error
is the measurement's.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ploughval.axes import BAND_COLUMNS, FORCE_COLUMNS, LAYER_COLUMNS
from ploughval.compare import Comparison, compare_test
from ploughval.model import History, simulate
from ploughval.run.kept.store import CACHE
from ploughval.run.walk.window import WindowRecord
from ploughval.scene import Scene, Soil, load_scene
from ploughval.synth import load_truth

Floats = NDArray[np.float64]

_OK = "ok"
_DENSE_MM = 0.1


@dataclass(frozen=True, slots=True)
class Tables:
    """What the comparison takes: FORCE, BAND, LAYER, SURFACE and INCREMENT_COLUMNS; None: there is none."""

    force: pd.DataFrame | None
    bands: pd.DataFrame | None
    layers: pd.DataFrame | None
    surface: pd.DataFrame | None
    increments: pd.DataFrame | None = None

    def compared(self, scene: Scene, history: History) -> Comparison:
        """The comparison of these tables with a model run."""
        return compare_test(
            scene,
            history,
            force=self.force,
            bands=self.bands,
            layers=self.layers,
            surface=self.surface,
            increments=self.increments,
        )


def measured_tables(folder: Path) -> Tables:
    """Tables of a processed folder's results."""

    def table(name: str) -> pd.DataFrame | None:
        path = folder / "results" / f"{name}.csv"
        return pd.read_csv(path) if path.is_file() else None

    surface = table("surface")
    return Tables(
        table("force"),
        table("bands"),
        table("layers"),
        None if surface is None else _with_std(surface, folder / "results"),
        table("increments"),
    )


def _with_std(surface: pd.DataFrame, results: Path) -> pd.DataFrame:
    """The surface with std_mm, which the comparison takes and surface.csv leaves out: from the kept stage."""
    kept = next(iter(sorted((results / CACHE).glob("window-*.npz"))), None)
    if kept is None:
        return surface
    with np.load(kept, allow_pickle=False) as arrays:
        record = WindowRecord.from_arrays({name: arrays[name] for name in arrays.files})
    if not np.array_equal(record.surface[:, 0].astype(int), surface["frame"]):
        return surface
    return surface.assign(std_mm=record.surface[:, -1])


def true_tables(folder: Path, measured: Tables) -> Tables:
    """The truth in the measurement's shape: force without noise, the surface at the same places."""
    truth = load_truth(folder)
    moving = truth.force["force_N"] > 0
    force = truth.force.assign(
        force_std_N=0.0, arm_std_mm=0.0, force_raw_N=truth.force["force_N"], friction_N=0.0
    )
    force["status"] = np.where(moving, _OK, "force_too_small_for_arm")
    surface, layers = measured.surface, measured.layers
    return Tables(
        force[list(FORCE_COLUMNS)],
        truth.bands[list(BAND_COLUMNS)],
        None if layers is None else _nearest_of_layers(truth.layers, layers),
        None if surface is None else _heights_of_surface(truth.surface, surface),
    )


def _heights_of_surface(true: pd.DataFrame, measured: pd.DataFrame) -> pd.DataFrame:
    """The measured surface with the true one's heights."""
    parts = []
    travel = true.groupby("frame")["u_mm"].first()
    for frame, points in measured.groupby("frame"):
        line = true[true["frame"] == frame]
        height = np.interp(points["x_mm"], line["x_mm"], line["y_mm"])
        parts.append(points.assign(u_mm=travel[frame], y_mm=height))
    return pd.concat(parts, ignore_index=True)


def _nearest_of_layers(true: pd.DataFrame, measured: pd.DataFrame) -> pd.DataFrame:
    """The measured points of layers, each moved to the nearest place of its true layer; torn rows stay."""
    travel = true.groupby("frame")["u_mm"].first()
    lines = {key: _dense(line[["x_mm", "y_mm"]].to_numpy()) for key, line in true.groupby(["frame", "layer"])}
    parts = []
    for (frame, layer), points in measured.groupby(["frame", "layer"], sort=False):
        places = points[["x_mm", "y_mm"]].to_numpy(copy=True)
        seen = np.isfinite(places).all(axis=1)
        line = lines.get((frame, layer), np.empty((0, 2)))
        if len(line):
            places[seen] = line[cKDTree(line).query(places[seen])[1]]
            moved = points.assign(u_mm=travel[frame], x_mm=places[:, 0], y_mm=places[:, 1], std_mm=0.0)
            parts.append(moved[list(LAYER_COLUMNS)])
    return pd.concat(parts, ignore_index=True) if parts else measured.iloc[:0]


def _dense(line: Floats) -> Floats:
    """Places along a polyline, closer than a tenth of a millimetre; rows of NaN part it."""
    pieces = []
    for begin, end in itertools.pairwise(line):
        length = float(np.hypot(*(end - begin)))
        if np.isfinite(length):
            share = np.linspace(0.0, 1.0, int(length / _DENSE_MM) + 2)[:, None]
            pieces.append(begin + share * (end - begin))
    return np.vstack(pieces) if pieces else np.empty((0, 2))


def without_uncertainty(scene: Scene) -> Scene:
    """The same scene with inputs that are taken for exact."""
    assert scene.soil is not None
    none = {name: 0.0 for name in Soil.model_fields if "_std_" in name}
    blade = scene.blade.model_copy(update={"depth_std_mm": 0.0})
    return scene.model_copy(update={"soil": scene.soil.model_copy(update=none), "blade": blade})


def told_off(scene: Scene, true: Soil, parameter: str, std_name: str, steps: float) -> Scene | None:
    """A scene that tells one parameter ``steps`` standard uncertainties above the sand's, if that can be."""
    assert scene.soil is not None
    value = getattr(true, parameter) + steps * getattr(scene.soil, std_name)
    soil = scene.soil.model_copy(update={parameter: value})
    possible = 0 < soil.residual_friction_deg < soil.peak_friction_deg < 90 - soil.wall_friction_deg
    return scene.model_copy(update={"soil": soil}) if possible else None


def error_rows(folder: Path, scene: Scene | None = None) -> Iterator[dict[str, object]]:
    """One row a metric: name, unit, values of both sides, E as stated and as known, uncertainties, verdict.

    Parameters
    ----------
    folder : Path
        A made test that was processed.
    scene : Scene or None
        What is told of the test; None: its own settings.
    """
    scene = load_scene(folder, files=False) if scene is None else scene
    measured = measured_tables(folder)
    travel = scene.model.displacement_mm or _travel(measured)
    history = simulate(scene, displacement_mm=travel)
    known = true_tables(folder, measured).compared(without_uncertainty(scene), history)
    true = {metric.name: metric for metric in known.metrics}
    for metric in measured.compared(scene, history).metrics:
        twin = true.get(metric.name)
        yield {
            "folder": folder.name,
            "metric": metric.name,
            "unit": metric.unit,
            "experiment": metric.experiment,
            "experiment_true": np.nan if twin is None else twin.experiment,
            "model": metric.model,
            "error": metric.error,
            "error_true": np.nan if twin is None else twin.error,
            "experiment_std": metric.experiment_std,
            "numerical_std": metric.numerical_std,
            "input_std": metric.input_std,
            "validation_std": metric.validation_std,
            "agrees": metric.agrees,
        }


def verdict_rows(folder: Path, scene: Scene) -> Iterator[dict[str, object]]:
    """One row a metric of force and bands of a processed test under other settings: error and verdict."""
    results = folder / "results"
    measured = Tables(pd.read_csv(results / "force.csv"), pd.read_csv(results / "bands.csv"), None, None)
    history = simulate(scene, displacement_mm=scene.model.displacement_mm or _travel(measured))
    for metric in measured.compared(scene, history).metrics:
        yield {
            "folder": folder.name,
            "metric": metric.name,
            "error": metric.error,
            "validation_std": metric.validation_std,
            "agrees": metric.agrees,
        }


def _travel(measured: Tables) -> float | None:
    """Largest travel that was measured, mm."""
    ends = [float(table["u_mm"].max()) for table in (measured.force, measured.surface) if table is not None]
    return max(ends) if ends else None
