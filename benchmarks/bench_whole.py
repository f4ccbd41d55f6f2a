"""The whole way on made folders: error of every quantity against the exact truth, and the time it took.

python benchmarks/bench_whole.py                        # makes and processes folders of several seeds
python benchmarks/bench_whole.py --folder t             # a processed folder made by `ploughval synth`
"""

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ploughval import process
from ploughval.axes import Direction
from ploughval.run.results import results_of
from ploughval.synth import EXAMPLE, make_folder
from sequence_errors import errors_of
from sequence_rows import Row, missed, side_by_side


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print; write the table as CSV into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--folder", type=Path, nargs="*", help="processed folders made by synth")
    parser.add_argument("--seeds", type=int, nargs="*", default=[5, 6])
    options = parser.parse_args(arguments)
    tables = {}
    if options.folder:
        for folder in options.folder:
            tables[folder.resolve().name] = errors_of(folder, results_of(folder))
    else:
        with tempfile.TemporaryDirectory() as scratch:
            for seed in options.seeds:
                for direction in Direction:
                    name = f"seed {seed} {direction.value}"
                    tables[name] = _made(Path(scratch) / name, seed, direction)
    table = side_by_side(tables)
    print(table.to_string(float_format=lambda v: f"{v:.4g}"))
    for name, rows in tables.items():
        for figure in missed(rows):
            print(f"missed in {name}: {figure}")
    options.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out / "whole.csv", float_format="%.5g", index_label="quantity")


def _made(folder: Path, seed: int, direction: Direction) -> list[Row]:
    make_folder(folder, replace(EXAMPLE, seed=seed, direction=direction))
    start = time.perf_counter()
    outcome = process(folder, workers=2)
    seconds = time.perf_counter() - start
    return [*errors_of(folder, outcome.results), Row("time of process and report", seconds, "s")]


if __name__ == "__main__":
    main()
