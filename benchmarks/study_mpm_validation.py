"""A material-point run treated as an experiment: what the whole chain says of the model, under both rules.

python benchmarks/study_mpm_validation.py --virtual ../shared/virtual --out reports/mpm-validation
"""

import argparse
import json
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from model_study.virtual import davis, measured, mobilised, run_soil
from ploughval import process
from ploughval.scene import load_scene
from virtual.experiment import make_experiment, read_force, state_direction
from virtual.photographs import PARTS, read_run
from virtual.validation_figures import draw_histories, draw_layers, draw_verdicts

RULES = ("least_force", "least_softened")
LARGEST_PAGE = 2_000_000  # bytes; a larger one is not kept
_START_MM = 2.0  # the run's first peak lies before this travel
_SEATED_MM = 0.05  # of travel at either end that are left out where rows are compared
_SIDES = ("model", "input_std", "numerical_std", "error", "validation_std", "agrees", "dominant_input")


def main(arguments: Sequence[str] | None = None) -> None:
    """Make, process under both rules, compare; write tables, figures and the page into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--virtual", type=Path, default=Path("../shared/virtual"))
    parser.add_argument("--out", type=Path, default=Path("reports/mpm-validation"))
    parser.add_argument("--folder", type=Path, help="where the test folder is kept and found again")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "virtual" if options.folder is None else options.folder
        if not (folder / "test.toml").is_file():
            make_experiment(folder, read_run(options.virtual).between(PARTS), read_force(options.virtual))
        results = {rule: processed(folder, rule) for rule in RULES}
        metrics = metric_table({rule: read_metrics(place) for rule, place in results.items()})
        own = own_table(options.virtual, load_scene(folder).blade.width_mm, results["least_force"])
        draw_histories(options.virtual, results, options.out / "histories.png")
        draw_verdicts(metrics, RULES, options.out / "verdicts.png")
        draw_layers(folder, results, options.out / "layers.png")
        page = results["least_force"] / "report.html"
        print(f"page: {page.stat().st_size / 1e6:.2f} MB")
        if page.stat().st_size < LARGEST_PAGE:
            shutil.copy(page, options.out / "report.html")
    print(own.to_string(index=False, float_format=lambda v: f"{v:.4g}"))
    print(metrics.to_string(float_format=lambda v: f"{v:.4g}"))
    for rule in RULES:
        said = metrics[f"{rule} agrees"].dropna().astype(bool)
        print(f"{rule}: {said.sum()} of {len(said)} verdicts say that the model agrees")
    own.to_csv(options.out / "measured.csv", float_format="%.4g", index=False)
    metrics.to_csv(options.out / "metrics.csv", float_format="%.4g", index_label="metric")


def processed(folder: Path, rule: str) -> Path:
    """Results of the folder under a rule for the direction of a fresh band; photographs are followed once."""
    state_direction(folder, rule)
    results, first = (folder / f"results-{name}" for name in (rule, RULES[0]))
    if not results.exists() and (first / ".store").is_dir():
        shutil.copytree(first / ".store", results / ".store")
    done = process(folder, out=results, workers=2)
    print(f"{rule}: complete: {done.complete}, {done.seconds:.0f} s")
    print("\n".join((*done.faults, *done.warnings)))
    return done.results


def read_metrics(results: Path) -> Mapping[str, Mapping[str, Any]]:
    """The metrics of a result folder, by name."""
    return json.loads((results / "metrics.json").read_text(encoding="utf-8"))["metrics"]


def metric_table(rules: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> pd.DataFrame:
    """A row a metric: the experiment once, the model's side and the verdict under every rule."""
    names = list(dict.fromkeys(name for metrics in rules.values() for name in metrics))
    rows = {}
    for name in names:
        sides = {rule: metrics.get(name, {}) for rule, metrics in rules.items()}
        first = next(side for side in sides.values() if side)
        row = {key: first[key] for key in ("unit", "experiment", "experiment_std")}
        row |= {f"{rule} {key}": side.get(key) for rule, side in sides.items() for key in _SIDES}
        rows[name] = row
    return pd.DataFrame.from_dict(rows, orient="index")


