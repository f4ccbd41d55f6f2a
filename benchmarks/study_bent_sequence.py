"""A made test photographed square and through a bent lens askew: errors of both against the same exact truth.

The second folder holds the first one's photographs, resampled as such a camera would show them, and control
points read to 0.05 px instead of the scale. Errors are in px of the square photographs.
"""

import argparse
import re
import shutil
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
from PIL import Image
from scipy.ndimage import map_coordinates

from ploughval import process
from ploughval.photos.calibration.homography import inverse, project
from ploughval.photos.calibration.lens import Lens
from ploughval.synth import EXAMPLE, adapt, load_truth, make_folder
from sequences.errors import Tracked, blade_errors, layer_errors, surface_errors, track_errors

SIZE = {"frames": 10, "mm_per_px": 0.25, "displacement_mm": 15.0, "rate_hz": 20.0, "noise_grey": 1.0}
MADE = adapt(EXAMPLE, soil={}, loadcells=False, **SIZE)
TERMS = np.array([-0.012, 0.001, 0.0, 0.0, 0.0])
TURN_DEG, SHIFT_PX, PERSPECTIVE = 1.0, (6.0, -4.0), (6e-5, -4e-5)  # 2.5 % across the picture


def askew():
    """Homography from the square photograph to the one without distortion, px to px."""
    c, s = np.cos(np.radians(TURN_DEG)), np.sin(np.radians(TURN_DEG))
    return np.array([[c, -s, SHIFT_PX[0]], [s, c, SHIFT_PX[1]], [*PERSPECTIVE, 1.0]])


def bend_folder(square, bent, rng):
    """Write the folder whose photographs a bent lens has taken askew."""
    shutil.copytree(square, bent)
    text = (square / "test.toml").read_text(encoding="utf-8")
    camera = tomllib.loads(text)["camera"]
    for path in sorted((bent / "photos").iterdir()):
        image = np.asarray(Image.open(path))
        lens = Lens.of_picture(image.shape, TERMS)
        y, x = np.mgrid[: image.shape[0], : image.shape[1]].astype(float)
        at = project(inverse(askew()), lens.undistort(np.stack([x, y], axis=-1)))
        grey = map_coordinates(image.astype(float), [at[..., 1], at[..., 0]], order=5, mode="nearest")
        Image.fromarray(np.clip(np.rint(grey), 0, 255).astype(np.uint8)).save(path)
    height, width = image.shape
    grid = np.meshgrid(np.linspace(15, width - 25, 6), np.linspace(15, height - 15, 4))
    px = np.stack(grid, axis=-1).reshape(-1, 2)
    mm = (px - camera["tip_px"]) * [camera["mm_per_px"], -camera["mm_per_px"]]
    read = lens.distort(project(askew(), px)) + rng.normal(0, 0.05, px.shape)
    points = np.hstack([read, mm]).round(4).tolist()
    text = re.sub(r"^mm_per_px.*\n", f"control_points = {points}\n", text, flags=re.M)
    (bent / "test.toml").write_text(re.sub(r"^tip_px.*\n", "", text, flags=re.M), encoding="utf-8")


def errors(folder):
    """Process a folder; its errors by quantity."""
    process(folder)
    results, truth = folder / "results", load_truth(folder)
    rows = track_errors(Tracked.read(results, truth, MADE.mm_per_px))
    for part in (blade_errors, surface_errors, layer_errors):
        rows += part(results, truth, MADE.mm_per_px)
    return {(row.quantity, row.unit): row.value for row in rows}


def main(argv=None):
    """Print the table and write it as CSV."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/calibration"))
    options = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as name:
        square, bent = Path(name) / "square", Path(name) / "bent"
        make_folder(square, MADE)
        bend_folder(square, bent, np.random.default_rng(0))
        columns = {"square": errors(square), "bent_askew": errors(bent)}
    found = pd.DataFrame(columns).rename_axis(["quantity", "unit"]).reset_index()
    print(found.to_string(index=False, float_format=lambda v: f"{v:.4f}"))
    options.out.mkdir(parents=True, exist_ok=True)
    found.to_csv(options.out / "sequence.csv", index=False, float_format="%.4g", lineterminator="\n")


if __name__ == "__main__":
    main()
