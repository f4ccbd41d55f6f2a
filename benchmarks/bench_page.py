"""The report page: seconds and bytes against the number of photographs, their size and their kind.

Each case is a result folder made in closed form (layers, surface, tracked points, bands, force) over
photographs of random grains. Printed as CSV: what reading the results, the player, and the whole page take,
what the page weighs, and what of that are the player's photographs, lines and points.

    python benchmarks/bench_page.py [--quick] [--cases 1,2] [--out FILE.csv]

Seconds by the clock and of the processor (all threads) stand side by side: on a busy machine the second
tells more.
"""

import argparse
import csv
import json
import re
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import xarray as xr
from PIL import Image

from ploughval.report import write_report
from ploughval.report.photographs import open_photographs
from ploughval.report.player import player_chapter
from ploughval.results import read_results
from ploughval.scene import load_scene

DEPTH_MM, TRAVEL_MM, LONG_MM = 30.0, 60.0, 240.0
LAYERS_MM = (5.0, 10.0, 15.0, 20.0, 25.0)
SPACING_MM = 0.5  # of points along a layer and a surface
GRAIN_MM = 0.4
KINDS = ("photographs", "lines", "points", "letters")


@dataclass(frozen=True, slots=True)
class Case:
    """A test: photographs, their width and height in px, their ending, and tracked points."""

    frames: int
    shape: tuple[int, int]
    ending: str = "jpg"
    points: int = 5000


CASES = (
    Case(30, (900, 1200)),
    Case(60, (3000, 4000)),
    Case(60, (3000, 4000), "tif"),
    Case(600, (1000, 1500), points=2000),
)
QUICK = (Case(10, (900, 1200), points=500), Case(40, (900, 1200), points=500))


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the cases and print a row for each; --out is a file or the folder of page.csv."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--cases", help="places in the list of cases, from 0, joined by commas")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args(arguments)
    cases = QUICK if options.quick else CASES
    if options.cases:
        cases = tuple(cases[int(place)] for place in options.cases.split(","))
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        for number, case in enumerate(cases):
            folder = Path(scratch) / f"case{number}"
            rows.append(measured(case, folder))
            writer = csv.DictWriter(sys.stdout, rows[0])
            if number == 0:
                writer.writeheader()
            writer.writerow(rows[-1])
            sys.stdout.flush()
    if options.out:
        target: Path = options.out if options.out.suffix == ".csv" else options.out / "page.csv"
        target.parent.mkdir(parents=True, exist_ok=True)
        pd.DataFrame(rows).to_csv(target, index=False)


def measured(case: Case, folder: Path) -> dict[str, object]:
    """Seconds and bytes of one case; the player is built twice and the second time counts."""
    results_folder = make_case(case, folder)
    results, *reading = timed(lambda: read_results(results_folder))
    if case.frames <= 100:
        player_chapter(results, open_photographs(results))
    chapter, *player = timed(lambda: player_chapter(results, open_photographs(results)))
    written, *page = timed(lambda: write_report(results_folder))
    size = written.stat().st_size
    assert chapter is not None
    held = bytes_of(str(chapter.player))
    return {
        "frames": case.frames, "width_px": case.shape[1], "height_px": case.shape[0], "kind": case.ending,
        "points": case.points, "read_s": reading[0], "read_cpu_s": reading[1], "player_s": player[0],
        "player_cpu_s": player[1], "page_s": page[0], "page_cpu_s": page[1], "page_MB": round(size / 1e6, 3),
        "player_MB": round(len(str(chapter.player)) / 1e6, 3),
        **{f"{name}_MB": round(held[name] / 1e6, 3) for name in KINDS},
        "frames_shown": held["frames"], "photographs_shown": held["pictures"],
    }  # fmt: skip


def timed(act):
    """What a function returns, its seconds by the clock and those of the processor."""
    clock, processor = time.perf_counter(), time.process_time()
    made = act()
    return made, round(time.perf_counter() - clock, 2), round(time.process_time() - processor, 2)


