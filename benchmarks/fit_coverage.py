"""How often the intervals of the fit hold the truth, over records whose errors are drawn as they are told."""

import time
from pathlib import Path

import numpy as np
import pandas as pd

from fit_records import Errors, made_record
from ploughval.errors import PloughvalError
from ploughval.model.fit import PARAMETERS, fit_soil

CASES = {
    "model right": Errors(),
    "model off by 3 % in travel, 1 % in force": Errors(travel=0.03, force=0.01),
    "noise over 8 rows, not told": Errors(together=8.0),
}
SEED = 20140601


def coverage(count: int, out: Path) -> pd.DataFrame:
    """Fit ``count`` made records of each case; every fit stands in coverage-fits.csv, shares are returned."""
    rows = []
    for case, errors in CASES.items():
        for k in range(count):
            rows += _one(case, errors, k)
            if k % 10 == 9:
                print(f"{case}: {k + 1} of {count}", flush=True)
        pd.DataFrame(rows).to_csv(out / "coverage-fits.csv", index=False, float_format="%.5g")
    table = _shares(pd.DataFrame(rows))
    table.to_csv(out / "coverage.csv", index=False, float_format="%.4g")
    return table


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
    seconds = time.process_time() - start
    rows: list[dict[str, object]] = []
    for j, name in enumerate(fit.parameters):
        true = made.truth[name]
        row: dict[str, object] = {"case": case, "record": k, "parameter": name, "true": true}
        row |= {"value": fit.values[j], "std": fit.std[j]}
        for level, limits in ((68, fit.interval_68[j]), (95, fit.interval_95[j])):
            row |= {f"low_{level}": limits[0], f"high_{level}": limits[1]}
            row[f"holds_{level}"] = bool(limits[0] <= true <= limits[1])
        row |= {"seconds": seconds, "switches": len(fit.switches), "chi2": fit.chi2_reduced}
        row |= {"inflation": fit.misfit.inflation, "message": fit.message}
        rows.append(row)
    return rows


def _shares(fits: pd.DataFrame) -> pd.DataFrame:
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
