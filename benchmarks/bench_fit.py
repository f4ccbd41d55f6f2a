"""Speed and error of the fit: seconds on one core against rows and parameters, distance from the truth.

fit.csv holds single records that the model describes; fit-settings.csv, by setting, records that it does not
quite describe.
"""

import argparse
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fit_study.settings import SETTING_COLUMNS, setting_rows
from ploughval.model import force_history
from ploughval.model.fit import PARAMETERS, Discrepancy, Extras, SharedErrors, SoilFit, fit_soil
from ploughval.scene import Scene
from speed_error.tables import write_rows

LIMIT_S = 20.0  # CPU of one fit, intervals and maps included
TRUTH = {
    "unit_weight_kN_m3": 15.7,
    "peak_friction_deg": 50.0,
    "residual_friction_deg": 32.0,
    "mobilization_length_mm": 1.0,
    "wall_friction_deg": 5.0,
}
TOLD = {**TRUTH, "peak_friction_deg": 44.0, "residual_friction_deg": 30.0, "mobilization_length_mm": 3.0}
DEPTH_MM, TRAVEL_MM, NOISE = 30.0, 90.0, 0.01
OFFSET_SHARE, GAIN = 0.02, 0.01  # standard uncertainties told; none is in the record
SEED = 11


class Case(NamedTuple):
    """What is fitted to how many rows."""

    name: str
    rows: int
    parameters: tuple[str, ...]
    discrepancy: Discrepancy
    extras: Extras


CASES = (
    Case("3 parameters, model right", 300, PARAMETERS, Discrepancy(0.0, 0.0), Extras()),
    Case("3 parameters", 300, PARAMETERS, Discrepancy(), Extras()),
    Case("3 parameters, with maps", 1000, PARAMETERS, Discrepancy(), Extras(maps=True)),
    Case("3 parameters, with maps", 3000, PARAMETERS, Discrepancy(), Extras(maps=True)),
    Case(
        "4 parameters (wall friction), with maps",
        1000,
        (*PARAMETERS, "wall_friction_deg"),
        Discrepancy(),
        Extras(maps=True),
    ),
)
COLUMNS = (
    "case",
    "rows",
    "parameter",
    "true",
    "value",
    "low_95",
    "high_95",
    "holds",
    "cpu_s",
    "wall_s",
    "verdict",
)


def scene_of(soil: dict[str, float]) -> Scene:
    """Level sand, a depth of 30 mm known to 0.1 mm."""
    blade = {"depth_mm": DEPTH_MM, "width_mm": 218.0, "depth_std_mm": 0.1}
    return Scene.model_validate({"test": {"name": "bench"}, "blade": blade, "soil": soil})


def record(rows: int) -> tuple[np.ndarray, np.ndarray, float]:
    """The true soil's horizontal force with noise of 1 %."""
    scene = scene_of(TRUTH)
    history = force_history(scene, displacement_mm=1.05 * TRAVEL_MM, tolerance=1e-5)
    u = np.linspace(0.0, TRAVEL_MM, rows)
    share = np.cos(np.radians(TRUTH["wall_friction_deg"]))
    force = share * np.interp(u, history.u_mm, history.force_N)
    noise = NOISE * float(force.mean())
    return u, force + noise * np.random.default_rng(SEED).standard_normal(rows), noise


def run(case: Case) -> tuple[SoilFit, float, float]:
    """A fit, its CPU and its wall seconds."""
    u, force, noise = record(case.rows)
    shared = SharedErrors(OFFSET_SHARE * float(force.mean()), GAIN)
    wall, cpu = time.perf_counter(), time.process_time()
    fit = fit_soil(
        u, force, noise, scene_of(TOLD), parameters=case.parameters,
        shared=shared, discrepancy=case.discrepancy, extras=case.extras,
    )  # fmt: skip
    return fit, time.process_time() - cpu, time.perf_counter() - wall


def rows_of(case: Case) -> list[dict[str, object]]:
    """A row for each parameter of a case."""
    fit, cpu, wall = run(case)
    rows: list[dict[str, object]] = []
    for k, name in enumerate(fit.parameters):
        low, high = fit.interval_95[k]
        holds = low <= TRUTH[name] <= high
        values = (
            case.name, case.rows, name, TRUTH[name], f"{fit.values[k]:.4g}", f"{low:.4g}", f"{high:.4g}",
            holds, f"{cpu:.2f}", f"{wall:.2f}", "reached" if cpu <= LIMIT_S else "MISSED",
        )  # fmt: skip
        rows.append(dict(zip(COLUMNS, values, strict=True)))
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables and write fit.csv and fit-settings.csv."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"), help="folder of the tables")
    parser.add_argument("--cases", action="store_true", help="fit.csv alone")
    parser.add_argument("--settings", action="store_true", help="fit-settings.csv alone")
    parser.add_argument("--quick", action="store_true", help="one case, one record, fewer settings")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    run(CASES[0]._replace(parameters=("unit_weight_kN_m3",)))  # compiles
    table = []
    for case in () if options.settings else CASES[: 1 if options.quick else None]:
        table += rows_of(case)
        for row in table[-len(case.parameters) :]:
            print("  ".join(f"{cell!s:>12}" for cell in row.values()), flush=True)
    if table:
        write_rows(options.out / "fit.csv", COLUMNS, table)
    if not options.cases:
        write_rows(options.out / "fit-settings.csv", SETTING_COLUMNS, setting_rows(quick=options.quick))


if __name__ == "__main__":
    main()
