"""Many small made tests of varied sand, processed whole: over them the coverage of intervals is counted.

In every test the settings tell what a laboratory would know: soil and sensitivities of the cells with their
standard uncertainties. The sand's own values and the cells' own are drawn from just those normals, so that
whatever is stated is true. Depth, width, scale and wall friction are told exactly.

python benchmarks/hundred_tests.py --out TESTS --count 100
python benchmarks/hundred_tests.py --out TESTS --first 15 --count 15       # some of them
"""

import argparse
import json
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ploughval.run.process import process_folder
from ploughval.scene import Soil
from ploughval.synth import SynthOptions, make_folder

SEED = 2014
FRAMES = 28
SOIL_STDS = {
    "unit_weight_kN_m3": "unit_weight_std_kN_m3",
    "peak_friction_deg": "peak_friction_std_deg",
    "residual_friction_deg": "residual_friction_std_deg",
    "mobilization_length_mm": "mobilization_length_std_mm",
}
_LEAST_SOFTENING_DEG = 4.0  # between the stated angles: the drawn ones hardly ever cross
_LOGS = ("loadcells.csv", "empty/*.csv")


@dataclass(frozen=True, slots=True)
class CellErrors:
    """Sensitivities of the (upper, lower) cell: true over stated, and the stated relative uncertainty."""

    ratio: tuple[float, float]
    std: float


@dataclass(frozen=True, slots=True)
class Recipe:
    """One made test: what is made, and how the cells deviate from what is told of them."""

    number: int
    options: SynthOptions
    cells: CellErrors

    @property
    def name(self) -> str:
        """Name of the test and of its folder."""
        return f"{self.number:03d}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Make and process the tests that are not there yet; write index.csv over all that are there."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=100)
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    for number in range(options.first, options.first + options.count):
        recipe = recipe_of(number)
        folder = options.out / recipe.name
        if (folder / "results" / "run.json").is_file():
            continue
        start = time.perf_counter()
        make_test(folder, recipe)
        outcome = process_folder(folder, workers=2)
        seconds = time.perf_counter() - start
        print(f"{recipe.name}: {seconds:.1f} s, {len(outcome.faults)} faults", flush=True)
    table = index_of(options.out)
    table.to_csv(options.out / "index.csv", index=False, float_format="%.6g")


def recipe_of(number: int) -> Recipe:
    """Recipe of one test: the same number gives the same test, whatever else is made."""
    rng = np.random.default_rng([SEED, number])
    depth = _between(rng, 25.0, 40.0, 1)
    told = told_soil(rng)
    soil = true_soil(rng, told)
    gain_std = _between(rng, 0.001, 0.004, 5)
    upper, lower = 1 + gain_std * rng.standard_normal(2)
    options = SynthOptions(
        seed=1000 + number,
        name=f"{number:03d}",
        frames=FRAMES,
        mm_per_px=0.25,
        depth_mm=depth,
        displacement_mm=round(depth * _between(rng, 1.6, 2.0, 3), 1),
        soil=soil,
        told_soil=told,
        layers_mm=tuple(round(depth * share, 2) for share in (0.25, 0.5, 0.75)),
        dyed=bool(rng.random() < 0.5),
        noise_grey=_between(rng, 1.0, 4.0, 2),
        rate_hz=100.0,
        empty_runs=int(rng.integers(2, 5)),
        friction_N=_between(rng, 0.5, 2.5, 2),
        friction_scatter=_between(rng, 0.02, 0.08, 3),
        moment_noise_Nm=_between(rng, 0.001, 0.004, 5),
    )
    return Recipe(number, options, CellErrors((float(upper), float(lower)), gain_std))


def _between(rng: np.random.Generator, low: float, high: float, digits: int) -> float:
    return round(float(rng.uniform(low, high)), digits)


