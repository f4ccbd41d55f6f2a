"""Speed against error of the incremental-collapse model, and the figures it has to reach.

A tolerance sets the increment. force_history() marches once with it, as with any fixed increment; simulate()
marches with twice that too, states the difference as its error, and halves the increment while that is too
large (in none of these sands). model-settings.csv holds one sand by every setting, and the paper's own search
over the nodes of the surface.
"""

import argparse
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from model_study.costs import OTHER_METHODS_S, seconds
from model_study.settings import SETTING_COLUMNS, setting_rows
from ploughval.model import force_history, simulate, simulate_many
from ploughval.model.mechanism import initial_force
from ploughval.scene import Scene
from speed_error.tables import write_rows

TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
DEFAULT = 1e-3
FINEST = 1e-5  # the limit: first order, so the default tolerance's error is known to one per cent of itself
TRAVEL_DEPTHS = 3.5
DEPTH_MM = 30.0
MANY = 1000
SOILS = {
    "50/32": {},
    "50/32 repose 50": {"repose_deg": 50.0},
    "50/32 wall 10": {"wall_friction_deg": 10.0},
    "36/32": {"peak_friction_deg": 36.0},
    "35/35 creeping": {"peak_friction_deg": 35.0, "residual_friction_deg": 35.0},
}
# Switches of two other solutions of the same equations, extrapolated in step and node spacing: u / d and
# P / P0, good to 0.002 and 0.001 and printed to half a unit of the third decimal.
SOLVED_ELSEWHERE = {
    "50/32": ((1.290, 1.790), (3.270, 2.792)),
    "50/32 repose 50": ((1.240, 1.763), (3.159, 2.739)),
    "50/32 wall 10": ((1.882, 1.828),),
    "36/32": ((0.391, 1.353), (0.953, 1.781), (1.702, 2.288), (2.647, 2.875)),
}
COLUMNS = (
    "soil",
    "tolerance",
    "increment_d",
    "increments",
    "force_ms",
    "simulate_ms",
    "switches",
    "switch_error_pct",
    "peak_error_pct",
    "force_rms_pct",
    "stated_pct",
)


class Run(NamedTuple):
    """What every way of running the model gives."""

    u_mm: np.ndarray
    force_N: np.ndarray
    band: np.ndarray


class Figure(NamedTuple):
    """One measured figure and the limit it has to keep."""

    what: str
    value: float
    limit: float | None

    @property
    def verdict(self) -> str:
        """Whether the limit is kept."""
        return "" if self.limit is None else "kept" if self.value <= self.limit else "MISSED"


def scene_of(soil: dict[str, float], **blade: float) -> Scene:
    """The reference scene with some soil parameters changed."""
    settings = {
        "peak_friction_deg": 50.0,
        "residual_friction_deg": 32.0,
        "mobilization_length_mm": 1.0,
        **soil,
    }
    return Scene.model_validate(
        {
            "test": {"name": "bench"},
            "blade": {"depth_mm": DEPTH_MM, "width_mm": 1000.0, **blade},
            "soil": {"unit_weight_kN_m3": 16.0, **settings},
        }
    )


def switches(run: Run) -> np.ndarray:
    """Displacement and force at every switch (S, 2)."""
    rows = np.flatnonzero(np.diff(run.band) > 0) + 1
    return np.column_stack([run.u_mm[rows], run.force_N[rows]])


def errors(run: Run, limit: Run) -> tuple[float, float, float]:
    """Greatest relative errors of switches in place and force, and rms of the force elsewhere, per cent."""
    found, exact = switches(run), switches(limit)
    count = min(len(found), len(exact))
    jumps = np.abs(found[:count] / exact[:count] - 1.0).max(axis=0, initial=0.0)
    u = np.linspace(0.05 * DEPTH_MM, limit.u_mm[-1], 4001)
    exact_N = np.interp(u, limit.u_mm, limit.force_N)
    gap = np.interp(u, run.u_mm, run.force_N) / exact_N - 1.0
    near = np.abs(u[:, None] - np.r_[found[:, 0], exact[:, 0]]).min(axis=1, initial=np.inf)
    rms = np.sqrt(np.mean(gap[near > 0.1 * DEPTH_MM] ** 2))
    return 100.0 * float(jumps[0]), 100.0 * float(jumps[1]), 100.0 * float(rms)


def row_of(name: str, tolerance: float, limit: Run) -> dict[str, object]:
    """One line of the table: cost and error of one tolerance."""
    scene, travel = scene_of(SOILS[name]), TRAVEL_DEPTHS * DEPTH_MM
    options = {"displacement_mm": travel, "tolerance": tolerance}
    history = simulate(scene, **options)
    rows = history.marched.rows
    run = Run(rows[:, 0], history.force["force_N"].to_numpy(), rows[:, 6])
    values = (
        name,
        tolerance,
        rows[:, 1].max() / DEPTH_MM,
        len(rows) - 1,
        1e3 * seconds(lambda: force_history(scene, **options)),
        1e3 * seconds(lambda: simulate(scene, **options)),
        f"{len(switches(run))}/{len(switches(limit))}",
        *errors(run, limit),
        100.0 * history.force_std_N / run.force_N.max(),
    )
    cells = (f"{v:.3g}" if isinstance(v, float) else v for v in values)
    return dict(zip(COLUMNS, cells, strict=True))


