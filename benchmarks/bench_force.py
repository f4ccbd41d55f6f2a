"""Force and line of action from made load-cell records: error, coverage of the stated uncertainty, time.

Every record comes from a known force and line of action through a rig whose spacing, heights, gains, zeros
and friction are drawn from their stated uncertainties. Rows of one seed share what is systematic, seeds are
independent. The bounds are the errors that noise and friction's scatter leave when all else is known.
"""

import argparse
import csv
import platform
import tempfile
import time
from dataclasses import dataclass
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
    "bound_percent_of_mean",
    "arm_rms_mm",
    "arm_bound_mm",
    "force_coverage_95_percent",
    "arm_coverage_95_percent",
    "coverage_std_percent",
    "seconds",
)
LOWER_MM, SAND_ARM_MM, BOX_ARM_MM = 260.0, 10.0, 15.0
REST_S, TRAVEL_MM, SPEED_MM_S = 10.0, 40.0, 1.0
NAMES = ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
U_NOISE_MM = 0.002


@dataclass(frozen=True)
class Case:
    """What is uncertain about a rig; noise in N m, or as a share of each cell's mean moment."""

    name: str
    noise_Nm: float = 0.0
    noise_share: float = 0.0
    friction_N: float = 3.0
    scatter: float = 0.0  # of the friction's level between runs
    ramp: float = 0.0  # of the friction over the travel, the same in all runs
    spacing_mm: float = 150.0
    spacing_std_mm: float = 0.0
    lower_std_mm: float = 0.0
    gain_std: float = 0.0
    session: bool = False  # calibration from a file of known forces at known arms
    drift: float = 0.0  # of the greatest upper moment, over the test
    bandwidth_Hz: float | None = None
    rate_hz: float = 20.0


NOISE = 0.002
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


def true_force(u):
    """A saw-tooth like a ploughing history's, 11 to 20 N, that rises and falls within a millimetre."""
    tooth = 11 + 9 * ((u / 20) % 1) ** 1.5
    falling = (u >= 20) & (u % 20 < 1)
    return np.where(u < 1, 11 * u, np.where(falling, 20 - 9 * (u % 20), tooth))


