"""How exactly control points place the window: random cameras, errors in mm, coverage of the stated stds.

Every camera is drawn anew (tilt, roll, distance, lens); points are read with a stated error. Errors are taken
on a grid over the whole window, of 200 mm.
"""

import argparse
import csv
from pathlib import Path

import numpy as np
import pandas as pd

from made_cameras import SHAPE, made_camera, over_window, window_points
from ploughval.photos.camera_fit import PointSet, fit_camera
from ploughval.photos.camera_model import spread_of

COLUMNS = (
    "case", "points", "read_px", "cameras", "rms_mm", "p95_mm", "worst_mm", "within_1_std", "within_2_std",
    "lens_taken", "std_px",
)  # fmt: skip
# barrel at the corners as drawn (share of half the diagonal), principal point off by (share of the width)
CASES = {
    "no distortion": (lambda rng: 0.0, 0.0),
    "barrel 1 %": (lambda rng: -0.01, 0.0),
    "barrel 1 %, axis off by 1 %": (lambda rng: -0.01, 0.01),
    "barrel 0.05 %": (lambda rng: -0.0005, 0.0),
    "barrel or pincushion up to 2 %": (lambda rng: rng.uniform(-0.02, 0.02), 0.003),
}
COUNTS = (4, 5, 6, 8, 12, 20, 40)


def drawn_camera(rng, case):
    """A camera tilted by up to 3 degrees about both axes, 2.5 to 8 window widths away."""
    barrel, off = CASES[case]
    k1 = barrel(rng)
    return made_camera(
        tilt_deg=rng.uniform(-3, 3, 2),
        roll_deg=rng.uniform(-2, 2),
        distance_mm=rng.uniform(500, 1600),
        off_px=rng.uniform(-off, off, 2) * SHAPE[1],
        lens=(k1, 0.1 * k1 * rng.normal(), 0.0, 0.0),
    )


def one(rng, case, count, read_px, known):
    """Errors (N, 2) and stds (N, 2) over the window, mm; the terms taken, the std of a coordinate."""
    camera = drawn_camera(rng, case)
    mm = window_points(count, rng)
    px = camera.photograph(mm) + rng.normal(0, read_px, mm.shape)
    std = np.full(count, read_px) if known else None
    fit = fit_camera(PointSet(px, mm, SHAPE, std))
    places = over_window()
    at = camera.photograph(places)
    error = fit.model.to_mm(at) - places
    changes = spread_of(lambda model: model.to_mm(at), fit.model, fit.spread)
    return error, np.sqrt(np.sum(changes**2, axis=0)), fit.term_names, fit.std_px


def row(case, count, read_px, cameras, known=True, seed=0):
    """One line of the table."""
    rng = np.random.default_rng([seed, list(CASES).index(case), count, int(1000 * read_px), known])
    found = [one(rng, case, count, read_px, known) for _ in range(cameras)]
    error, std = (np.stack([f[k] for f in found]) for k in (0, 1))
    size = np.hypot(error[..., 0], error[..., 1])
    return (
        case + ("" if known else ", std from residuals"), count, read_px, cameras,
        float(np.sqrt(np.mean(size**2))), float(np.quantile(size, 0.95)), float(size.max()),
        float(np.mean(np.abs(error) <= std)), float(np.mean(np.abs(error) <= 2 * std)),
        float(np.mean([bool(f[2]) for f in found])), float(np.mean([f[3] for f in found])),
    )  # fmt: skip


def table(cameras):
    """All cases."""
    rows = [row(case, count, 0.05, cameras) for case in CASES for count in COUNTS]
    rows += [row(case, count, 0.05, cameras, known=False) for case in CASES for count in COUNTS if count > 5]
    rows += [row("barrel 1 %", count, 0.5, cameras) for count in COUNTS]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def main(argv=None):
    """Print the table and write it as CSV."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/calibration"))
    parser.add_argument("--cameras", type=int, default=400)
    options = parser.parse_args(argv)
    found = table(options.cameras)
    print(found.to_string(index=False, float_format=lambda v: f"{v:.4f}"))
    options.out.mkdir(parents=True, exist_ok=True)
    with (options.out / "accuracy.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for line in found.itertuples(index=False, name=None):
            writer.writerow([f"{v:.4g}" if isinstance(v, float) else v for v in line])


if __name__ == "__main__":
    main()
