"""The fit of whole made test folders, whose sand and load cells are off from what is told as stated."""

import json
import tempfile
import time
from pathlib import Path

import pandas as pd

from fit_study.coverage import rows_of
from ploughval.model.fit import Discrepancy
from ploughval.run.soil import fit_folder

# the folders' sand was moved by the model at a tolerance of 0.001: that is its error, otherwise it is right
TRUSTS = {"model right": Discrepancy(0.0, 1e-3), "default trust": Discrepancy()}


def folders(tests: Path, out: Path, *, first: int, count: int) -> pd.DataFrame:
    """Fit some of the folders; folders-fits.csv grows by those that are not in it."""
    path = out / "folders-fits.csv"
    done = pd.read_csv(path, dtype={"record": str}) if path.is_file() else pd.DataFrame(columns=["record"])
    rows: list[dict[str, object]] = []
    found = sorted(truth.parents[1] for truth in tests.glob("*/truth/truth.json"))
    for folder in found[first : first + count]:
        if folder.name in set(done["record"]):
            continue
        truth = json.loads((folder / "truth" / "truth.json").read_text())["options"]["soil"]
        for trust, discrepancy in TRUSTS.items():
            start = time.process_time()
            with tempfile.TemporaryDirectory() as results:
                fit, _ = fit_folder(folder, results=Path(results), discrepancy=discrepancy)
            head = {"case": trust, "record": folder.name, "seconds": time.process_time() - start}
            rows += rows_of(fit, truth, head)
    fresh = pd.DataFrame(rows)
    table = pd.concat([done, fresh], ignore_index=True) if len(done) else fresh
    table.to_csv(path, index=False, float_format="%.5g")
    return pd.read_csv(path, dtype={"record": str})
