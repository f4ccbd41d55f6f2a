"""Photographs of a material-point run, processed whole: errors against its particles, bands against its own.

python benchmarks/study_virtual.py --virtual ../shared/virtual --out reports/sequences
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ploughval.axes import Status
from sequences.process import process_afresh
from sequences.rows import Row, rms, side_by_side
from virtual.figures import draw_bands, draw_overlays
from virtual.photographs import (
    OPTIONS,
    PARTS,
    VirtualRun,
    bounded,
    gradients,
    make_virtual_folder,
    neighbours_of,
    read_run,
)

Floats = NDArray[np.float64]

SWITCH_MM = 25.5  # when the run's second band takes over, from its force
_COHERENT = (0.85, 1.2)  # principal stretches of sand that has hardly deformed since the start
_BIN_MM = 1.0


def main(arguments: Sequence[str] | None = None) -> None:
    """Make, process, measure; write virtual.csv, virtual-increments.csv and figures into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--virtual", type=Path, default=Path("../shared/virtual"))
    parser.add_argument("--out", type=Path, default=Path("reports/sequences"))
    parser.add_argument("--folder", type=Path, help="where the photographs are kept and found again")
    parser.add_argument("--parts", type=int, default=PARTS)
    options = parser.parse_args(arguments)
    run = read_run(options.virtual).between(options.parts)
    true = true_bands(options.virtual)
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "virtual" if options.folder is None else options.folder
        if not (folder / "test.toml").is_file():
            make_virtual_folder(folder, run)
        done = process_afresh(folder)
        print(done.log)
        found = done.results
        rows = [
            *track_rows(found, run),
            *surface_rows(found, run),
            *blade_rows(found, run),
            *band_rows(found, true),
            Row("whole command", done.seconds, "s"),
        ]
        increments = with_place(pd.read_csv(found / "increments.csv"), true)
        pairs = side_by_interval(increments, true)
        draw_bands(true, increments, options.out / "virtual-bands")
        draw_overlays(folder, found, options.out / "virtual-overlays.png")
    table = side_by_side({"material points": rows})
    print(table.to_string(float_format=lambda v: f"{v:.4g}"))
    print(pairs.to_string(float_format=lambda v: f"{v:.4g}"))
    table.to_csv(options.out / "virtual.csv", float_format="%.4g", index_label="quantity")
    pairs.to_csv(options.out / "virtual-increments.csv", float_format="%.5g", index=False)


def true_bands(folder: Path) -> pd.DataFrame:
    """The run's own band between successive frames: u0_mm, u1_mm, beta_deg and ahead_mm.

    ahead_mm is how far ahead of the blade the band crosses the height at which the run's own reading of its
    particles took it, in columns of 2 mm; beta_deg is the inclination of the line from the tip to there.
    """
    table = pd.read_csv(next(folder.glob("*_bands.csv")))
    return pd.DataFrame(
        {
            "u0_mm": 1e3 * table["u0_m"],
            "u1_mm": 1e3 * table["u1_m"],
            "ahead_mm": 1e3 * table["outcrop_ahead_of_blade_m"],
            "beta_deg": table["inclination_deg"],
        }
    )


def with_place(increments: pd.DataFrame, true: pd.DataFrame) -> pd.DataFrame:
    """Increments with ahead_mm, where the found line crosses the height of the run's reading, and its std."""
    height_mm = float((true["ahead_mm"] * np.tan(np.radians(true["beta_deg"]))).median())
    beta, std = np.radians(increments["beta_deg"]), np.radians(increments["beta_std_deg"])
    return increments.assign(
        ahead_mm=height_mm / np.tan(beta), ahead_std_mm=height_mm / np.sin(beta) ** 2 * std
    )


def track_rows(results: Path, run: VirtualRun) -> list[Row]:
    """Tracked points against the texture that the particles carry.

    Coherent sand: its principal stretches since the start are within bounds, so that a subset still shows
    the sand that it showed at first. The rest has gone through a band or down a slope.
    """
    with xr.open_dataset(results / "tracks.nc", engine="h5netcdf") as tracks:
        tracks.load()
    scale = OPTIONS.mm_per_px
    start = np.column_stack([tracks["x0_mm"], tracks["y0_mm"]])
    measured = np.stack([tracks["x_mm"].values, tracks["y_mm"].values], axis=-1)
    true, coherent = carried(run, start)
    error = np.linalg.norm(measured - true, axis=-1) / scale
    valid = np.isfinite(error)
    moved = np.linalg.norm(true - start, axis=-1) > scale
    sigma = tracks["std_mm"].values / scale
    known = valid & coherent & (sigma > 0)
    component = np.abs(measured - true)[known] / scale
    rows = [Row("points", float(len(start)), "1")]
    for name, chosen in (("coherent sand", coherent & moved), ("churned sand", ~coherent & moved)):
        some = error[valid & chosen]
        rows += [
            Row(f"tracks in {name}, median", _quantile(some, 0.5), "px"),
            Row(f"tracks in {name}, 95 %", _quantile(some, 0.95), "px"),
            Row(f"{name} that is tracked", 100 * float((valid & chosen).sum() / chosen.sum()), "%"),
        ]
    last = valid[-1] & (coherent & moved)[-1]
    rows += [
        Row("last frame, coherent, median", _quantile(error[-1][last], 0.5), "px"),
        Row("last frame, coherent, 95 %", _quantile(error[-1][last], 0.95), "px"),
        Row("track errors within one std", 100 * float((component < sigma[known][:, None]).mean()), "%"),
        Row("track errors within two std", 100 * float((component < 2 * sigma[known][:, None]).mean()), "%"),
        Row("points lost at the end", float((tracks["status"].values[-1] != Status.OK).sum()), "1"),
    ]
    return rows


