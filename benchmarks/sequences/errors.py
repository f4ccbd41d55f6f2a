"""Errors of one processed folder against the exact truth beside it, and the figures to reach."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ploughval.axes import Status
from ploughval.scene import load_scene
from ploughval.synth import Truth, load_truth
from sequences.bands import band_errors
from sequences.rows import Row, rms

Floats = NDArray[np.float64]

ONE_STD, TWO_STD = (65.0, 71.0), (93.0, 97.0)  # share of errors within one and two standard deviations, %
_LINE_STEP_PX = 0.15  # spacing of the material points that stand for a true layer
_NEAR_PX = 3.0  # a true layer is found where a measured point lies this near


def errors_of(folder: Path, results: Path) -> list[Row]:
    """Every figure of one processed folder against the truth beside it."""
    rows = geometry_errors(folder, results)
    if (results / "force.csv").is_file():
        rows += force_errors(results, load_truth(folder))
    return rows


def geometry_errors(folder: Path, results: Path) -> list[Row]:
    """What the photographs gave: points, blade, surface, layers and bands, as far as there are results."""
    scene, truth = load_scene(folder, files=False), load_truth(folder)
    scale = scene.camera.mm_per_px if scene.camera is not None else np.nan
    rows: list[Row] = []
    if (results / "tracks.nc").is_file():
        rows += track_errors(Tracked.read(results, truth, scale))
    if (results / "surface.csv").is_file():
        rows += blade_errors(results, truth, scale)
        rows += surface_errors(results, truth, scale)
    if (results / "layers.csv").is_file():
        rows += layer_errors(results, truth, scale)
    if (results / "bands.csv").is_file():
        rows += band_errors(results, truth)
    return rows


@dataclass(frozen=True, slots=True)
class Tracked:
    """Tracked points beside the exact motion of the same sand; F frames, N points.

    Attributes
    ----------
    error_px : (F, N, 2) float64, px
        NaN where the point is not valid, or its sand has avalanched or was swept up.
    sigma_px : (F, N) float64, px
        Stated standard deviation of one component.
    standing, valid, moved : (F, N) bool
        Whether the sand still stands, the point was measured, and the sand moved by more than a pixel.
    start_mm : (N, 2) float64, mm
    true_mm : (F, N, 2) float64, mm
    status : (F, N) int
    """

    error_px: Floats
    sigma_px: Floats
    standing: NDArray[np.bool_]
    valid: NDArray[np.bool_]
    moved: NDArray[np.bool_]
    start_mm: Floats
    true_mm: Floats
    status: NDArray[np.int8]

    @classmethod
    def read(cls, results: Path, truth: Truth, scale: float) -> "Tracked":
        """Read tracks.nc and replay the truth at its points; frames that were lost are all NaN."""
        with xr.open_dataset(results / "tracks.nc", engine="h5netcdf") as tracks:
            tracks.load()
        start = np.column_stack([tracks["x0_mm"], tracks["y0_mm"]])
        true = truth.positions(start)
        measured = np.stack([tracks["x_mm"].values, tracks["y_mm"].values], axis=-1)
        frames = frames_of(results, truth, len(measured))
        true = true[frames]
        return cls(
            (measured - true) / scale,
            tracks["std_mm"].values / scale,
            np.isfinite(true[..., 0]),
            np.isfinite(measured[..., 0]),
            np.linalg.norm(true - start, axis=-1) > scale,
            start,
            true,
            tracks["status"].values.astype(np.int8),
        )


def frames_of(results: Path, truth: Truth, count: int) -> NDArray[np.int64]:
    """Which of the truth's photographs each measured frame is, by its displacement in the record."""
    if count == len(truth.blade):
        return np.arange(count)
    u_mm = pd.read_csv(results / "blade.csv")["u_mm"].to_numpy()
    true = truth.blade["u_mm"].to_numpy()
    return np.abs(u_mm[:, None] - true).argmin(axis=1)


def track_errors(tracked: Tracked) -> list[Row]:
    """Tracked positions against the exact motion of the same sand."""
    known = tracked.standing & tracked.valid
    error = np.linalg.norm(tracked.error_px, axis=-1)
    moved = known & tracked.moved
    # the last photograph in which anything was measured
    last = int(np.flatnonzero(known.any(axis=1))[-1]) if known.any() else 0
    rows = []
    for name, chosen in (
        ("tracks", error[known]),
        ("tracks that moved", error[moved]),
        ("last frame, moved", error[last][moved[last]]),
    ):
        rows += [
            Row(f"{name}, median", _quantile(chosen, 0.5), "px", most=0.05),
            Row(f"{name}, 95 %", _quantile(chosen, 0.95), "px", most=0.25),
        ]
    seen = known & (tracked.sigma_px > 0)
    component = np.abs(tracked.error_px[seen])
    sigma = tracked.sigma_px[seen][:, None]
    fallen = ~tracked.standing
    rows += [
        Row("standing sand that is tracked", _percent(known.sum(), tracked.standing.sum()), "%"),
        Row("moved points wrong by more than 1 px", _percent((error[moved] > 1).sum(), moved.sum()), "%"),
        Row("largest error of a valid point", float(error[known].max(initial=0.0)), "px"),
        Row("avalanched sand called valid", _percent((tracked.valid & fallen).sum(), fallen.sum()), "%"),
        Row("track errors within one std", 100 * float((component < sigma).mean()), "%", *ONE_STD),
        Row("track errors within two std", 100 * float((component < 2 * sigma).mean()), "%", *TWO_STD),
        Row("points", float(tracked.status.shape[1]), "1"),
        Row("points lost at the end", float((tracked.status[last] != Status.OK).sum()), "1"),
    ]
    return rows


