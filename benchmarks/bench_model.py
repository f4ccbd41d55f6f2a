"""Speed against error of the incremental-collapse model: time, switches and forces against the tolerance."""

import argparse
import csv
import time
from pathlib import Path

import numpy as np

from ploughval.model import force_history, simulate
from ploughval.scene import Scene

TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
FINEST = 1e-5
REPEATS = 7
TRAVEL_DEPTHS = 3.5
DEPTH_MM = 30.0
SOILS = {
    "50/32": {},
    "50/32 repose 50": {"repose_deg": 50.0},
    "50/32 wall 10": {"wall_friction_deg": 10.0},
    "36/32": {"peak_friction_deg": 36.0},
    "35/35 creeping": {"peak_friction_deg": 35.0, "residual_friction_deg": 35.0},
}
COLUMNS = (
    "soil",
    "tolerance",
    "increments",
    "force_ms",
    "simulate_ms",
    "switches",
    "switch_error_d",
    "peak_error_P0",
    "force_rms_P0",
    "stated_std_P0",
)


def scene_of(soil: dict[str, float]) -> Scene:
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
            "blade": {"depth_mm": DEPTH_MM, "width_mm": 1000.0},
            "soil": {"unit_weight_kN_m3": 16.0, **settings},
        }
    )


def seconds(run) -> float:
    """Median time of a call that has been compiled."""
    run()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def switches(history) -> np.ndarray:
    """Displacement and force at every switch (S, 2)."""
    places = history.bands["u_start_mm"].to_numpy()[1:]
    rows = np.searchsorted(history.force["u_mm"], places)
    return np.column_stack([places, history.force["force_N"].to_numpy()[rows]])


def row_of(name: str, scene: Scene, tolerance: float, finest) -> dict[str, object]:
    """One line of the table: cost and error of one tolerance."""
    travel = TRAVEL_DEPTHS * DEPTH_MM
    options = {"displacement_mm": travel, "tolerance": tolerance}
    history = simulate(scene, **options)
    found, exact = switches(history), switches(finest)
    count = min(len(found), len(exact))
    error = np.abs(found[:count] - exact[:count]).max(axis=0, initial=0.0)
    u = np.linspace(0.05 * DEPTH_MM, travel, 4001)
    gap = np.interp(u, history.force["u_mm"], history.force["force_N"])
    gap -= np.interp(u, finest.force["u_mm"], finest.force["force_N"])
    near = np.abs(u[:, None] - np.r_[found[:, 0], exact[:, 0]]).min(axis=1, initial=np.inf)
    rms = np.sqrt(np.mean(gap[near > 0.1 * DEPTH_MM] ** 2))
    return {
        "soil": name,
        "tolerance": tolerance,
        "increments": len(history.increments),
        "force_ms": round(1e3 * seconds(lambda: force_history(scene, **options)), 3),
        "simulate_ms": round(1e3 * seconds(lambda: simulate(scene, **options)), 3),
        "switches": f"{len(found)}/{len(exact)}",
        "switch_error_d": float(f"{error[0] / DEPTH_MM:.3g}"),
        "peak_error_P0": float(f"{error[1] / history.P0_N:.3g}"),
        "force_rms_P0": float(f"{rms / history.P0_N:.3g}"),
        "stated_std_P0": float(f"{history.force_std_N / history.P0_N:.3g}"),
    }


def main(arguments: list[str] | None = None) -> Path:
    """Print the table and write it as CSV; returns the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"), help="folder of the table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)
    path = out / "model.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        print("  ".join(f"{column:>14}" for column in COLUMNS))
        for name, soil in SOILS.items():
            scene = scene_of(soil)
            finest = simulate(scene, displacement_mm=TRAVEL_DEPTHS * DEPTH_MM, tolerance=FINEST)
            for tolerance in TOLERANCES:
                row = row_of(name, scene, tolerance, finest)
                writer.writerow(row)
                print("  ".join(f"{row[column]!s:>14}" for column in COLUMNS))
    return path


if __name__ == "__main__":
    main()
