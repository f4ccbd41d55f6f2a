"""Made tests whose error is known: stated errors, verdicts, and what is found when an input is told wrong.

python benchmarks/hundred_tests.py --out DIR --count 100
python benchmarks/study_known_error.py --tests DIR --out reports/validation
"""

import argparse
import json
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from hundred_tests import SOIL_STDS
from known_error.errors import error_rows, told_off, verdict_rows
from known_error.figures import draw_coverage, draw_power
from ploughval.scene import Soil, load_scene

OFF = ("peak_friction_deg", "residual_friction_deg")
STEPS = (0.0, 2.0, 4.0, 6.0)
_MIDDLE = (0.1587, 0.8413)  # of a normal: one standard deviation to either side
_Z = 1.96  # of the intervals of counted shares


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare every made test anew; write known-error*.csv and figures into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tests", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("reports/validation"))
    parser.add_argument("--power", type=int, default=30, help="tests in which an input is told wrong")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--kept", type=Path, help="folder in which every test's rows are kept and found again"
    )
    options = parser.parse_args(arguments)
    folders = sorted(path.parent.parent for path in options.tests.glob("*/results/run.json"))
    options.out.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(options.workers) as pool:
        rows = pd.concat(pool.map(partial(kept_rows, options.kept, "error"), folders), ignore_index=True)
        some = folders[: options.power]
        found = list(pool.map(partial(kept_rows, options.kept, "power"), some))
    table = summary(rows)
    print(table.to_string(float_format=lambda v: f"{v:.3g}"))
    table.to_csv(options.out / "known-error.csv", float_format="%.4g", index_label="metric")
    draw_coverage(table, options.out / "known-error.png")
    if found:
        power = power_table(pd.concat(found, ignore_index=True))
        print(power.to_string(index=False, float_format=lambda v: f"{v:.3g}"))
        power.to_csv(options.out / "known-error-power.csv", float_format="%.4g", index=False)
        draw_power(power, options.out / "known-error-power.png")


def kept_rows(kept: Path | None, kind: str, folder: Path) -> pd.DataFrame:
    """Rows of one test, of errors or of verdicts with an input told wrong, as kept or made anew."""
    path = None if kept is None else kept / f"{folder.name}-{kind}.csv"
    if path is not None and path.is_file():
        return pd.read_csv(path, dtype={"folder": str})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # the truth has no noise
        rows = pd.DataFrame(error_rows(folder) if kind == "error" else off_rows(folder))
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        rows.to_csv(path, index=False)
    return rows


def off_rows(folder: Path) -> Iterator[dict[str, object]]:
    """Verdicts of one made test when one input is told wrong by so many of its standard uncertainties."""
    truth = json.loads((folder / "truth" / "truth.json").read_text(encoding="utf-8"))
    true, scene = Soil(**truth["options"]["soil"]), load_scene(folder, files=False)
    for parameter in OFF:
        for steps in STEPS:
            told = told_off(scene, true, parameter, SOIL_STDS[parameter], steps)
            if told is not None:
                for row in verdict_rows(folder, told):
                    yield {"parameter": parameter, "steps": steps, **row}


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """Per metric: how far stated errors are from the known ones in the measurement's own terms; verdicts.

    Parameters
    ----------
    rows : DataFrame
        Of :func:`known_error.errors.error_rows`, all tests.

    Returns
    -------
    DataFrame, a row a metric
        tests: with a stated error; missed, invented: tests in which only the truth, or only the measurement,
        has the value; off_median: |E - E_true|; std_median: u_exp with u_num; bias and spread: median, and
        half the range of the middle 68 %, of (E - E_true) over it; within_1, within_2: shares of tests (an
        error of 0 is within anything); input_median: u_input; agrees: share of verdicts; *_low, *_high: 95 %
        intervals of shares.
    """
    return pd.DataFrame({name: _of_metric(some) for name, some in rows.groupby("metric", sort=False)}).T


def _of_metric(rows: pd.DataFrame) -> pd.Series:
    stated, known = rows["error"].notna(), rows["error_true"].notna()
    off = (rows["error"] - rows["error_true"])[stated & known].to_numpy(dtype=float)
    numerical = rows["numerical_std"].fillna(0.0)
    std = np.hypot(rows["experiment_std"], numerical)[stated & known].to_numpy(dtype=float)
    judged = np.isfinite(std)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = off / std
    z = z[np.isfinite(z)]
    size = np.abs(off[judged])
    verdicts = rows["agrees"].dropna().astype(bool)
    within = {k: share(int((size <= k * std[judged] + 1e-12).sum()), int(judged.sum())) for k in (1, 2)}
    agrees = share(int(verdicts.sum()), len(verdicts))
    return pd.Series(
        {
            "unit": rows["unit"].iloc[0],
            "tests": int(stated.sum()),
            "missed": int((rows["experiment_true"].notna() & rows["experiment"].isna()).sum()),
            "invented": int((rows["experiment_true"].isna() & rows["experiment"].notna()).sum()),
            "off_median": _median(np.abs(off)),
            "std_median": _median(std[judged]),
            "bias": _median(z),
            "spread": float(np.ptp(np.quantile(z, _MIDDLE))) / 2 if z.size else np.nan,
            "within_1": within[1][0],
            "within_2": within[2][0],
            "within_2_low": within[2][1],
            "within_2_high": within[2][2],
            "input_median": _median(rows["input_std"].dropna().to_numpy(dtype=float)),
            "agrees": agrees[0],
            "agrees_low": agrees[1],
            "agrees_high": agrees[2],
        }
    )


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if values.size else np.nan


def share(count: int, total: int) -> tuple[float, float, float]:
    """A counted share with its 95 % interval (Wilson 1927); NaN of nothing.

    >>> tuple(round(one, 3) for one in share(95, 100))
    (0.95, 0.888, 0.978)
    """
    if total == 0:
        return (np.nan, np.nan, np.nan)
    p, spread = count / total, _Z**2 / total
    middle = (p + spread / 2) / (1 + spread)
    half = _Z / (1 + spread) * np.sqrt(p * (1 - p) / total + spread / (4 * total))
    return p, float(middle - half), float(middle + half)


def power_table(rows: pd.DataFrame) -> pd.DataFrame:
    """Share of tests in which a metric differs, by the input that is told wrong and by how much."""
    judged = rows.dropna(subset=["agrees"]).assign(differs=lambda r: ~r["agrees"].astype(bool))
    groups = judged.groupby(["parameter", "steps", "metric"], sort=False)
    table = groups.agg(tests=("differs", "size"), differs=("differs", "mean")).reset_index()
    any_one = judged.groupby(["parameter", "steps", "folder"])["differs"].sum()
    counts = any_one.groupby(["parameter", "steps"]).mean().rename("metrics_that_differ").reset_index()
    return table.merge(counts, on=["parameter", "steps"])


if __name__ == "__main__":
    main()
