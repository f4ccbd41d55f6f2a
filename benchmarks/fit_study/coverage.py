"""How often the intervals of the fit hold the truth, over records whose errors are drawn as they are told."""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from fit_study.records import Errors, made_record
from ploughval.errors import PloughvalError
from ploughval.model.fit import PARAMETERS, SoilFit, fit_soil

CASES = {
    "model right": Errors(),
    "model off by 3 % in travel, 1 % in force": Errors(travel=0.03, force=0.01),
    "noise over 8 rows, not told": Errors(together=8.0),
}
SEED = 20140601


def coverage(count: int, out: Path, *, first: int = 0, cases: Sequence[int] | None = None) -> pd.DataFrame:
    """Fit ``count`` made records of each case, from record ``first`` on.

    Every fit stands in coverage-fits.csv; rows that are there already stay: a study can be made in parts.
    """
    path = out / "coverage-fits.csv"
    done = pd.read_csv(path) if path.is_file() else pd.DataFrame(columns=["case", "record"])
    rows: list[dict[str, object]] = []
    names = list(CASES)
    for case in names if cases is None else [names[k] for k in cases]:
        have = set(done.loc[done["case"] == case, "record"])
        for k in range(first, first + count):
            if k not in have:
                rows += _one(case, CASES[case], k)
        print(f"{case}: {first + count} records", flush=True)
        fresh = pd.DataFrame(rows)
        table = pd.concat([done, fresh], ignore_index=True) if len(done) else fresh
        table.to_csv(path, index=False, float_format="%.5g")
    return pd.read_csv(path)


def _one(case: str, errors: Errors, k: int) -> list[dict[str, object]]:
    """One record's fit: a row for each parameter."""
    made = made_record(np.random.default_rng([SEED, k]), errors)
    start = time.process_time()
    try:
        fit = fit_soil(
            made.u_mm, made.force_N, made.noise_std_N, made.scene,
            shared=made.shared, discrepancy=made.discrepancy,
        )  # fmt: skip
    except PloughvalError as error:
        return [{"case": case, "record": k, "parameter": name, "error": str(error)} for name in PARAMETERS]
    head = {"case": case, "record": k}
    return rows_of(fit, made.truth, head | {"seconds": time.process_time() - start})


def rows_of(fit: SoilFit, truth: dict[str, float], head: dict[str, object]) -> list[dict[str, object]]:
    """A row for each parameter of a fit, beside the truth."""
    rows: list[dict[str, object]] = []
    for j, name in enumerate(fit.parameters):
        true = truth[name]
        row = {**head, "parameter": name, "true": true, "value": fit.values[j], "std": fit.std[j]}
        for level, limits in ((68, fit.interval_68[j]), (95, fit.interval_95[j])):
            row |= {f"low_{level}": limits[0], f"high_{level}": limits[1]}
            row[f"holds_{level}"] = bool(limits[0] <= true <= limits[1])
        row |= {"switches": len(fit.switches), "chi2": fit.chi2_reduced}
        row |= {"inflation": fit.misfit.inflation, "message": fit.message}
        rows.append(row)
    return rows


def shares(fits: pd.DataFrame) -> pd.DataFrame:
    """Share of intervals that hold the truth, with what is typical."""
    rows = []
    for (case, name), part in fits.groupby(["case", "parameter"], sort=False):
        part = part.dropna(subset=["value"])
        closed = part[np.isfinite(part["std"])]
        rows.append(
            {
                "case": case,
                "parameter": name,
                "fits": len(part),
                "holds_68_pct": 100 * part["holds_68"].mean(),
                "holds_95_pct": 100 * part["holds_95"].mean(),
                "open": len(part) - int(np.isfinite(part[["low_95", "high_95"]]).all(axis=1).sum()),
                "median_std": closed["std"].median(),
                "median_error": (part["value"] - part["true"]).abs().median(),
                "rms_pull": float(
                    np.sqrt((((closed["value"] - closed["true"]) / closed["std"]) ** 2).mean())
                ),
                "median_seconds": part["seconds"].median(),
                "most_seconds": part["seconds"].max(),
            }
        )
    return pd.DataFrame(rows)
