"""Force and line of action from made load-cell records: error, coverage of the stated uncertainty, time.

The records are those of ``made.rigs``. force.csv tells what limits the force, case by case;
force-settings.csv what the settings and the number of empty runs change, and what they cost.
"""

import argparse
import csv
import platform
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from made.rigs import NOISE, Case, Rig, accuracy
from ploughval.loadcells import measure_force

COLUMNS = (
    "case",
    "rows",
    "seeds",
    "force_rms_percent_of_mean",
    "bound_percent_of_mean",
    "arm_rms_mm",
    "arm_bound_mm",
    "force_coverage_95_percent",
    "arm_coverage_95_percent",
    "coverage_std_percent",
    "seconds",
)
SETTING_COLUMNS = (
    "family", "setting", "default", "rows", "seeds", "force_rms_percent", "bound_percent", "arm_rms_mm",
    "force_coverage_95_percent", "cpu_ms", "wall_ms",
)  # fmt: skip

CASES = (
    Case("noise of 0.002 N m", noise_Nm=NOISE),
    Case("noise of 0.4 % of the moments", noise_share=0.004),
    Case("the same at 100 Hz, smoothed to 2 Hz", noise_share=0.004, bandwidth_Hz=2.0, rate_hz=100.0),
    Case("the same at 100 Hz, smoothed to 0.5 Hz", noise_share=0.004, bandwidth_Hz=0.5, rate_hz=100.0),
    Case("noise, friction scatters by 5 %", noise_Nm=NOISE, scatter=0.05),
    Case("noise, friction ramps by 30 %, scatters by 2 %", noise_Nm=NOISE, scatter=0.02, ramp=0.3),
    Case("noise, friction, geometry, gains", NOISE, 0.0, 3.0, 0.05, 0.0, 150.0, 0.1, 0.3, 0.0005),
    Case("the same, calibrated by known forces", NOISE, 0.0, 3.0, 0.05, 0.0, 150.0, 0.1, 0.3, session=True),
    Case("drift of 5 % of full scale, rest at both ends", noise_Nm=NOISE, drift=0.05),
    Case("friction as large as the force", noise_Nm=NOISE, friction_N=14.6, scatter=0.02),
    Case("spacing of 1 mm", noise_Nm=NOISE / 100, spacing_mm=1.0),
)

LOGGED = Case("noise of 0.4 % of the moments", noise_share=0.004, rate_hz=100.0)
SCATTERED = Case("noise, friction scatters by 5 %", noise_Nm=NOISE, scatter=0.05)
FAMILIES = {
    "bandwidth, Hz": {
        "none": LOGGED,
        **{f"{hz:g}": replace(LOGGED, bandwidth_Hz=hz) for hz in (10.0, 5.0, 2.0, 1.0, 0.5, 0.2)},
    },
    "rows a second": {f"{hz:g}": replace(SCATTERED, rate_hz=hz) for hz in (20.0, 100.0, 500.0)},
    "empty runs": {f"{runs}": replace(SCATTERED, empty_runs=runs) for runs in (1, 2, 3, 5, 10)},
    "friction taken off": {
        "per cell": SCATTERED,
        "force only": replace(SCATTERED, compensation="force_only"),
    },
}
DEFAULTS = ("none", "20", "3", "per cell")  # of the settings where there is one, else as in the example
SETTING_SEEDS = 100


def one_hour(folder):
    """Seconds for an hour at 1 kHz, reading included."""
    case = Case("one hour at 1 kHz, no empty runs", noise_Nm=NOISE, rate_hz=1000.0)
    rig = Rig(case, np.random.default_rng(0), travel_mm=359.0, speed_mm_s=0.1)
    scene = rig.write(folder)
    scene = scene.model_copy(update={"loadcells": scene.loadcells.model_copy(update={"empty": ()})})
    begun = time.perf_counter()
    found = measure_force(scene).record
    seconds = time.perf_counter() - begun
    error = found["force_N"].to_numpy()[rig.moving] - case.friction_N - rig.force[rig.moving]
    rms = 100 * np.sqrt(np.nanmean(error**2)) / rig.force[rig.moving].mean()
    return (case.name, len(found), 1, rms, *(float("nan"),) * 6, seconds)


def settings_table(seeds, folder):
    """A row a setting: the case it belongs to is the same in a family but for what is varied."""
    rows, known = [], {}
    for (family, members), default in zip(FAMILIES.items(), DEFAULTS, strict=True):
        for name, case in members.items():
            if case not in known:
                known[case] = accuracy(case, seeds, folder)
            found = known[case]
            rows.append(
                (family, name, name == default, found.rows, seeds, found.force_rms_percent,
                 found.force_bound_percent, found.arm_rms_mm, found.force_coverage_percent,
                 1000 * found.cpu_s, 1000 * found.wall_s)
            )  # fmt: skip
    return pd.DataFrame(rows, columns=list(SETTING_COLUMNS))


def case_row(case, seeds, folder):
    """A row of force.csv."""
    found = accuracy(case, seeds, folder)
    return (case.name, found.rows, seeds, *found[1:8], found.wall_s)


def main(argv=None):
    """Print the tables and write them as CSV."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--seeds", type=int, default=1000)
    parser.add_argument("--settings", action="store_true", help="force-settings.csv alone")
    parser.add_argument("--quick", action="store_true", help="10 seeds, no one-hour record")
    options = parser.parse_args(argv)
    seeds = 10 if options.quick else options.seeds
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        accuracy(SCATTERED, 2, name)  # loads what is loaded late
        settings = settings_table(min(seeds, SETTING_SEEDS), name)
        print(settings.to_string(index=False, float_format=lambda v: f"{v:.3f}"))
        settings.to_csv(
            options.out / "force-settings.csv", index=False, float_format="%.4g", lineterminator="\n"
        )
        if options.settings:
            return
        rows = [case_row(case, seeds, name) for case in CASES]
        if not options.quick:
            rows.append(one_hour(Path(name)))
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    print(table.to_string(index=False, float_format=lambda v: f"{v:.3f}"))
    with (options.out / "force.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*COLUMNS, "machine", "python", "numpy", "pandas"])
        made = (platform.machine(), platform.python_version(), np.__version__, pd.__version__)
        writer.writerows([*row[:3], *(f"{value:.5g}" for value in row[3:]), *made] for row in rows)


if __name__ == "__main__":
    main()