def accuracy_figures(limits: dict[str, Run]) -> list[Figure]:
    """Errors at the default tolerance: against the limit, other solutions and closed forms."""
    travel = TRAVEL_DEPTHS * DEPTH_MM
    default = {name: force_history(scene_of(soil), displacement_mm=travel) for name, soil in SOILS.items()}
    worst = np.array([errors(Run(*default[name]), limit) for name, limit in limits.items()]).max(axis=0)
    start = gap_u = gap_P = 0.0
    for name, soil in SOILS.items():
        made = scene_of(soil).soil
        P0 = 1e3 * initial_force(DEPTH_MM, 16e-6, made.peak_friction_deg, made.wall_friction_deg)
        start = max(start, abs(default[name].force_N[0] / P0 - 1.0))
        other = np.array(SOLVED_ELSEWHERE.get(name, ())).reshape(-1, 2)
        gap = np.abs(switches(limits[name])[: len(other)] / [DEPTH_MM, P0] - other)
        gap_u, gap_P = max(gap_u, gap[:, 0].max(initial=0.0)), max(gap_P, gap[:, 1].max(initial=0.0))
    return [
        Figure("switch places at the default tolerance, greatest error, %", worst[0], 0.2),
        Figure("force at the switches, greatest error, %", worst[1], 0.1),
        Figure("force elsewhere, greatest rms error, %", worst[2], 0.1),
        Figure("P0, greatest relative error", start, 1e-9),
        Figure("limit against other solutions, switch places, d", gap_u, 0.0025),
        Figure("limit against other solutions, force, P0", gap_P, 0.0015),
    ]


def growth(scene: Scene) -> float:
    """Power of the travel with which the CPU time of a run grows, from the least time of each travel."""
    travels = DEPTH_MM * np.array([3.0, 6.0, 12.0, 24.0])
    rounds = []
    for _ in range(15):
        times = []
        for travel in travels.tolist():
            start = time.thread_time()
            force_history(scene, displacement_mm=travel)
            times.append(time.thread_time() - start)
        rounds.append(times)
    return float(np.polyfit(np.log(travels), np.log(np.min(rounds, axis=0)), 1)[0])


def speed_figures() -> list[Figure]:
    """Time of one run, of many, its growth with the travel, and the ratio to other methods."""
    scene = scene_of({})
    one = seconds(lambda: force_history(scene, displacement_mm=3.0 * DEPTH_MM), 21)
    whole = seconds(lambda: simulate(scene, displacement_mm=3.0 * DEPTH_MM), 21)
    figures = [
        Figure("one force history to u = 3 d, ms", 1e3 * one, 2.0),
        Figure("one simulate() to u = 3 d, surfaces and error estimate included, ms", 1e3 * whole, None),
    ]
    draw = np.random.default_rng(1).uniform([38.0, 28.0, 15.0], [50.0, 36.0, 17.0], (MANY, 3))
    names = ("peak_friction_deg", "residual_friction_deg", "unit_weight_kN_m3")
    scenes = [scene_of(dict(zip(names, row, strict=True))) for row in draw.tolist()]
    for workers in (1, 2):
        many = seconds(lambda w=workers: simulate_many(scenes, displacement_mm=3.0 * DEPTH_MM, workers=w), 3)
        label = f"{MANY} runs to u = 3 d, {workers} thread{'s' if workers > 1 else ''}, s"
        figures.append(Figure(label, many, 2.0))
    for name in ("50/32", "36/32", "35/35 creeping"):
        label = f"{name}: time grows as travel to the power (3 to 24 d)"
        figures.append(Figure(label, growth(scene_of(SOILS[name])), 1.1))
    lab = seconds(lambda: simulate(scene, displacement_mm=50.0), 21)
    figures.append(Figure("one simulate() to u = 50 mm, ms", 1e3 * lab, None))
    for name, cpu_s in OTHER_METHODS_S.items():
        figures.append(Figure(f"... times faster than {name} ({cpu_s:g} s)", cpu_s / lab, None))
    return figures


def main(arguments: list[str] | None = None) -> Path:
    """Print the tables and write them as CSV; returns the folder's first file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"), help="folder of the table")
    parser.add_argument("--settings", action="store_true", help="model-settings.csv alone")
    parser.add_argument("--quick", action="store_true", help="without the slow searches over nodes")
    options = parser.parse_args(arguments)
    out = options.out
    out.mkdir(parents=True, exist_ok=True)
    rows = setting_rows(quick=options.quick)
    for row in rows:
        print("  ".join(f"{cell!s:>16}" for cell in row.values()))
    write_rows(out / "model-settings.csv", SETTING_COLUMNS, rows)
    if options.settings:
        return out / "model-settings.csv"
    travel = TRAVEL_DEPTHS * DEPTH_MM
    limits = {
        name: Run(*force_history(scene_of(soil), displacement_mm=travel, tolerance=FINEST))
        for name, soil in SOILS.items()
    }
    print("  ".join(f"{column:>16}" for column in COLUMNS))
    table = []
    for name in SOILS:
        for tolerance in TOLERANCES:
            table.append(row_of(name, tolerance, limits[name]))
            print("  ".join(f"{cell!s:>16}" for cell in table[-1].values()))
    figures = accuracy_figures(limits) + speed_figures()
    summary = [
        {
            "what": f.what,
            "value": f"{f.value:.3g}",
            "limit": "" if f.limit is None else f"{f.limit:g}",
            "verdict": f.verdict,
        }
        for f in figures
    ]
    print()
    for line in summary:
        print(f"{line['what']:<72}{line['value']:>10}{line['limit']:>9}  {line['verdict']}")
    write_rows(out / "model.csv", COLUMNS, table)
    write_rows(out / "model-figures.csv", ("what", "value", "limit", "verdict"), summary)
    return out / "model.csv"


if __name__ == "__main__":
    main()
