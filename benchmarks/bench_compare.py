"""Comparison: error and time against the number of draws, and what alignment leaves of known errors.

python benchmarks/bench_compare.py --out reports/speed-error
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numba import njit

from ploughval.compare import compare_test
from ploughval.compare.ensemble import draw_ensemble
from ploughval.compare.force.alignment import aligned_u
from ploughval.compare.force.curve import model_curve
from ploughval.compare.force.reading import read_force
from ploughval.compare.force.scalars import force_quantities
from ploughval.model import History, simulate
from ploughval.scene import Blade, Scene, Soil, TestTable
from speed_error.timing import timed

COUNTS = (16, 32, 64, 128, 256)
REFERENCE = 2048
SEEDS = range(12)
ROUNDS = 3
NAMES = (
    "first_peak_N", "first_trough_N", "first_switch_u_mm", "first_switch_N", "first_switch_drop_N",
    "force_mean_N", "peak_spacing_mm", "first_switch_P0",
)  # fmt: skip
TRAVEL_MM = 90.0
BAND_DEPTHS = (0.1, 0.25, 0.5)


def scene(draws: int = 64) -> Scene:
    """Sand as in the paper with the uncertainties that a laboratory states."""
    soil = Soil(
        unit_weight_kN_m3=16.0, peak_friction_deg=45.0, residual_friction_deg=32.0,
        mobilization_length_mm=1.0,
        unit_weight_std_kN_m3=0.2, peak_friction_std_deg=1.0, residual_friction_std_deg=0.7,
        mobilization_length_std_mm=0.3, wall_friction_std_deg=1.0,
    )  # fmt: skip
    blade = Blade(depth_mm=30.0, width_mm=218.0, depth_std_mm=0.3)
    one = Scene(test=TestTable(name="bench"), blade=blade, soil=soil)
    return one.model_copy(update={"compare": one.compare.model_copy(update={"draws": draws})})


def main(arguments: Sequence[str] | None = None) -> None:
    """Write compare.csv and alignment.csv into --out and print both."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--quick", action="store_true", help="few draws, two seeds")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    draws = draws_table(COUNTS[:3], range(2), 256) if options.quick else draws_table()
    for name, table in (("compare", draws), ("alignment", alignment_table())):
        print(table.to_string(index=False, float_format=lambda v: f"{v:.3g}"))
        table.to_csv(options.out / f"{name}.csv", index=False, float_format="%.4g")


def draws_table(
    counts: Sequence[int] = COUNTS, seeds: Sequence[int] = SEEDS, most: int = REFERENCE
) -> pd.DataFrame:
    """Error of the input uncertainty, against ``most`` draws, and time of a comparison of the force."""
    base = scene()
    history = simulate(base, displacement_mm=TRAVEL_MM)
    reference = _stds(base, history, most, seed=10_000)
    rows = []
    for count in counts:
        errors = []
        for seed in seeds:
            found = _stds(base, history, count, seed=seed)
            errors.append([found[name] / reference[name] - 1 for name in NAMES])
        size = np.abs(np.array(errors))
        one, record = scene(count), _record(history)
        if not rows:
            compare_test(one, history, force=record, bands=None, layers=None, surface=None)  # compiles
        _, seconds = timed(
            lambda one=one, record=record: compare_test(
                one, history, force=record, bands=None, layers=None, surface=None
            ),
            ROUNDS,
        )
        rows.append((count, 100 * np.sqrt(np.mean(size**2)), 100 * np.percentile(size, 95), *seconds))
    return pd.DataFrame(
        rows, columns=["draws", "rms_error_percent", "p95_error_percent", "force_comparison_s", "clock_s"]
    )


def _stds(base: Scene, history: History, count: int, *, seed: int) -> dict[str, float]:
    def values(one: History) -> Mapping[str, float]:
        curve = model_curve(one.force, one.force_std_N, one.horizontal_share).until(TRAVEL_MM)
        reading = read_force(curve, 0.1 * history.P0_N, 30.0, weak_N=0.02 * history.P0_N)
        found = force_quantities(reading, 30.0, limit_mm=TRAVEL_MM)
        return {name: found[name].value for name in NAMES}

    ensemble = draw_ensemble(base, history, TRAVEL_MM, count=count, seed=seed)
    return {name: spread.std for name, spread in ensemble.spread(values).items()}


def _record(history: History) -> pd.DataFrame:
    """A force record of 100 rows a mm, without noise."""
    u = np.arange(0.0, TRAVEL_MM, 0.01)
    force = np.interp(u, history.force["u_mm"], history.force["force_N"])
    return pd.DataFrame({"u_mm": u, "force_N": force, "force_std_N": 0.05})


def alignment_table() -> pd.DataFrame:
    """Rms difference that is left of known errors: as it is, at landmarks, by time warping in bands; P0."""
    history = simulate(scene(), displacement_mm=TRAVEL_MM)
    u = np.linspace(0.0, 60.0, 601)
    places = history.bands["u_start_mm"].to_numpy()[1:]
    P0, rng = history.P0_N, np.random.default_rng(0)

    def force(at: np.ndarray) -> np.ndarray:
        return np.interp(at, history.force["u_mm"], history.force["force_N"]) / P0

    cases = {
        "stretched by 10 %": (force(u), force(u / 1.1), 1.1, 0.0),
        "higher by 10 %": (force(u), 1.1 * force(u), 1.0, _rms(0.1 * force(u))),
        "both": (force(u), 1.1 * force(u / 1.1), 1.1, _rms(0.1 * force(u))),
        "noise of 0.05 P0": (force(u), force(u) + rng.normal(0, 0.05, u.size), 1.0, 0.05),
    }
    rows = []
    for name, (measured, model, stretch, left) in cases.items():
        mine = places[places < 60.0 / stretch]
        same = aligned_u(u, mine, mine * stretch)
        inside = same <= u[-1]
        landmarks = np.interp(same, u, model)[inside] - measured[inside]
        warped = [warped_rms(measured, model, int(band * 30.0 / 0.1)) for band in BAND_DEPTHS]
        rows.append((name, left, _rms(model - measured), _rms(landmarks), *warped))
    columns = ["case", "in_height", "as_it_is", "landmarks", *(f"warped_{band:g}_d" for band in BAND_DEPTHS)]
    return pd.DataFrame(rows, columns=columns)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@njit(cache=True, nogil=True)
def _least_cost(first: np.ndarray, second: np.ndarray, band: int) -> tuple[float, int]:
    """Sum of squares along the cheapest path (Sakoe & Chiba 1978) and its length."""
    n = first.size
    cost = np.full((n + 1, n + 1), np.inf)
    steps = np.zeros((n + 1, n + 1), np.int64)
    cost[0, 0] = 0.0
    for i in range(1, n + 1):
        for j in range(max(1, i - band), min(n, i + band) + 1):
            a, b = i - 1, j - 1
            if cost[i - 1, j] < cost[a, b]:
                a, b = i - 1, j
            if cost[i, j - 1] < cost[a, b]:
                a, b = i, j - 1
            cost[i, j] = cost[a, b] + (first[i - 1] - second[j - 1]) ** 2
            steps[i, j] = steps[a, b] + 1
    return cost[n, n], steps[n, n]


def warped_rms(first: np.ndarray, second: np.ndarray, band: int) -> float:
    """Rms difference along the path of dynamic time warping within a band of points."""
    cost, length = _least_cost(first, second, band)
    return float(np.sqrt(cost / length))


if __name__ == "__main__":
    main()
