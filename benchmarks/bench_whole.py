"""The whole way on made folders: error of every quantity against the exact truth, and the time it took.

python benchmarks/bench_whole.py                        # makes and processes folders of several seeds
python benchmarks/bench_whole.py --folder t             # a processed folder made by `ploughval synth`
"""

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from scipy.spatial import cKDTree

from ploughval import process
from ploughval.axes import Direction, Status
from ploughval.run.results import results_of
from ploughval.scene import load_scene
from ploughval.synth import EXAMPLE, Truth, load_truth, make_folder

LAYER_STEP_MM = 0.02  # spacing of the material points that stand for a true layer


@dataclass(frozen=True, slots=True)
class Row:
    """One figure."""

    quantity: str
    value: float
    unit: str


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print; write the table as CSV into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--folder", type=Path, nargs="*", help="processed folders made by synth")
    parser.add_argument("--seeds", type=int, nargs="*", default=[5, 6])
    options = parser.parse_args(arguments)
    tables = {}
    if options.folder:
        for folder in options.folder:
            tables[folder.resolve().name] = errors_of(folder, results_of(folder))
    else:
        with tempfile.TemporaryDirectory() as scratch:
            for seed in options.seeds:
                for direction in Direction:
                    name = f"seed {seed} {direction.value}"
                    tables[name] = _made(Path(scratch) / name, seed, direction)
    table = pd.DataFrame(
        {name: {f"{r.quantity} [{r.unit}]": r.value for r in rows} for name, rows in tables.items()}
    )
    print(table.to_string(float_format=lambda v: f"{v:.4g}"))
    options.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out / "whole.csv", float_format="%.5g", index_label="quantity")


def _made(folder: Path, seed: int, direction: Direction) -> list[Row]:
    make_folder(folder, replace(EXAMPLE, seed=seed, direction=direction))
    start = time.perf_counter()
    outcome = process(folder, workers=2)
    seconds = time.perf_counter() - start
    return [*errors_of(folder, outcome.results), Row("time of process and report", seconds, "s")]


def errors_of(folder: Path, results: Path) -> list[Row]:
    """Every figure of one processed folder against the truth beside it."""
    scene = load_scene(folder)
    truth = load_truth(folder)
    scale = scene.camera.mm_per_px if scene.camera is not None else np.nan
    rows: list[Row] = []
    if (results / "tracks.nc").is_file():
        rows += track_errors(results, truth, scale)
        rows += blade_errors(results, truth, scale)
        rows += surface_errors(results, truth, scale)
        rows += layer_errors(results, truth, scale)
        rows += band_errors(results, truth)
    if (results / "force.csv").is_file():
        rows += force_errors(results, truth)
    return rows


def track_errors(results: Path, truth: Truth, scale: float) -> list[Row]:
    """Tracked positions against the exact motion of the same sand."""
    with xr.open_dataset(results / "tracks.nc", engine="h5netcdf") as tracks:
        tracks.load()
    true = truth.positions(np.column_stack([tracks["x0_mm"], tracks["y0_mm"]]))
    measured = np.stack([tracks["x_mm"].values, tracks["y_mm"].values], axis=-1)
    error = np.linalg.norm(measured - true, axis=-1) / scale
    whole = np.isfinite(true[..., 0])
    valid = np.isfinite(measured[..., 0])
    moved = np.linalg.norm(true - true[0], axis=-1) > scale
    known = whole & valid
    sigma = tracks["std_mm"].values / scale
    component = (measured - true) / scale
    seen = known & (sigma > 0)
    inside = np.abs(component[seen]) < sigma[seen][:, None]
    return [
        Row("tracks, median", float(np.median(error[known])), "px"),
        Row("tracks, 95 %", float(np.quantile(error[known], 0.95)), "px"),
        Row("tracks that moved, median", float(np.median(error[known & moved])), "px"),
        Row("tracks that moved, 95 %", float(np.quantile(error[known & moved], 0.95)), "px"),
        Row("last frame, moved, median", float(np.median(error[-1][(known & moved)[-1]])), "px"),
        Row("last frame, moved, 95 %", float(np.quantile(error[-1][(known & moved)[-1]], 0.95)), "px"),
        Row("standing sand that is tracked", 100 * float(known.sum() / whole.sum()), "%"),
        Row(
            "avalanched sand called valid", 100 * float((valid & ~whole).sum() / max((~whole).sum(), 1)), "%"
        ),
        Row("track errors within one std", 100 * float(inside.mean()), "%"),
        Row("points", float(tracks.sizes["point"]), "1"),
        Row("points lost at the end", float((tracks["status"].values[-1] != Status.OK).sum()), "1"),
    ]