def bytes_of(markup: str) -> dict[str, int]:
    """What the player's data weigh by kind, and how many frames they hold."""
    data = json.loads(re.search(r'id="player-data">(.*?)</script', markup, flags=re.S).group(1))
    frames = data["frames"]

    def total(*keys: str) -> int:
        return sum(len(frame.get(key, "")) for frame in frames for key in keys)

    still = re.search(r'<image href="([^"]*)"', markup)
    pictures = sum("p" in frame for frame in frames) + (still is not None)
    return {
        "photographs": total("p") + (len(still.group(1)) if still else 0),
        "lines": total("L", "M", "S", "T"), "points": total("d"), "letters": total("m", "g"),
        "frames": len(frames), "pictures": pictures,
    }  # fmt: skip


def make_case(case: Case, folder: Path) -> Path:
    """A test folder with photographs and the results of a run over it."""
    rng = np.random.default_rng(9)
    (folder / "photos").mkdir(parents=True)
    height, width = case.shape
    scale = LONG_MM / width
    u = np.linspace(0.0, TRAVEL_MM, case.frames)
    tip = [15.0 / scale, height - 20.0 / scale]
    (folder / "test.toml").write_text(
        f'[test]\nname = "{case.frames} x {width * height / 1e6:.0f} Mpx"\n[blade]\ndepth_mm = {DEPTH_MM}\n'
        f'width_mm = 218.0\n[camera]\nphotos = "photos/*.{case.ending}"\nmm_per_px = {scale}\n'
        f"tip_px = {tip}\ntimes = {{start_s = 10.0, interval_s = 1.0}}\n"
    )
    write_photographs(case, folder / "photos", rng, scale, tip, u)
    write_tables(case, folder / "results", rng, u)
    frames = [
        {"frame": k, "file": f"f{k:04d}.{case.ending}", "time_s": 10.0 + k, "u_mm": travel, "status": "ok"}
        for k, travel in enumerate(u)
    ]
    scene = load_scene(folder)
    record = {
        "ploughval": "0.1.0", "test": scene.test.name, "folder": str(folder), "frames": frames,
        "settings": {"blade": {"depth_mm": DEPTH_MM}}, "settings_hash": scene.settings_hash,
        "calibration": {"method": "scale and tip", "mm_per_px": scale}, "steps": [],
    }  # fmt: skip
    (folder / "results" / "run.json").write_text(json.dumps(record))
    return folder / "results"


def write_photographs(case, folder, rng, scale, tip, u) -> None:
    """Sand below a level that the blade raises, air above; grains as noise filtered to their size."""
    height, width = case.shape
    noise = cv2.GaussianBlur(rng.normal(size=case.shape).astype(np.float32), (0, 0), GRAIN_MM / scale / 2)
    sand = np.clip(125 + 45 * noise / noise.std(), 0, 255).astype(np.uint8)
    y = (tip[1] - np.arange(height)[:, None]) * scale
    x = (np.arange(width)[None, :] - tip[0]) * scale
    for k, travel in enumerate(u):
        image = np.where(y < surface_mm(x, travel), np.roll(sand, int(travel / scale), axis=1), np.uint8(15))
        image = np.where((x < travel) & (x > travel - 5) & (y > 0), np.uint8(240), image)
        path = folder / f"f{k:04d}.{case.ending}"
        Image.fromarray(image).save(path, **({"quality": 92} if case.ending == "jpg" else {}))


def surface_mm(x, u):
    """Height of a heap of constant slope ahead of the blade, mm."""
    return DEPTH_MM + np.maximum(0.0, 0.35 * u - 0.6 * np.maximum(0.0, x - u - 0.8 * u))


