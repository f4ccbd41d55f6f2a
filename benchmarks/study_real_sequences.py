"""Real series: a wall pushing layered sand, an avalanche, a sand wedge, a T-bar in soil.

python benchmarks/study_real_sequences.py --shared ../shared --out reports/sequences

The wedge and the T-bar may not be copied into the project: their pictures go to --pictures, if that is given.
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.photos.reading.decode import decode
from ploughval.piv import FramePoints, Tracker
from ploughval.scene import Piv
from sequences.process import process_afresh
from sequences.real_figures import draw_tracks, draw_wall
from sequences.real_wedge import dyed_line
from sequences.rows import Row, rms

Floats = NDArray[np.float64]

WALL_PX = (
    *(1400.2, 1370.1, 1340.0, 1309.7, 1279.3, 1249.4, 1219.0, 1188.1, 1157.6, 1126.9),
    *(1095.9, 1065.8, 1034.8, 1004.1, 972.8, 942.2, 911.5, 892.7),
)  # left edge of the wall, as published with the photographs, to 1 px
WALL_SCALE, WALL_TIP_PX = 0.7148, 1400.2
STILL_PX = ((500, 45), (560, 100), (600, 160), (600, 200), (300, 45), (600, 320))  # sand that stays
FLOWING = {(240, 280): (-3.89, 4.26), (300, 240): (-2.18, 2.56), (340, 200): (-1.56, 1.51)}  # px, pair 0-1
WEDGE = {
    (88, 36): ((0, -8), (-1, -12)),
    (30, 40): ((0, -6), (0, -9)),
    (150, 25): ((-1, -9), (-2, -13)),
    (130, 95): ((-2, -8), (-4, -12)),
}  # whole-pixel matches over 10 and 15 frames
TBAR_PX = ((300, 2700), (3700, 2700), (1900, 2300), (600, 1500), (2900, 1300), (600, 300))  # far field
TBAR_DISC = (1920, 1480, 450)  # centre and radius, px: the black disc with the soil that clings to it
TBAR_STEP_PX = 1.98


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print; write real.csv and pictures into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shared", type=Path, default=Path("../shared"))
    parser.add_argument("--out", type=Path, default=Path("reports/sequences"))
    parser.add_argument("--pictures", type=Path, help="for pictures that may not be copied into the project")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    if options.pictures is not None:
        options.pictures.mkdir(parents=True, exist_ok=True)
    data = options.shared / "realdata"
    lines = [("wall push", row) for row in wall_push(options.out)]
    for name, measure, picture in (
        ("avalanche", avalanche, options.out),
        ("wedge", wedge, options.pictures),
        ("T-bar", tbar, options.pictures),
    ):
        if data.is_dir():
            lines += [(name, row) for row in measure(data, picture)]
    table = pd.DataFrame(
        [(series, row.quantity, row.value, row.unit) for series, row in lines],
        columns=["series", "quantity", "value", "unit"],
    )
    print(table.to_string(float_format=lambda v: f"{v:.4g}"))
    table.to_csv(options.out / "real.csv", float_format="%.4g", index=False)


def wall_push(out: Path) -> list[Row]:
    """Wall against its published place; the dark layer and the surface where the sand lies still."""
    folder = Path(__file__).resolve().parents[1] / "data" / "real-wall-push"
    with tempfile.TemporaryDirectory() as scratch:
        run = process_afresh(folder, results=Path(scratch))
        blade = pd.read_csv(run.results / "blade.csv")
        layers = pd.read_csv(run.results / "layers.csv")
        surface = pd.read_csv(run.results / "surface.csv")
        draw_wall(folder, run.results, out / "wall-push.png")
    error = WALL_TIP_PX - blade["blade_x_mm"].to_numpy() / WALL_SCALE - np.array(WALL_PX)
    found = np.isfinite(error)
    spread = error[found] - error[found].mean()
    return [
        Row("exit code", float(run.exit_code), "1"),
        Row("wall found", float(found.sum()), "of 18"),
        Row("wall against its published place, rms", rms(error[found]), "px"),
        Row("the same less its mean", rms(spread), "px"),
        Row("dark layer at rest, x > 700 mm, median |drift|", _drift(layers.dropna()), "px"),
        Row("surface at rest, x > 700 mm, median |drift|", _drift(surface), "px"),
    ]


def _drift(table: pd.DataFrame, beyond_mm: float = 700.0) -> float:
    """Median change of height, px, of a line over sand at rest against the first photograph."""
    first = table[table["frame"] == 0].sort_values("x_mm")
    far = table[(table["x_mm"] > beyond_mm) & table["frame"].between(1, 13)]
    moved = far["y_mm"] - np.interp(far["x_mm"], first["x_mm"], first["y_mm"])
    return float(moved.abs().median()) / WALL_SCALE


def follow(
    pictures: Sequence[NDArray[np.generic]], points: Floats, sand: NDArray[np.bool_]
) -> list[FramePoints]:
    """Points of the first picture through the others."""
    tracker = Tracker(Piv(), workers=2)
    tracker.start(pictures[0], points, sand)
    return [tracker.advance(picture, sand) for picture in pictures[1:]]


def grid(shape: tuple[int, int], step: int, margin: int = 20) -> Floats:
    """Points every ``step`` px, ``margin`` from the border."""
    rows, columns = np.mgrid[margin : shape[0] - margin : step, margin : shape[1] - margin : step]
    return np.column_stack([columns.ravel(), rows.ravel()]).astype(float)


def avalanche(data: Path, out: Path | None) -> list[Row]:
    """Still sand stays; flowing sand flows as measured; what comes back must come back to its start."""
    pictures = [decode(p) for p in sorted((data / "sand_avalanche").glob("*.jpeg"))]
    sand = np.ones(pictures[0].shape, np.bool_)
    known = np.array([*STILL_PX, *FLOWING], float)
    points = np.vstack([known, grid(sand.shape, 12)])
    seen = follow(pictures, points, sand)
    status = np.array([s.status for s in seen])
    place = np.array([s.position_px for s in seen])
    still = np.linalg.norm(place[:, : len(STILL_PX)] - points[: len(STILL_PX)], axis=-1)
    first = place[0, len(STILL_PX) : len(known)] - known[len(STILL_PX) :]
    flow = np.abs(first - list(FLOWING.values())).max(axis=1)
    ok = status[-1] == Status.OK
    back = follow(pictures[::-1], place[-1][ok], sand)[-1]
    closed = np.linalg.norm(back.position_px - points[ok], axis=1)
    far = np.linalg.norm(place[-1] - points, axis=1)
    moved = ok & (far > 1)
    if out is not None:
        draw_tracks(pictures, points, seen, out / "avalanche.png")
    rows = [
        Row("points", float(len(points)), "1"),
        Row("still points, largest drift in 20 frames", float(np.nanmax(still)), "px"),
        Row("still points found in every frame", float(np.isfinite(still).all(axis=0).sum()), "of 6"),
        Row("flowing points, pair 0-1, largest difference to the known", float(np.nanmax(flow)), "px"),
        Row("valid in the last frame", 100 * float(ok.mean()), "%"),
        Row("of these moved by more than 1 px", float(moved.sum()), "1"),
        Row("largest way of a valid point", float(np.nanmax(far[ok])), "px"),
        Row("there and back again: valid", 100 * float(np.isfinite(closed).mean()), "%"),
        Row("there and back again: median", float(np.nanmedian(closed)), "px"),
        Row("there and back again: 95 %", float(np.nanquantile(closed, 0.95)), "px"),
    ]
    back_moved = closed[moved[ok]]
    if np.isfinite(back_moved).any():
        rows.append(Row("there and back again, moved: 95 %", float(np.nanquantile(back_moved, 0.95)), "px"))
    return [*rows, *_ended(status)]


def _ended(status: NDArray[np.int8]) -> list[Row]:
    codes, counts = np.unique(status[-1], return_counts=True)
    return [
        Row(f"last frame: {Status(int(code)).meaning}", float(count), "1")
        for code, count in zip(codes, counts, strict=True)
    ]


def wedge(data: Path, out: Path | None) -> list[Row]:
    """Tracked points against whole-pixel matches over long baselines."""
    pictures = [decode(p) for p in sorted((data / "sandbox_wedge_crop" / "images").glob("*.jpg"))]
    sand = np.ones(pictures[0].shape, np.bool_)
    points = np.vstack([np.array(list(WEDGE), float), grid(sand.shape, 8, 14)])
    seen = follow(pictures, points, sand)
    rows = []
    for frames, number in ((10, 0), (15, 1)):
        moved = seen[frames - 1].position_px[: len(WEDGE)] - points[: len(WEDGE)]
        off = np.abs(moved - np.array([both[number] for both in WEDGE.values()])).max(axis=1)
        rows += [
            Row(f"{frames} frames: known points followed", float(np.isfinite(off).sum()), "of 4"),
            Row(f"{frames} frames: largest difference to whole-pixel matches", float(np.nanmax(off)), "px"),
        ]
    if out is not None:
        draw_tracks(pictures, points, seen, out / "wedge.png", zoom=4)
    rows += dyed_line(data / "sandbox_wedge_crop", out)
    return [*rows, *_ended(np.array([s.status for s in seen]))]


def tbar(data: Path, out: Path | None) -> list[Row]:
    """Far field in steady translation; nothing is reported under the disc."""
    pictures = [decode(p) for p in sorted((data / "tbar_clay_geopyv").glob("*.jpg"))]
    rows, columns = np.mgrid[: pictures[0].shape[0], : pictures[0].shape[1]]
    x, y, radius = TBAR_DISC
    soil = np.hypot(columns - x, rows - y) > radius
    points = np.vstack([np.array(TBAR_PX, float), grid(soil.shape, 100, 150)])
    points = points[np.hypot(points[:, 0] - x, points[:, 1] - y) > radius + 16]
    seen = follow(pictures, points, soil)
    place = np.array([points, *(s.position_px for s in seen)])
    steps = np.diff(place, axis=0)
    far = steps[:, : len(TBAR_PX)]
    # the flow is steady: second differences along a track are the error of readings and its small curvature
    second = np.diff(steps, axis=0)[:, len(TBAR_PX) :]
    if out is not None:
        draw_tracks(pictures, points, seen, out / "tbar.png", zoom=1)
    return [
        Row("far field, v, mean of six points and five pairs", float(np.nanmean(far[..., 1])), "px"),
        Row(
            "far field, largest difference to 1.98 px",
            float(np.nanmax(np.abs(far[..., 1] - TBAR_STEP_PX))),
            "px",
        ),
        Row("far field, largest |u|", float(np.nanmax(np.abs(far[..., 0]))), "px"),
        Row("second differences of tracks, median |d|", float(np.nanmedian(np.abs(second))), "px"),
        Row("second differences of tracks, rms", rms(second[np.isfinite(second)]), "px"),
        Row("points", float(len(points)), "1"),
        *_ended(np.array([s.status for s in seen])),
    ]


if __name__ == "__main__":
    main()