def blade_errors(results: Path, truth: Truth, scale: float) -> list[Row]:
    """Blade face against its true place."""
    measured, true = pd.read_csv(results / "blade.csv"), truth.blade
    error = (measured["blade_x_mm"] - true["u_mm"]) / scale
    return [Row("blade face, rms", float(np.sqrt(np.mean(error**2))), "px")]


def surface_errors(results: Path, truth: Truth, scale: float) -> list[Row]:
    """Free surface against the true one, vertically, at the measured places."""
    measured, true = pd.read_csv(results / "surface.csv"), truth.surface
    errors = []
    for frame, rows in measured.groupby("frame"):
        line = true[true["frame"] == frame]
        inside = rows["x_mm"].between(line["x_mm"].min(), line["x_mm"].max())
        at = np.interp(rows["x_mm"], line["x_mm"], line["y_mm"])
        errors.append(((rows["y_mm"] - at) / scale)[inside].dropna().to_numpy())
    error = np.concatenate(errors)
    return [
        Row("free surface, rms", float(np.sqrt(np.mean(error**2))), "px"),
        Row("free surface, median |e|", float(np.median(np.abs(error))), "px"),
        Row("free surface, 95 %", float(np.quantile(np.abs(error), 0.95)), "px"),
    ]


def layer_errors(results: Path, truth: Truth, scale: float) -> list[Row]:
    """Measured layer points: distance to the nearest of closely spaced material points of the same layer."""
    measured = pd.read_csv(results / "layers.csv").dropna(subset=["x_mm", "y_mm"])
    along = np.arange(0.0, truth.surface["x_mm"].max(), LAYER_STEP_MM)
    errors: dict[str, list[np.ndarray]] = {str(source): [] for source in measured["source"].unique()}
    for layer, rows in measured.groupby("layer"):
        lines = truth.positions(np.column_stack([along, np.full_like(along, layer)]))
        for (frame, source), points in rows.groupby(["frame", "source"]):
            line = lines[frame][np.isfinite(lines[frame][:, 0])]
            distance, _ = cKDTree(line).query(points[["x_mm", "y_mm"]].to_numpy())
            errors[str(source)].append(distance / scale)
    found = []
    for source, parts in errors.items():
        error = np.concatenate(parts)
        found += [
            Row(f"layers ({source}), median", float(np.median(error)), "px"),
            Row(f"layers ({source}), 95 %", float(np.quantile(error, 0.95)), "px"),
        ]
    return found


def band_errors(results: Path, truth: Truth) -> list[Row]:
    """Shear bands in order of their start against the true ones."""
    measured, true = pd.read_csv(results / "bands.csv"), truth.bands
    rows = [Row("bands true", float(len(true)), "1"), Row("bands found", float(len(measured)), "1")]
    if not len(measured):
        return rows
    pairs = [
        (band, measured.iloc[(measured["outcrop_x_mm"] - band["outcrop_x_mm"]).abs().argmin()])
        for _, band in true.iterrows()
    ]
    for name, unit in (("u_start_mm", "mm"), ("outcrop_x_mm", "mm"), ("beta_deg", "degree")):
        error = [abs(found[name] - band[name]) for band, found in pairs]
        rows.append(Row(f"bands, largest error of {name}", float(np.max(error)), unit))
    return rows


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
        Row("force, rms", float(np.sqrt(np.mean(error**2))), "N"),
        Row("force, rms of its mean", 100 * float(np.sqrt(np.mean(error**2)) / at["force_N"].mean()), "%"),
        Row("line of action, rms", float(np.sqrt(np.mean(arm**2))), "mm"),
        Row("force errors within 1.96 std", 100 * float(covered.mean()), "%"),
    ]


if __name__ == "__main__":
    main()
