"""How exactly control points place the window: random cameras, errors in mm, coverage of the stated stds.

Every camera is drawn anew (tilt, roll, distance, lens); points are read with a stated error. Errors are taken
on a grid over the whole window, of 200 mm. Also: when a lens is seen, and what ignoring the window costs.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from drawing.png import save_light
from made.cameras import SHAPE, made_camera, over_window, window_points
from ploughval.photos.calibration.camera_fit import PointSet, fit_camera
from ploughval.photos.calibration.camera_model import spread_of
from ploughval.scene import Window

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


def lens_table(cameras, seed=1):
    """How often k1 is taken, by the barrel that is there and the number of points read to 0.05 px."""
    rows = []
    for barrel in (0.0, 1e-4, 2e-4, 3e-4, 5e-4, 1e-3, 1e-2):
        for count in (6, 8, 12, 20, 40):
            rng = np.random.default_rng([seed, count, int(1e5 * barrel)])
            taken, more = 0, 0
            for _ in range(cameras):
                camera = made_camera(
                    tilt_deg=rng.uniform(-3, 3, 2),
                    distance_mm=rng.uniform(500, 1600),
                    lens=(-barrel, 0, 0, 0),
                )
                mm = window_points(count, rng)
                px = camera.photograph(mm) + rng.normal(0, 0.05, mm.shape)
                names = fit_camera(PointSet(px, mm, SHAPE)).term_names
                taken += "k1" in names
                more += len(names) > 1
            rows.append((100 * barrel, count, cameras, taken / cameras, more / cameras))
    return pd.DataFrame(rows, columns=["barrel_percent", "points", "cameras", "k1_taken", "more_taken"])


def window_table():
    """What the window costs where it is ignored: exact points on its outside or inside, tilt 3 degrees."""
    rows = []
    for thickness in (10.0, 20.0, 30.0):
        for distance in (400.0, 800.0, 1600.0):
            camera = made_camera(tilt_deg=(2.1, -2.1), distance_mm=distance, pane=(thickness, 1.49))
            mm, sand = window_points(20), over_window()
            at = camera.photograph(sand)
            for side, places in (("outside", camera.outside_mm), ("inside", camera.sand_mm)):
                px = camera.photograph(mm, places)
                window = Window(
                    thickness_mm=thickness, distance_mm=float(camera.place_mm[2] - thickness), points_on=side
                )
                for what, pane in (("ignored", None), ("allowed for", window)):
                    fit = fit_camera(PointSet(px, mm, SHAPE, np.full(len(px), 0.02)), pane)
                    error = fit.model.to_mm(at) - sand
                    scale = np.polyfit(sand[:, 0], fit.model.to_mm(at)[:, 0], 1)[0] - 1
                    worst = np.hypot(*error.T).max()
                    rows.append((thickness, distance, side, what, worst, 1000 * scale, len(fit.terms)))
    names = [
        "thickness_mm",
        "distance_mm",
        "points_on",
        "window",
        "worst_mm",
        "scale_per_mille",
        "lens_terms",
    ]
    return pd.DataFrame(rows, columns=names)


def picture(found, lens, target):
    """Error against the number of points, coverage of the stated std, and when a lens is seen."""
    figure = Figure(figsize=(10.5, 3.6), layout="constrained")
    errors, coverage, seen = figure.subplots(1, 3)
    shown = found[(found["read_px"] == 0.05) & ~found["case"].str.contains("residuals")]
    for case, rows in shown.groupby("case", sort=False):
        errors.loglog(rows["points"], rows["rms_mm"], "o-", ms=4, label=case)
        for name, mark in (("within_1_std", "o"), ("within_2_std", "s")):
            some = rows[rows["points"] >= 6]
            coverage.plot(some["points"], 100 * some[name], mark, ms=4, color=errors.lines[-1].get_color())
    errors.axhline(0.02, color="0.4", lw=0.8, ls=":")
    errors.set(xlabel="control points, read to 0.05 px", ylabel="rms over a window of 200 mm, mm")
    errors.legend(fontsize=7)
    for level in (68.3, 95.4):
        coverage.axhline(level, color="0.4", lw=0.8, ls=":")
    coverage.set(xlabel="control points", ylabel="within 1 (o) and 2 stds, %", xscale="log", ylim=(40, 101))
    for count, rows in lens.groupby("points"):
        barrel = np.maximum(rows["barrel_percent"], 0.005)
        seen.semilogx(barrel, 100 * rows["k1_taken"], "o-", ms=4, label=f"{count} points")
    seen.set(xlabel="barrel at the corners, % (left end: none)", ylabel="k1 taken, %")
    seen.legend(fontsize=7)
    for axes in (errors, coverage):
        axes.set_xticks(COUNTS, [str(count) for count in COUNTS])
        axes.set_xticks([], minor=True)
    coverage.set_xlim(5.5, 44)
    for axes in (errors, coverage, seen):
        axes.grid(color="0.9")
    save_light(figure, target, dpi=110)


def write(table, path):
    """A table as CSV with four digits."""
    table.to_csv(path, index=False, float_format="%.4g", lineterminator="\n")


def main(argv=None):
    """Print the tables, write them as CSV and draw them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/calibration"))
    parser.add_argument("--cameras", type=int, default=400)
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    found, lens, window = table(options.cameras), lens_table(options.cameras), window_table()
    for name, rows in (("accuracy", found), ("lens", lens), ("window", window)):
        print(rows.to_string(index=False, float_format=lambda v: f"{v:.4f}"))
        write(rows, options.out / f"{name}.csv")
    picture(found, lens, options.out / "accuracy.png")


if __name__ == "__main__":
    main()