def own_table(virtual: Path, width_mm: float, results: Path) -> pd.DataFrame:
    """What cells and photographs say, with its standard uncertainty, beside what the run itself says."""
    _, read = measured(virtual)
    u_mm, per_metre = read_force(virtual)
    metrics = read_metrics(results)
    force = pd.read_csv(results / "force.csv")
    moving = force["u_mm"].between(_SEATED_MM, u_mm[-1] - _SEATED_MM).to_numpy()
    newton = per_metre * width_mm / 1e3
    off = (force["force_N"] - np.interp(force["u_mm"], u_mm, newton))[moving]
    within = off.abs() <= 2 * force["force_std_N"][moving]
    to_N = float(np.max(newton[u_mm < _START_MM])) / read["first_peak_K"]
    rows = [
        _row(
            "force, mean over the travel, N",
            metrics.get("force_mean_N"),
            float(np.trapezoid(newton, u_mm) / np.ptp(u_mm)),
        ),
        ("force rows within two std, %", 100 * float(within.mean()), None, float("nan")),
        _row("first peak, N", metrics.get("first_peak_N"), to_N * read["first_peak_K"]),
        _row("first trough, N", metrics.get("first_trough_N"), to_N * read["trough_K"]),
        _row("switch, N", metrics.get("first_switch_N"), to_N * read["switch_K"]),
        _row("switch, mm of travel", metrics.get("first_switch_u_mm"), read["switch_u_mm"]),
        _row("first band, degrees", metrics.get("first_band_beta_deg"), read["beta_0_deg"]),
        _row("second band, degrees", metrics.get("second_band_beta_deg"), read["beta_1_deg"]),
        ("sand at the face at the end, mm above the first surface", *_rise(virtual, results)),
        *_friction(virtual, results),
    ]
    table = pd.DataFrame(rows, columns=["quantity", "measured", "std", "run"]).astype({"run": float})
    return table.assign(difference=table["measured"] - table["run"])


def _row(quantity: str, metric: Mapping[str, Any] | None, run: float) -> tuple[str, Any, Any, float]:
    given = metric or {}
    return quantity, given.get("experiment"), given.get("experiment_std"), run


def _rise(virtual: Path, results: Path) -> tuple[float, None, float]:
    """Height of the sand at the face in the last photograph; the run's own in its last interval."""
    surface = pd.read_csv(results / "surface.csv")
    last = surface[surface["frame"] == surface["frame"].max()].dropna()
    own = pd.read_csv(next(virtual.glob("*_bands.csv")))["surface_rise_at_blade_m"].iloc[-1]
    depth = load_scene(results.parent, files=False).blade.depth_mm
    return float(last["y_mm"].iloc[:3].median()) - depth, None, 1e3 * float(own)


def _friction(virtual: Path, results: Path) -> list[tuple[str, float, float | None, float]]:
    """Friction while a band slips, as measured, beside the run's own blocks and what its sand could give."""
    table = pd.read_csv(results / "mobilised.csv")
    late = table[(table["status"] == "ok") & (table["slip_mm"] > 2 * softening_mm(virtual))]
    blocks = mobilised(virtual)
    sliding = blocks[(blocks["event"] == "") & (blocks["u_mm"] > _START_MM)]["friction_deg"]
    found, std = float(late["phi_deg"].median()), float(late["phi_std_deg"].median())
    soil, meta = run_soil(virtual)
    plane = davis(soil["residual_friction_deg"], 0.0)
    return [
        ("friction of a slipping band, degrees; the run's own blocks", found, std, float(sliding.median())),
        ("the same; residual on a plane of slip without dilation", found, std, plane),
        ("the same; residual of its sand", found, std, float(meta["phi_res"])),
    ]


def softening_mm(virtual: Path) -> float:
    """Slip over which the run's sand softens, mm."""
    return float(run_soil(virtual)[0]["mobilization_length_mm"])


if __name__ == "__main__":
    main()