class Rig:
    """A drawn rig: what it truly is, and what is told of it."""

    def __init__(self, case, rng, travel_mm=TRAVEL_MM, speed_mm_s=SPEED_MM_S):
        self.case, self.rng = case, rng
        self.spacing = case.spacing_mm + case.spacing_std_mm * rng.normal()
        self.lower = LOWER_MM + case.lower_std_mm * rng.normal()
        self.gain = 1 + case.gain_std * rng.normal(size=2)
        self.zero = rng.normal(0, 0.2, 2)
        tail = REST_S if case.drift else 0.0
        self.t = np.arange(int((REST_S + travel_mm / speed_mm_s + tail) * case.rate_hz)) / case.rate_hz
        self.u = np.clip((self.t - REST_S) * speed_mm_s, 0, travel_mm)
        self.moving = (self.t > REST_S) & (self.t <= REST_S + travel_mm / speed_mm_s)
        self.force = np.where(self.moving, true_force(self.u), 0.0)
        mean = np.stack(moments(self.force[self.moving].mean(), SAND_ARM_MM, case.spacing_mm, LOWER_MM))
        self.noise = case.noise_share * mean if case.noise_share else np.full(2, case.noise_Nm)
        self.drift = case.drift * 20 * (LOWER_MM + case.spacing_mm) * 1e-3

    def cells(self, force, arm):
        """Readings (2, N) without noise and zero."""
        return (
            np.stack(moments(force, np.full(np.shape(force), arm), self.spacing, self.lower))
            / self.gain[:, None]
        )

    def log(self, *, sand):
        """One log."""
        level = self.case.friction_N * (1 + self.case.scatter * self.rng.normal())
        along = 1 + self.case.ramp * (self.u / self.u[-1] - 0.5)
        cells = self.cells(np.where(self.moving, level * along, 0.0), BOX_ARM_MM)
        cells += self.cells(self.force if sand else np.zeros(self.t.size), SAND_ARM_MM)
        cells += self.zero[:, None] + self.rng.normal(size=cells.shape) * self.noise[:, None]
        if sand:
            cells += self.drift * self.t / self.t[-1]
        shown = self.u + self.rng.normal(0, U_NOISE_MM, self.t.size)
        return pd.DataFrame(np.column_stack([self.t, shown, cells.T]), columns=list(NAMES))

    def session(self):
        """Known forces at three known arms, up and down, read as a mean of 100 samples."""
        rows = []
        for arm in (0.0, 10.0, 25.0):
            for load in (0.0, 5.0, 10.0, 15.0, 20.0, 15.0, 10.0, 5.0, 0.0):
                upper, lower = (
                    self.cells(np.array([load]), arm)[:, 0] + self.rng.normal(size=2) * self.noise / 10
                )
                rows.append((load, arm, upper, lower))
        return pd.DataFrame(rows, columns=["load_N", "arm_mm", "upper", "lower"])

    def write(self, folder):
        """Write the test folder; its scene."""
        case = self.case
        (folder / "empty").mkdir(exist_ok=True)
        self.log(sand=True).to_csv(folder / "loadcells.csv", index=False, float_format="%.9g")
        for k in range(3):
            self.log(sand=False).to_csv(folder / f"empty/{k}.csv", index=False, float_format="%.9g")
        calibration = {"upper_Nm_per_unit_std": case.gain_std, "lower_Nm_per_unit_std": case.gain_std}
        if case.session:
            self.session().to_csv(folder / "cells.csv", index=False)
            calibration = {"files": ["cells.csv"]}
        table = {
            "log": "loadcells.csv",
            "empty": ["empty/*.csv"],
            "spacing_mm": case.spacing_mm,
            "lower_to_tip_mm": LOWER_MM,
            "spacing_std_mm": case.spacing_std_mm,
            "lower_to_tip_std_mm": case.lower_std_mm,
            "calibration": calibration,
            "bandwidth_Hz": case.bandwidth_Hz,
        }
        if case.drift:
            table |= {"rest_s": [0.0, REST_S - 0.1], "rest_end_s": [REST_S + TRAVEL_MM + 0.5, self.t[-1]]}
        return Scene.model_validate(
            {
                "folder": folder,
                "test": {"name": "b"},
                "blade": {"depth_mm": 30, "width_mm": 218},
                "loadcells": table,
            }
        )

    def bounds(self, known):
        """Least rms error of the force, N, and over the rows ``known`` of the line of action, mm.

        Noise of a sample, and for the force the scatter of friction about the mean of three runs.
        """
        per_Nm = 1000.0 / self.case.spacing_mm
        friction = self.case.friction_N * self.case.scatter * np.sqrt(1 + 1 / 3)
        upper, lower = moments(self.force[known], SAND_ARM_MM, self.case.spacing_mm, LOWER_MM)
        slopes = np.stack([lower, -upper]) * self.case.spacing_mm / (upper - lower) ** 2
        arm = np.sqrt(np.mean((slopes**2 * self.noise[:, None] ** 2).sum(axis=0))) if known.any() else np.nan
        return float(np.hypot(per_Nm * np.hypot(*self.noise), friction)), float(arm)


def accuracy(case, seeds, folder):
    """Errors and coverage over seeds."""
    force_squares, arm_squares, force_inside, arm_inside = [], [], [], []
    seconds = 0.0
    for seed in range(seeds):
        rig = Rig(case, np.random.default_rng(seed))
        scene = rig.write(folder)
        begun = time.perf_counter()
        found = measure_force(scene).record[rig.moving]
        seconds += time.perf_counter() - begun
        error = found["force_N"].to_numpy() - rig.force[rig.moving]
        arm = found["arm_mm"].to_numpy() - SAND_ARM_MM
        force_squares.append(np.nanmean(error**2))
        force_inside.append(np.mean(np.abs(error) <= 1.96 * found["force_std_N"].to_numpy()))
        known = np.isfinite(arm)
        have = rig.moving.copy()
        have[rig.moving] = known
        if known.any():
            arm_squares.append(np.mean(arm[known] ** 2))
            arm_inside.append(np.mean(np.abs(arm[known]) <= 1.96 * found["arm_std_mm"].to_numpy()[known]))
    mean = rig.force[rig.moving].mean()
    force_bound, arm_bound = rig.bounds(have) if case.bandwidth_Hz is None else (np.nan, np.nan)
    return (
        case.name,
        rig.t.size,
        seeds,
        100 * np.sqrt(np.mean(force_squares)) / mean,
        100 * force_bound / mean,
        np.sqrt(np.mean(arm_squares)) if arm_squares else np.nan,
        arm_bound,
        100 * np.mean(force_inside),
        100 * np.mean(arm_inside) if arm_inside else np.nan,
        100 * np.std(force_inside) / np.sqrt(seeds),
        seconds / seeds,
    )


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


def main(argv=None):
    """Print the table and write it as CSV."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--seeds", type=int, default=1000)
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