def write_tables(case, folder, rng, u) -> None:
    """Layers, surface, tracks, bands and force in closed form, with the noise of a measurement."""
    (folder / "model").mkdir(parents=True)
    x = np.arange(0.0, LONG_MM - 20.0, SPACING_MM)
    layers, predicted, surfaces = [], [], []
    for k, travel in enumerate(u):
        there = x[x > travel]
        lift = np.maximum(0.0, 0.35 * travel - 0.3 * np.maximum(0.0, there - 1.6 * travel))
        for height in LAYERS_MM:
            columns = {"frame": k, "u_mm": travel, "layer": height, "x_mm": there}
            y = height + lift * height / DEPTH_MM
            noisy = y + rng.normal(0, 0.02, y.size)
            layers.append(pd.DataFrame({**columns, "source": "tracks", "y_mm": noisy, "std_mm": 0.02}))
            predicted.append(pd.DataFrame({**columns, "source": "model", "y_mm": y, "std_mm": 0.0}))
        y = surface_mm(there, travel) + rng.normal(0, 0.03, there.size)
        surfaces.append(pd.DataFrame({"frame": k, "u_mm": travel, "x_mm": there, "y_mm": y}))
    pd.concat(layers).to_csv(folder / "layers.csv", index=False, float_format="%.9g")
    pd.concat(predicted).to_csv(folder / "model" / "layers.csv", index=False, float_format="%.9g")
    pd.concat(surfaces).to_csv(folder / "surface.csv", index=False, float_format="%.9g")
    tracks_of(case, rng, u).to_netcdf(folder / "tracks.nc", engine="h5netcdf")
    log = np.linspace(0.0, TRAVEL_MM, 6000)
    force = 8 + 0.1 * np.mod(log, 20.0) + rng.normal(0, 0.02, log.size)
    pd.DataFrame(
        {
            "time_s": 10 + log, "u_mm": log, "force_N": force, "force_std_N": 0.2, "arm_mm": 10.0,
            "arm_std_mm": 0.5, "force_raw_N": force, "friction_N": 0.0, "status": "ok",
        }
    ).to_csv(folder / "force.csv", index=False, float_format="%.9g")  # fmt: skip
    bands = {"band": [0, 1, 2], "u_start_mm": [0.0, 20.0, 40.0], "u_end_mm": [20.0, 40.0, TRAVEL_MM]}
    more = {"beta_deg": 25.0, "beta_std_deg": 0.2, "outcrop_x_mm": [64.0, 90.0, 120.0]}
    pd.DataFrame({**bands, **more, "outcrop_std_mm": 0.3, "slip_mm": 20.0}).to_csv(
        folder / "bands.csv", index=False
    )


def tracks_of(case, rng, u) -> xr.Dataset:
    """Points on a grid; those above the band go with the blade."""
    across = round((case.points * 5.0) ** 0.5)
    x, y = (g.ravel() for g in np.meshgrid(np.linspace(2, 200, across), np.linspace(-8, 29, across // 5)))
    moving = np.clip((y - 0.45 * (x - 0.3 * u[:, None])) / 3 + 0.5, 0, 1)
    travel = np.vstack([np.zeros((1, x.size)), np.cumsum(np.diff(u)[:, None] * moving[1:], axis=0)])
    px = x + travel + rng.normal(0, 0.004, travel.shape)
    py = y + 0.4 * travel + rng.normal(0, 0.004, travel.shape)
    small = np.zeros(px.shape)
    return xr.Dataset(
        {
            "x0_mm": ("point", x), "y0_mm": ("point", y), "layer_mm": ("point", np.full(x.shape, np.nan)),
            "x_mm": (("frame", "point"), px), "y_mm": (("frame", "point"), py),
            "std_mm": (("frame", "point"), small + 0.004), "zncc": (("frame", "point"), small + 0.99),
            "status": (("frame", "point"), small.astype(np.int8)),
            "time_s": ("frame", 10.0 + u), "u_mm": ("frame", u), "blade_x_mm": ("frame", u),
        }
    )  # fmt: skip


if __name__ == "__main__":
    main()