def blade_errors(results: Path, truth: Truth, scale: float) -> list[Row]:
    """Blade face against its true place."""
    measured = pd.read_csv(results / "blade.csv")
    true = truth.blade["u_mm"].to_numpy()[frames_of(results, truth, len(measured))]
    error = ((measured["blade_x_mm"] - true) / scale).to_numpy()
    found = np.isfinite(error)
    return [
        Row("blade face, rms", rms(error[found]), "px", most=0.2),
        Row("blade face, largest", float(np.abs(error[found]).max(initial=0.0)), "px"),
        Row("photographs without a blade", float((~found).sum()), "1"),
    ]


def surface_errors(results: Path, truth: Truth, scale: float) -> list[Row]:
    """Free surface against the true one, vertically, at the measured places."""
    measured = pd.read_csv(results / "surface.csv")
    frames = frames_of(results, truth, len(pd.read_csv(results / "blade.csv")))
    true = dict(tuple(truth.surface.groupby("frame")))
    parts, stated = [], []
    for frame, rows in measured.groupby("frame"):
        line = true[int(frames[int(frame)])]
        inside = rows["x_mm"].between(line["x_mm"].min(), line["x_mm"].max()) & rows["y_mm"].notna()
        at = np.interp(rows["x_mm"], line["x_mm"], line["y_mm"])
        parts.append(((rows["y_mm"] - at) / scale)[inside].to_numpy())
        if "std_mm" in rows:
            stated.append((rows["std_mm"] / scale)[inside].to_numpy())
    error = np.concatenate(parts) if parts else np.empty(0)
    found = [
        Row("free surface, rms", rms(error), "px", most=0.5),
        Row("free surface, median |e|", _quantile(np.abs(error), 0.5), "px"),
        Row("free surface, 95 %", _quantile(np.abs(error), 0.95), "px"),
    ]
    if stated:
        sigma = np.concatenate(stated)
        for name, times in (("one", 1), ("two", 2)):
            share = 100 * float((np.abs(error) < times * sigma)[sigma > 0].mean())
            found.append(Row(f"surface errors within {name} std", share, "%"))
    return found


def layer_errors(results: Path, truth: Truth, scale: float) -> list[Row]:
    """Measured layer points: distance to the nearest material point of the same layer, by source.

    The share of a true layer that has a measured point near it is counted where its sand still stands.
    """
    measured = pd.read_csv(results / "layers.csv").dropna(subset=["x_mm", "y_mm"])
    frames = frames_of(results, truth, len(pd.read_csv(results / "blade.csv")))
    errors: dict[str, list[Floats]] = {}
    near: dict[str, list[NDArray[np.bool_]]] = {}
    for layer, rows in measured.groupby("layer"):
        lines = true_lines(truth, float(layer), _LINE_STEP_PX * scale)[frames]
        for (frame, source), points in rows.groupby(["frame", "source"]):
            line = lines[int(frame)]
            line = line[np.isfinite(line[:, 0])]
            places = points[["x_mm", "y_mm"]].to_numpy()
            distance, _ = cKDTree(line).query(places)
            errors.setdefault(str(source), []).append(distance / scale)
            gap, _ = cKDTree(places).query(line[::20])
            near.setdefault(str(source), []).append(gap < _NEAR_PX * scale + _spacing(places))
    return [row for source in errors for row in _layer_rows(source, errors[source], near[source])]


def true_lines(truth: Truth, height_mm: float, step_mm: float) -> Floats:
    """Closely spaced material points of one layer in every photograph, (F, N, 2) mm."""
    along = np.arange(0.0, truth.layers["x_mm"].max(), step_mm)
    return truth.positions(np.column_stack([along, np.full_like(along, height_mm)]))


def _spacing(places: Floats) -> float:
    """Half the usual distance of neighbouring points of a measured line, mm."""
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return float(np.median(steps)) / 2 if len(steps) else 0.0


def _layer_rows(source: str, errors: list[Floats], near: list[NDArray[np.bool_]]) -> Iterator[Row]:
    error = np.concatenate(errors)
    yield Row(f"layers ({source}), median", _quantile(error, 0.5), "px", most=0.5)
    yield Row(f"layers ({source}), 95 %", _quantile(error, 0.95), "px", most=2.0)
    yield Row(f"layers ({source}), share found", 100 * float(np.concatenate(near).mean()), "%")


def force_errors(results: Path, truth: Truth) -> list[Row]:
    """Force and line of action against the truth at the times of the record, blade in motion."""
    measured, true = pd.read_csv(results / "force.csv"), truth.force
    moving = measured["u_mm"] > 0.05
    measured = measured[moving]
    at = {name: np.interp(measured["time_s"], true["time_s"], true[name]) for name in ("force_N", "arm_mm")}
    error = measured["force_N"] - at["force_N"]
    arm = (measured["arm_mm"] - at["arm_mm"]).dropna()
    covered = np.abs(error) < 1.96 * measured["force_std_N"]
    return [
        Row("force, rms", rms(error.to_numpy()), "N"),
        Row(
            "force, rms of its mean", 100 * rms(error.to_numpy()) / float(at["force_N"].mean()), "%", most=1.0
        ),
        Row("line of action, rms", rms(arm.to_numpy()), "mm", most=1.0),
        Row("force errors within 1.96 std", 100 * float(covered.mean()), "%", *TWO_STD),
    ]


def _quantile(values: Floats, share: float) -> float:
    return float(np.quantile(values, share)) if len(values) else float("nan")


def _percent(part: float, whole: float) -> float:
    return 100 * float(part) / max(float(whole), 1.0)