def told_soil(rng: np.random.Generator) -> Soil:
    """What the settings tell of the sand; every second sand rubs on the blade."""
    peak = _between(rng, 34.0, 52.0, 2)
    residual = _between(rng, 28.0, min(34.0, peak - _LEAST_SOFTENING_DEG), 2)
    length = round(math.exp(rng.uniform(math.log(0.5), math.log(5.0))), 3)
    return Soil(
        unit_weight_kN_m3=_between(rng, 14.0, 17.0, 2),
        peak_friction_deg=peak,
        residual_friction_deg=residual,
        mobilization_length_mm=length,
        wall_friction_deg=_between(rng, 2.0, 8.0, 2) if rng.random() < 0.5 else 0.0,
        unit_weight_std_kN_m3=_between(rng, 0.1, 0.3, 3),
        peak_friction_std_deg=_between(rng, 0.5, 1.5, 3),
        residual_friction_std_deg=_between(rng, 0.3, 0.8, 3),
        mobilization_length_std_mm=round(length * _between(rng, 0.05, 0.2, 3), 4),
    )


def true_soil(rng: np.random.Generator, told: Soil) -> Soil:
    """The sand's own values, from the stated normals; drawn again where peak and residual cross."""
    while True:
        drawn = {
            name: getattr(told, name) + getattr(told, std) * rng.standard_normal()
            for name, std in SOIL_STDS.items()
        }
        values = {name: round(float(value), 4) for name, value in drawn.items()}
        if values["residual_friction_deg"] < values["peak_friction_deg"]:
            return Soil(**values, wall_friction_deg=told.wall_friction_deg)


def make_test(folder: Path, recipe: Recipe) -> None:
    """Make the folder; its logs are what cells of the recipe's sensitivities read."""
    make_folder(folder, recipe.options, overwrite=True)
    for path in sorted(path for pattern in _LOGS for path in folder.glob(pattern)):
        table = pd.read_csv(path)
        for column, ratio in zip(("moment_upper_Nm", "moment_lower_Nm"), recipe.cells.ratio, strict=True):
            table[column] = (table[column] / ratio).round(6)
        table.to_csv(path, index=False, lineterminator="\n")
    with (folder / "test.toml").open("a", encoding="utf-8") as settings:
        settings.write(
            "\n[loadcells.calibration]\n"
            f"upper_Nm_per_unit_std = {recipe.cells.std!r}\n"
            f"lower_Nm_per_unit_std = {recipe.cells.std!r}\n"
        )
    true = {"ratio": recipe.cells.ratio, "std": recipe.cells.std}
    (folder / "truth" / "cells.json").write_text(json.dumps(true) + "\n", encoding="utf-8")


def index_of(out: Path) -> pd.DataFrame:
    """One row a made test: true and told values, beside what else was drawn."""
    rows = [index_row(folder) for folder in sorted(out.iterdir()) if (folder / "truth").is_dir()]
    return pd.DataFrame(rows)


def index_row(folder: Path) -> dict[str, Any]:
    """What truth/ says of one made test."""
    options = json.loads((folder / "truth" / "truth.json").read_text(encoding="utf-8"))["options"]
    cells = json.loads((folder / "truth" / "cells.json").read_text(encoding="utf-8"))
    soil, told = options["soil"], options["told_soil"]
    values = {
        f"{kind}_{name}": source[name]
        for name in (*SOIL_STDS, "wall_friction_deg")
        for kind, source in (("true", soil), ("told", told))
    }
    drawn = ("depth_mm", "width_mm", "displacement_mm", "noise_grey", "dyed", "empty_runs", "friction_N")
    return {
        "folder": folder.name,
        **values,
        **{std: told[std] for std in SOIL_STDS.values()},
        **{name: options[name] for name in (*drawn, "friction_scatter", "moment_noise_Nm")},
        "gain_ratio_upper": cells["ratio"][0],
        "gain_ratio_lower": cells["ratio"][1],
        "gain_std": cells["std"],
        "processed": (folder / "results" / "run.json").is_file(),
    }


if __name__ == "__main__":
    main()
