"""The fit on the paper's parameters and on other physics, beside direct shear tests of the same sand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from fit_study.records import FINE, Made, paper_soil, scene_of, virtual_record
from ploughval.model import force_history
from ploughval.model.fit import Discrepancy, SharedErrors, fit_soil

# Lehane and Liu (2012), direct shear of the paper's sand at about 4 kPa, quoted by the paper
SHEAR_BOX = {"peak_friction_deg": (50.0, 50.0), "residual_friction_deg": (32.0, 33.0)}
TRAVEL_MM, ROWS = 80.0, 400
NOISE, OFFSET, GAIN = 0.015, 0.03, 0.01  # shares of the mean force
DEPTH_STD_MM = 0.2
FIRST_TOOTH_MM = 24.0  # of the material-point run, before its band changes
SEEDS = (1, 2, 3)


def paper_record(seed: int) -> Made:
    """The paper's soil as a laboratory would log it: noise, friction and gain in error as they are told."""
    truth, rng = paper_soil(), np.random.default_rng(seed)
    history = force_history(scene_of(truth), displacement_mm=1.1 * TRAVEL_MM, tolerance=FINE)
    u = np.linspace(0.0, TRAVEL_MM, ROWS)
    force = np.interp(u, history.u_mm, history.force_N)
    return logged(Made(u, force, 0.0, _told(truth, {}), SharedErrors(), Discrepancy(), truth), rng)


def logged(made: Made, rng: np.random.Generator) -> Made:
    """A force with what a rig adds."""
    mean = float(made.force_N.mean())
    force = made.force_N * (1.0 + GAIN * rng.standard_normal()) + OFFSET * mean * rng.standard_normal()
    force = force + NOISE * mean * rng.standard_normal(len(force))
    noise = float(np.hypot(made.noise_std_N, NOISE * mean))
    return replace(made, force_N=force, noise_std_N=noise, shared=SharedErrors(OFFSET * mean, GAIN))


def _told(truth: dict[str, float], rules: dict[str, str]):
    told = {**truth, "peak_friction_deg": 45.0, "residual_friction_deg": 30.0, "mobilization_length_mm": 2.0}
    return scene_of(told, 30.0, DEPTH_STD_MM, **rules)


def records() -> list[tuple[str, Made]]:
    """Names and records of the example."""
    found = [(f"paper's soil, made record {seed}", paper_record(seed)) for seed in SEEDS]
    for rule in ("least_force", "least_softened"):
        virtual = virtual_record(rule)
        if virtual is None:
            continue
        run = replace(virtual[0], scene=_told(virtual[0].truth, {"direction": rule}))
        found.append((f"material points, {rule}", run))
        found.append((f"material points as logged, {rule}", logged(run, np.random.default_rng(4))))
        first = run.u_mm <= FIRST_TOOTH_MM
        short = replace(run, u_mm=run.u_mm[first], force_N=run.force_N[first])
        found.append((f"material points, first tooth, {rule}", short))
    return found


def example(out: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Fit every record: intervals (example.csv too), and rows of all records beside their best fits."""
    rows, curves = [], []
    for name, made in records():
        fit = fit_soil(
            made.u_mm, made.force_N, made.noise_std_N, made.scene,
            shared=made.shared, discrepancy=made.discrepancy,
        )  # fmt: skip
        curves.append(fit.curve.assign(record=name))
        for k, parameter in enumerate(fit.parameters):
            rows.append(
                {
                    "record": name,
                    "parameter": parameter,
                    "true": made.truth[parameter],
                    "value": fit.values[k],
                    "low_68": fit.interval_68[k, 0],
                    "high_68": fit.interval_68[k, 1],
                    "low_95": fit.interval_95[k, 0],
                    "high_95": fit.interval_95[k, 1],
                    "travel_std": fit.discrepancy.travel,
                    "force_std": fit.discrepancy.force,
                    "independent_rows": fit.misfit.independent,
                    "rms_N": fit.residual_rms_N,
                    "message": fit.message,
                }
            )
        print(f"{name}\n{fit}\n", flush=True)
    table = pd.DataFrame(rows)
    table.to_csv(out / "example.csv", index=False, float_format="%.4g")
    return table, pd.concat(curves)


def rankine(out: Path) -> pd.DataFrame:
    """Friction from single forces of the material-point run, by Rankine's passive force in level sand."""
    virtual = virtual_record("least_force")
    if virtual is None:
        return pd.DataFrame()
    K = virtual[1]["P_front_over_half_gamma_d2"].to_numpy()
    u = 1e3 * virtual[1]["u_m"].to_numpy()
    smooth = np.array([K[np.abs(u - place) <= 0.25].mean() for place in u])
    first, early = K[u < 2.0].max(), smooth[(u > 1.0) & (u < 5.0)].min()
    rows = [
        {"force": "first peak", "K": first, "friction_deg": _friction(first), "true_deg": 50.0},
        {"force": "first trough", "K": early, "friction_deg": _friction(early), "true_deg": 32.0},
    ]
    table = pd.DataFrame(rows)
    table.to_csv(out / "example-rankine.csv", index=False, float_format="%.4g")
    return table


def _friction(K: float) -> float:
    """Friction angle of Rankine's K = tan^2(45 + phi / 2), degrees."""
    return float(2.0 * np.degrees(np.arctan(np.sqrt(K))) - 90.0)
