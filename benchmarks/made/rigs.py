"""Made load-cell records of rigs whose geometry, gains, zeros and friction are drawn, and their errors.

Rows of one seed share what is systematic, seeds are independent. The bounds are the errors that noise and
friction's scatter leave when all else is known.
"""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from ploughval.loadcells import measure_force
from ploughval.loadcells.bending import moments
from ploughval.scene import Scene

LOWER_MM, SAND_ARM_MM, BOX_ARM_MM = 260.0, 10.0, 15.0
REST_S, TRAVEL_MM, SPEED_MM_S = 10.0, 40.0, 1.0
NAMES = ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
U_NOISE_MM = 0.002
NOISE = 0.002


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
    empty_runs: int = 3
    compensation: str = "per_cell"
    bandwidth_Hz: float | None = None
    rate_hz: float = 20.0


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
        for k in range(case.empty_runs):
            self.log(sand=False).to_csv(folder / f"empty/{k}.csv", index=False, float_format="%.9g")
        calibration = {"upper_Nm_per_unit_std": case.gain_std, "lower_Nm_per_unit_std": case.gain_std}
        if case.session:
            self.session().to_csv(folder / "cells.csv", index=False)
            calibration = {"files": ["cells.csv"]}
        table = {
            "log": "loadcells.csv",
            "empty": [f"empty/{k}.csv" for k in range(case.empty_runs)],
            "compensation": case.compensation,
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

        Noise of a sample, and for the force the scatter of friction about the mean of the empty runs.
        """
        per_Nm = 1000.0 / self.case.spacing_mm
        friction = self.case.friction_N * self.case.scatter * np.sqrt(1 + 1 / self.case.empty_runs)
        upper, lower = moments(self.force[known], SAND_ARM_MM, self.case.spacing_mm, LOWER_MM)
        slopes = np.stack([lower, -upper]) * self.case.spacing_mm / (upper - lower) ** 2
        arm = np.sqrt(np.mean((slopes**2 * self.noise[:, None] ** 2).sum(axis=0))) if known.any() else np.nan
        return float(np.hypot(per_Nm * np.hypot(*self.noise), friction)), float(arm)


class Accuracy(NamedTuple):
    """Errors, coverage and time of one case over seeds; NaN where there is none."""

    rows: int
    force_rms_percent: float
    force_bound_percent: float
    arm_rms_mm: float
    arm_bound_mm: float
    force_coverage_percent: float
    arm_coverage_percent: float
    coverage_std_percent: float
    cpu_s: float
    wall_s: float


def accuracy(case, seeds, folder):
    """Errors and coverage over seeds, medians of the times of a record."""
    force_squares, arm_squares, force_inside, arm_inside, seconds = [], [], [], [], []
    for seed in range(seeds):
        rig = Rig(case, np.random.default_rng(seed))
        scene = rig.write(Path(folder))
        wall, cpu = time.perf_counter(), time.process_time()
        found = measure_force(scene).record[rig.moving]
        seconds.append((time.process_time() - cpu, time.perf_counter() - wall))
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
    return Accuracy(
        rig.t.size,
        100 * np.sqrt(np.mean(force_squares)) / mean,
        100 * force_bound / mean,
        np.sqrt(np.mean(arm_squares)) if arm_squares else np.nan,
        arm_bound,
        100 * np.mean(force_inside),
        100 * np.mean(arm_inside) if arm_inside else np.nan,
        100 * np.std(force_inside) / np.sqrt(seeds),
        *np.median(seconds, axis=0),
    )
