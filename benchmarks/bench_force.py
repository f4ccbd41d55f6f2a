"""Force and line of action from made load-cell records: error, coverage of the stated uncertainty, time.

Every record comes from a known force and line of action through a rig whose spacing, heights, gains, zeros
and friction are drawn from their stated uncertainties. Rows of one seed share what is systematic.
"""

import argparse
import csv
import platform
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

from ploughval.loadcells import measure_force
from ploughval.loadcells.bending import moments
from ploughval.scene import Scene

COLUMNS = (
    "case",
    "rows",
    "seeds",
    "force_rms_percent_of_mean",
    "arm_rms_mm",
    "force_coverage_95_percent",
    "arm_coverage_95_percent",
    "seconds",
)
SPACING_MM, LOWER_MM = 150.0, 260.0
REST_S = 10.0
NAMES = ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
CASES = {
    # noise of a moment (N m), scatter of friction between runs, deviations of spacing, height (mm) and gains
    "noise": (0.002, 0.0, 0.0, 0.0, 0.0),
    "noise, friction": (0.002, 0.05, 0.0, 0.0, 0.0),
    "noise, friction, geometry, gains": (0.002, 0.05, 0.1, 0.3, 0.0005),
}


def true_force(u):
    """A saw-tooth like a ploughing history's: 11 to 20 N, N."""
    return 11 + 9 * ((u / 20) % 1) ** 1.5


def record(rng, *, rate_hz, travel_mm, speed_mm_s, sand, rig, friction_N, noise_Nm):
    """One log: (table, true force, moving)."""
    t = np.arange(int((REST_S + travel_mm / speed_mm_s) * rate_hz)) / rate_hz
    u = np.clip((t - REST_S) * speed_mm_s, 0, None)
    moving = t > REST_S
    force = np.where(moving, true_force(u), 0.0) if sand else np.zeros(t.size)
    cells = np.stack(moments(force, np.full(t.size, 10.0), rig["spacing"], rig["lower"]))
    cells += np.stack(
        moments(np.where(moving, friction_N, 0.0), np.full(t.size, 15.0), rig["spacing"], rig["lower"])
    )
    cells = cells / rig["gain"][:, None] + rig["zero"][:, None] + rng.normal(0, noise_Nm, cells.shape)
    shown = u + rng.normal(0, 0.002, t.size)
    return pd.DataFrame(np.column_stack([t, shown, cells.T]), columns=list(NAMES)), force, moving


def make_test(folder, seed, case, **travel):
    """Write one test folder; return its scene, the true force and which rows move."""
    noise, scatter, spacing_std, lower_std, gain_std = CASES[case]
    rng = np.random.default_rng(seed)
    rig = {
        "spacing": SPACING_MM + spacing_std * rng.normal(),
        "lower": LOWER_MM + lower_std * rng.normal(),
        "gain": 1 + gain_std * rng.normal(size=2),
        "zero": rng.normal(0, 0.2, 2),
    }

    def run(sand):
        friction = 3.0 * (1 + scatter * rng.normal())
        return record(rng, sand=sand, rig=rig, friction_N=friction, noise_Nm=noise, **travel)

    (folder / "empty").mkdir(exist_ok=True)
    table, force, moving = run(True)
    table.to_csv(folder / "loadcells.csv", index=False, float_format="%.7g")
    for k in range(3):
        run(False)[0].to_csv(folder / f"empty/{k}.csv", index=False, float_format="%.7g")
    cells = {
        "log": "loadcells.csv",
        "empty": ["empty/*.csv"],
        "spacing_mm": SPACING_MM,
        "lower_to_tip_mm": LOWER_MM,
        "spacing_std_mm": spacing_std,
        "lower_to_tip_std_mm": lower_std,
        "calibration": {"upper_Nm_per_unit_std": gain_std, "lower_Nm_per_unit_std": gain_std},
    }
    blade = {"depth_mm": 30, "width_mm": 218}
    scene = Scene.model_validate(
        {"folder": folder, "test": {"name": "b"}, "blade": blade, "loadcells": cells}
    )
    return scene, force, moving


def accuracy(case, seeds, folder):
    """Errors and coverage over seeds; rows of one seed share what is systematic, seeds are independent."""
    force_squares, arm_squares, force_inside, arm_inside = [], [], [], []
    start = 0.0
    for seed in range(seeds):
        scene, force, moving = make_test(folder, seed, case, rate_hz=50, travel_mm=40.0, speed_mm_s=1.0)
        begun = time.perf_counter()
        found = measure_force(scene).record[moving]
        start += time.perf_counter() - begun
        error = found["force_N"].to_numpy() - force[moving]
        arm = found["arm_mm"].to_numpy() - 10.0
        force_squares.append(np.nanmean(error**2))
        arm_squares.append(np.nanmean(arm**2))
        force_inside.append(np.mean(np.abs(error) <= 1.96 * found["force_std_N"]))
        arm_inside.append(np.mean(np.abs(arm) <= 1.96 * found["arm_std_mm"]))
    mean = force[moving].mean()
    return (
        case,
        moving.size,
        seeds,
        100 * np.sqrt(np.mean(force_squares)) / mean,
        np.sqrt(np.mean(arm_squares)),
        100 * np.mean(force_inside),
        100 * np.mean(arm_inside),
        start / seeds,
    )


def one_hour(folder):
    """Seconds for an hour at 1 kHz, reading included."""
    travel = {"rate_hz": 1000, "travel_mm": 359.0, "speed_mm_s": 0.1}
    scene, force, moving = make_test(folder, 0, "noise", **travel)
    scene = scene.model_copy(update={"loadcells": scene.loadcells.model_copy(update={"empty": ()})})
    begun = time.perf_counter()
    found = measure_force(scene).record
    seconds = time.perf_counter() - begun
    error = found["force_N"].to_numpy()[moving] - 3.0 - force[moving]
    rms = 100 * np.sqrt(np.nanmean(error**2)) / force[moving].mean()
    return ("one hour at 1 kHz, no empty runs", len(found), 1, rms, *(float("nan"),) * 3, seconds)


def main(argv=None):
    """Print the table and write it as CSV."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--seeds", type=int, default=300)
    parser.add_argument("--quick", action="store_true", help="20 seeds, no one-hour record")
    options = parser.parse_args(argv)
    seeds = 20 if options.quick else options.seeds
    with tempfile.TemporaryDirectory() as name:
        rows = [accuracy(case, seeds, Path(name)) for case in CASES]
        if not options.quick:
            rows.append(one_hour(Path(name)))
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    print(table.to_string(index=False, float_format=lambda v: f"{v:.3f}"))
    options.out.mkdir(parents=True, exist_ok=True)
    with (options.out / "force.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*COLUMNS, "machine", "python", "numpy", "pandas"])
        made = (platform.machine(), platform.python_version(), np.__version__, pd.__version__)
        writer.writerows([*row[:3], *(f"{value:.5g}" for value in row[3:]), *made] for row in rows)


if __name__ == "__main__":
    main()
