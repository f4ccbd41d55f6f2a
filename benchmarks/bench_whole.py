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
from ploughval.synth import EXAMPLE, SynthOptions, make_folder
from sequences.errors import errors_of
from sequences.rows import Row, missed, side_by_side

QUICK = replace(EXAMPLE, frames=10, mm_per_px=0.5)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print; write the table as CSV into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--folder", type=Path, nargs="*", help="processed folders made by synth")
    parser.add_argument("--seeds", type=int, nargs="*", default=[5, 6])
    parser.add_argument("--quick", action="store_true", help="one small folder")
    options = parser.parse_args(arguments)
    seeds, directions = ([5], [Direction.RIGHT]) if options.quick else (options.seeds, list(Direction))
    tables = {}
    if options.folder:
        for folder in options.folder:
            tables[folder.resolve().name] = errors_of(folder, results_of(folder))
    else:
        with tempfile.TemporaryDirectory() as scratch:
            for seed in seeds:
                for direction in directions:
                    name = f"seed {seed} {direction.value}"
                    recipe = replace(QUICK if options.quick else EXAMPLE, seed=seed, direction=direction)
                    tables[name] = _made(Path(scratch) / name, recipe)
    table = side_by_side(tables)
    print(table.to_string(float_format=lambda v: f"{v:.4g}"))
    for name, rows in tables.items():
        for figure in missed(rows):
            print(f"missed in {name}: {figure}")
    options.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out / "whole.csv", float_format="%.5g", index_label="quantity")


def _made(folder: Path, recipe: SynthOptions) -> list[Row]:
    make_folder(folder, recipe)
    start = time.perf_counter()
    outcome = process(folder, workers=2)
    seconds = time.perf_counter() - start
    return [*errors_of(folder, outcome.results), Row("time of process and report", seconds, "s")]


if __name__ == "__main__":
    main()