def carried(run: VirtualRun, points_mm: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Where the texture under points of the first frame is, (F, N, 2) mm; whether it is coherent, (F, N)."""
    first = run.places_mm[0]
    _, owner = cKDTree(first).query(points_mm)
    neighbours, offset = neighbours_of(first), points_mm - first[owner]
    places = np.empty((len(run.u_mm), *points_mm.shape))
    coherent = np.empty(places.shape[:2], dtype=np.bool_)
    for frame, now in enumerate(run.places_mm):
        gradient = gradients(first, now, neighbours, owner)
        stretch = np.linalg.svd(gradient, compute_uv=False)
        places[frame] = now[owner] + np.einsum("nij,nj->ni", bounded(gradient), offset)
        coherent[frame] = (stretch.min(axis=1) > _COHERENT[0]) & (stretch.max(axis=1) < _COHERENT[1])
    return places, coherent


def surface_rows(results: Path, run: VirtualRun) -> list[Row]:
    """Free surface ahead of the blade against the highest particles of each millimetre, half a cell above."""
    table = pd.read_csv(results / "surface.csv").dropna(subset=["y_mm"])
    first = run.places_mm[0]
    half_cell = np.median(cKDTree(first).query(first, k=2)[0][:, 1]) / 2
    parts = []
    for frame, rows in table.groupby("frame"):
        x, y = run.places_mm[int(frame)].T
        edges = np.arange(run.u_mm[int(frame)] + _BIN_MM, x.max(), _BIN_MM)
        cell = np.digitize(x, edges) - 1
        top = np.full(len(edges), -np.inf)
        np.maximum.at(top, np.clip(cell, 0, None)[cell >= 0], y[cell >= 0])
        line = np.interp(rows["x_mm"], edges + _BIN_MM / 2, top + half_cell)
        inside = rows["x_mm"].between(edges[0] + _BIN_MM, edges[-1] - _BIN_MM)
        parts.append(((rows["y_mm"] - line) / OPTIONS.mm_per_px)[inside].to_numpy())
    error = np.concatenate(parts)
    return [
        Row("free surface, mean (cells of 5 px)", float(np.nanmean(error)), "px"),
        Row("free surface, rms (cells of 5 px)", rms(error[np.isfinite(error)]), "px"),
    ]


def blade_rows(results: Path, run: VirtualRun) -> list[Row]:
    """Blade face against the run's."""
    error = (pd.read_csv(results / "blade.csv")["blade_x_mm"].to_numpy() - run.u_mm) / OPTIONS.mm_per_px
    found = np.isfinite(error)
    return [
        Row("blade face, rms", rms(error[found]), "px", most=0.2),
        Row("photographs without a blade", float((~found).sum()), "1"),
    ]


def band_rows(results: Path, true: pd.DataFrame) -> list[Row]:
    """Bands and the switch against the run's two; differences of each interval of the run."""
    bands = pd.read_csv(results / "bands.csv")
    pairs = side_by_interval(with_place(pd.read_csv(results / "increments.csv"), true), true)
    starts = bands["u_start_mm"].to_numpy()
    nearest = float(starts[np.abs(starts - SWITCH_MM).argmin()]) if len(starts) else float("nan")
    return [
        Row("bands true", 2.0, "1"),
        Row("bands found", float(len(bands)), "1"),
        Row("switch, true", SWITCH_MM, "mm"),
        Row("band start nearest to it", nearest, "mm"),
        Row("place against the run's, median |difference|", _difference(pairs, "ahead_mm"), "mm"),
        Row("inclination against the run's, median |difference|", _difference(pairs, "beta_deg"), "degree"),
    ]


def side_by_interval(increments: pd.DataFrame, true: pd.DataFrame) -> pd.DataFrame:
    """The run's band of each interval beside the median of the increments that lie in it."""
    middle = increments["u_mm"] + increments["du_mm"] / 2
    rows = []
    for interval in true.itertuples():
        inside = increments[(middle > interval.u0_mm) & (middle < interval.u1_mm) & (increments["band"] >= 0)]
        rows.append(
            {
                **{name: getattr(interval, name) for name in true.columns},
                "ahead_mm found": inside["ahead_mm"].median(),
                "beta_deg found": inside["beta_deg"].median(),
                "increments": len(inside),
            }
        )
    return pd.DataFrame(rows)


def _difference(pairs: pd.DataFrame, name: str) -> float:
    return float((pairs[f"{name} found"] - pairs[name]).abs().median())


def _quantile(values: Floats, share: float) -> float:
    return float(np.quantile(values, share)) if len(values) else float("nan")


if __name__ == "__main__":
    main()
