"""How often a mistyped control point is named, a right one blamed, or nothing seen: random cameras."""

import argparse
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pandas as pd

from made.cameras import SHAPE, made_camera, window_points
from ploughval.errors import CalibrationError
from ploughval.photos.calibration.blunder import refuse_blunder
from ploughval.photos.calibration.camera_fit import PointSet, fit_camera

SAID = ("named", "another_named", "seen_only", "unseen")


def _off_ten(mm, k):
    mm[k] += [7.0, -7.0]


def _negative(mm, k):
    mm[k, 0] *= -1


def _exchanged_axes(mm, k):
    mm[k] = mm[k, ::-1]


def _tenfold(mm, k):
    mm[k, 0] *= 10


def _exchanged_points(mm, k):
    other = (k + len(mm) // 2) % len(mm)
    mm[[k, other]] = mm[[other, k]]


SLIPS = {
    "none": None,
    "10 mm off": _off_ten,
    "sign of x": _negative,
    "x and y exchanged": _exchanged_axes,
    "x tenfold": _tenfold,
    "two points exchanged": _exchanged_points,
}


def blunder(points, k):
    """What is said of control points of which the k-th is wrong: one of :data:`SAID`."""
    try:
        try:
            fit = fit_camera(points)
        except CalibrationError:
            refuse_blunder(points, None)
            raise
        refuse_blunder(points, fit)
    except CalibrationError as error:
        named = {int(n) for n in re.findall(r"control_points\.(\d+)", str(error))}
        return "named" if k in named else ("another_named" if named else "seen_only")
    return "unseen"


def blunder_table(cameras, seed=2):
    """How often a wrong point is named, a right one blamed, or nothing seen; read to 0.3 px."""
    rows = []
    for count in (5, 6, 8, 12, 20):
        for slip, spoil in SLIPS.items():
            rng = np.random.default_rng([seed, count, list(SLIPS).index(slip)])
            said = Counter()
            for _ in range(cameras):
                tilt, distance = rng.uniform(-3, 3, 2), rng.uniform(500, 1600)
                lens = (rng.uniform(-0.01, 0.01), 0.0, 0.0, 0.0)
                camera = made_camera(tilt_deg=tilt, distance_mm=distance, lens=lens)
                mm = window_points(count, rng)
                px = camera.photograph(mm) + rng.normal(0, 0.3, mm.shape)
                k = int(rng.integers(count))
                if spoil is not None:
                    spoil(mm, k)
                said[blunder(PointSet(px, mm, SHAPE), k)] += 1
            rows.append((slip, count, cameras, *(said[word] / cameras for word in SAID)))
    return pd.DataFrame(rows, columns=["slip", "points", "cameras", *SAID])


def main(argv=None):
    """Print the table and write it as CSV."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/calibration"))
    parser.add_argument("--cameras", type=int, default=100)
    options = parser.parse_args(argv)
    found = blunder_table(options.cameras)
    print(found.to_string(index=False, float_format=lambda v: f"{v:.3f}"))
    options.out.mkdir(parents=True, exist_ok=True)
    found.to_csv(options.out / "blunders.csv", index=False, float_format="%.4g", lineterminator="\n")


if __name__ == "__main__":
    main()
