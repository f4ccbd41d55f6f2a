"""Shear bands of many made tests against the exact ones: bias, spread, and how often stated deviations hold.

Bands are found anew from tracks and surfaces that are there, so that a change of the finder takes seconds.

python benchmarks/hundred_tests.py --out TESTS              # makes and processes the tests, once
python benchmarks/study_bands.py --tests TESTS              # writes reports/validation/bands.csv
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ploughval.scene import load_scene
from ploughval.tracers import find_bands

WHOLE_MM = 1e-3  # of an increment that may lie outside its band
ORDINALS = ("first", "second")
COLUMNS = ("of", "quantity", "unit", "count", "median_error", "spread", "median_std", "within_1", "within_2")
QUANTITIES = {
    "beta": "degree",
    "outcrop": "mm",
    "velocity_x": "1",
    "velocity_y": "1",
    "start": "mm",
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Find bands, hold them to the truth, print and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tests", type=Path, required=True, help="where hundred_tests.py made its tests")
    parser.add_argument("--out", type=Path, default=Path("reports/validation"))
    options = parser.parse_args(arguments)
    folders = sorted(path.parents[1] for path in options.tests.glob("*/results/tracks.nc"))
    table = summary(errors_of(folders))
    options.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out / "bands.csv", index=False, float_format="%.4g", lineterminator="\n")
    print(f"{len(folders)} tests")
    print(table.to_string(index=False, float_format="%.3g"))


def errors_of(folders: Sequence[Path]) -> pd.DataFrame:
    """Errors and stated deviations of all tests: columns of, quantity, error, std."""
    rows: list[tuple[str, str, float, float]] = []
    for folder in folders:
        true_bands = pd.read_csv(folder / "truth" / "bands.csv")
        found = find_bands(
            xr.load_dataset(folder / "results" / "tracks.nc"),
            pd.read_csv(folder / "results" / "surface.csv"),
            load_scene(folder, files=False),
        )
        rows += increment_errors(found.increments, true_bands, np.load(folder / "truth" / "motions.npz"))
        if len(found.bands) == len(true_bands):
            rows += band_errors(found.bands, true_bands)
        else:
            print(f"{folder.name}: {len(found.bands)} bands found, {len(true_bands)} true")
    return pd.DataFrame(rows, columns=["of", "quantity", "error", "std"])


def increment_errors(
    increments: pd.DataFrame, bands: pd.DataFrame, motion: Mapping[str, NDArray[np.float64]]
) -> list[tuple[str, str, float, float]]:
    """Of increments that lie within one band, against the steps of the made motion."""
    u, du, outcrop, tangent = (motion[name] for name in ("u_mm", "du_mm", "outcrop_x_mm", "beta_deg"))
    tangent = np.tan(np.radians(tangent))
    rows = []
    for _, row in increments.dropna(subset=["beta_deg", "outcrop_x_mm"]).iterrows():
        first, last = row["u_mm"], row["u_mm"] + row["du_mm"]
        whole = (bands["u_start_mm"] <= first + WHOLE_MM) & (bands["u_end_mm"] >= last - WHOLE_MM)
        steps = (u + du / 2 > first) & (u + du / 2 < last)
        if whole.sum() != 1 or not steps.any():
            continue
        x = float(np.average(outcrop[steps], weights=du[steps]))
        rise = float(np.average(tangent[steps], weights=du[steps]))
        middle = float(np.average(np.arctan(tangent[steps]), weights=du[steps]))
        true = {"beta": np.degrees(middle), "outcrop": x, "velocity_x": 1.0, "velocity_y": rise}
        for name, column in (("beta", "beta_deg"), ("outcrop", "outcrop_x_mm")):
            std = column.replace("_deg", "_std_deg").replace("_x_mm", "_std_mm")
            rows.append(("increments", name, row[column] - true[name], row[std]))
        for name in ("velocity_x", "velocity_y"):
            rows.append(("increments", name, row[name] - true[name], row[f"{name}_std"]))
    return rows


def band_errors(found: pd.DataFrame, bands: pd.DataFrame) -> list[tuple[str, str, float, float]]:
    """Of each band at its start."""
    rows = []
    for number in range(len(bands)):
        of = f"{ORDINALS[number]} bands" if number < len(ORDINALS) else "later bands"
        for name, column, std in (
            ("start", "u_start_mm", ""),
            ("beta", "beta_deg", "beta_std_deg"),
            ("outcrop", "outcrop_x_mm", "outcrop_std_mm"),
        ):
            error = found[column].iloc[number] - bands[column].iloc[number]
            rows.append((of, name, float(error), float(found[std].iloc[number]) if std else np.nan))
    return rows


def summary(errors: pd.DataFrame) -> pd.DataFrame:
    """One row a quantity: bias, spread (1.4826 times the median distance from it), coverage."""
    rows = []
    for (of, name), some in errors.groupby(["of", "quantity"], sort=False):
        bias = some["error"].median()
        spread = 1.4826 * (some["error"] - bias).abs().median()
        stated = bool(some["std"].notna().any())
        within = [(some["error"].abs() < k * some["std"]).mean() if stated else np.nan for k in (1, 2)]
        rows.append((of, name, QUANTITIES[name], len(some), bias, spread, some["std"].median(), *within))
    return pd.DataFrame(rows, columns=list(COLUMNS))


if __name__ == "__main__":
    main()
