"""Whole sequences on made tests: every figure against exact truth, one factor at a time.

python benchmarks/study_sequences.py                          # all cases, two at a time
python benchmarks/study_sequences.py --only base "noise 8"    # some of them
python benchmarks/study_sequences.py --folders /scratch       # keeps the made tests and their results there
"""

import argparse
import re
import shutil
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import pandas as pd

from ploughval.synth import make_folder
from sequences.cases import Case, cases
from sequences.errors import geometry_errors
from sequences.fates import FATES, confusion
from sequences.figures import draw_cases
from sequences.process import process_afresh
from sequences.rows import Row, missed, side_by_side

PROCESSES = 2


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, and write cases.csv, statuses.csv and a figure into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/sequences"))
    parser.add_argument("--folders", type=Path, help="where made tests are kept and found again")
    parser.add_argument("--only", nargs="*", default=[], help="names of cases")
    options = parser.parse_args(arguments)
    chosen = [case for case in cases() if not options.only or case.name in options.only]
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(scratch) if options.folders is None else options.folders
        measure = partial(_measure, place=place, keep=options.folders is not None)
        with ProcessPoolExecutor(min(PROCESSES, len(chosen))) as pool:
            found = list(pool.map(measure, chosen))
    tables = {case.name: rows for case, (rows, _) in zip(chosen, found, strict=True)}
    fates = added(table for _, table in found if table is not None)
    _tell(tables, fates)
    options.out.mkdir(parents=True, exist_ok=True)
    figures = side_by_side(tables)
    figures.T.to_csv(options.out / "cases.csv", float_format="%.4g", index_label="case")
    fates.astype(int).to_csv(options.out / "statuses.csv", index_label="true fate")
    draw_cases(tables, options.out / "cases.png")


def _measure(case: Case, *, place: Path, keep: bool) -> tuple[list[Row], pd.DataFrame | None]:
    folder = place / re.sub(r"[^a-z0-9]+", "-", case.name.lower())
    if not (folder / "test.toml").is_file():
        make_folder(folder, case.options)
    run = process_afresh(folder, workers=1)
    rows = [Row("exit code", float(run.exit_code), "1", most=0)]
    fates = None
    if (run.results / "run.json").is_file():
        rows += geometry_errors(folder, run.results)
        if (run.results / "tracks.nc").is_file():
            fates = confusion(folder, run.results)
    seconds = run.record.get("timings_s", {}).get("photographs", float("nan"))
    rows += [
        Row("photographs, one worker", float(seconds), "s"),
        Row("whole command, one worker", run.seconds, "s"),
        Row("peak memory", run.peak_GB, "GB", most=1.5),
    ]
    print(f"{case.name}: {run.seconds:.0f} s, {len(missed(rows))} figures missed", flush=True)
    if not keep:
        shutil.rmtree(folder)
    return rows, fates


def added(tables: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Tables of counts added up, a status that does not occur in one counted as 0."""
    whole = pd.DataFrame()
    for table in tables:
        whole = whole.add(table, fill_value=0)
    return whole.fillna(0).reindex([fate for fate in FATES if fate in whole.index])


def _tell(tables: dict[str, list[Row]], fates: pd.DataFrame) -> None:
    print(side_by_side(tables).to_string(float_format=lambda v: f"{v:.4g}"))
    for name, rows in tables.items():
        for figure in missed(rows):
            print(f"missed in {name}: {figure}")
    print("\npoints in photographs: true fate against status")
    print(fates.to_string(float_format=lambda v: f"{v:.0f}"))


if __name__ == "__main__":
    main()
