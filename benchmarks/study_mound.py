"""Crest, face, front, flank, slope and area of measured surfaces against those of the exact ones.

    python benchmarks/study_mound.py FOLDER... [--std-px 0.21]

FOLDER: processed test folders of ``ploughval synth``, with ``results`` and ``truth``. ``surface.csv`` holds
no uncertainties: ``--std-px`` is what the surface finder states (0.21 px in the median). Prints, for each
part, the error's median and spread, the stated standard uncertainty, and how often it is within two.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from ploughval.compare.mound.history import lines_of, measured_mounds, reading_of, rest_of
from ploughval.compare.mound.shape import mound_of
from ploughval.scene import load_scene

PARTS = ("crest", "face", "front", "flank", "slope", "area")


def readings(folder: Path, std_px: float) -> Iterator[tuple[str, float, float]]:
    """Part, error and stated standard uncertainty of every frame of a folder."""
    scene = load_scene(folder)
    scale = scene.camera.mm_per_px if scene.camera is not None else None
    if scale is None:
        raise SystemExit(f"{folder}: test.toml states no camera.mm_per_px")
    surface = pd.read_csv(folder / "results" / "surface.csv").assign(std_mm=std_px * scale)
    depth = scene.blade.depth_mm
    lines, exact = lines_of(surface), lines_of(pd.read_csv(folder / "truth" / "surface.csv"))
    rest, exact_rest = rest_of(lines, depth)[0], rest_of(exact, depth)[0]
    reading = reading_of(surface, rest, depth)
    for frame, mound in measured_mounds(lines, rest, reading).items():
        if frame not in exact:
            continue
        u, line = exact[frame]
        truth = mound_of(line, exact_rest, max(u, 0.0), reading)
        for part in PARTS:
            seen, true = getattr(mound, part), getattr(truth, part)
            if np.isfinite(seen.value) and np.isfinite(true.value):
                yield part, seen.value - true.value, seen.std


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """A row a part: number of frames, errors, stated uncertainty and coverage."""
    table = []
    for part, found in rows.groupby("part", sort=False):
        error, ratio = found["error"], found["error"] / found["std"]
        table.append(
            {
                "part": part,
                "frames": len(found),
                "median_error": error.median(),
                "spread": 1.4826 * (error - error.median()).abs().median(),
                "stated_std": found["std"].median(),
                "rms_in_stds": float(np.sqrt((ratio**2).mean())),
                "within_two": float((ratio.abs() <= 2).mean()),
            }
        )
    return pd.DataFrame(table)


def main() -> None:
    """Read the folders and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--std-px", type=float, default=0.21)
    parser.add_argument("--out", type=Path, help="also write the table to this .csv")
    options = parser.parse_args()
    whole = [f for f in options.folders if (f / "results" / "run.json").is_file()]
    rows = [row for folder in whole for row in readings(folder, options.std_px)]
    table = summary(pd.DataFrame(rows, columns=["part", "error", "std"]))
    print(f"{len(whole)} folders")
    print(table.round(3).to_string(index=False))
    if options.out is not None:
        table.to_csv(options.out, index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
