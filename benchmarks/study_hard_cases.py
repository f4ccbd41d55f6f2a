"""The hard cases of every part, what must hold in each, and what happens: tables, pictures and a page.

python benchmarks/study_hard_cases.py                                # all parts
python benchmarks/study_hard_cases.py --parts model forces           # some; the others stay as they are
"""

import argparse
import importlib
import time
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from hard.cases import COLUMNS, Outcome, Part, attempt
from hard.page import draw_sheet, write_page, write_readme

PARTS = (
    "photographs",
    "correlation",
    "tracers",
    "forces",
    "calibration",
    "model",
    "fit",
    "comparison",
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the cases; write a table and a picture a part, the page and the README."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/stability"))
    parser.add_argument("--parts", nargs="*", default=list(PARTS), choices=PARTS, metavar="PART")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    done: dict[str, list[Outcome]] = {}
    parts = {key: part_of(key) for key in PARTS}
    for key in options.parts:
        start = time.perf_counter()
        done[key] = [attempt(case) for case in parts[key].cases()]
        table_of(done[key]).to_csv(
            options.out / f"{key}.csv", index=False, float_format="%.3g", lineterminator="\n"
        )
        draw_sheet(parts[key], done[key], options.out / f"{key}.png")
        print(f"{key}: {len(done[key])} cases, {time.perf_counter() - start:.0f} s", flush=True)
        for outcome in done[key]:
            print(f"    {outcome.fate.value:24s} {outcome.case.name}")
    tables = {key: pd.read_csv(path) for key in PARTS if (path := options.out / f"{key}.csv").is_file()}
    write_page(parts, tables, done, options.out / "index.html")
    write_readme(parts, tables, options.out / "README.md")


def part_of(key: str) -> Part:
    """The module of a part's cases, by name."""
    part: Part = importlib.import_module(f"hard.{key}").PART
    return part


def table_of(outcomes: Sequence[Outcome]) -> pd.DataFrame:
    """One row a case."""
    return pd.DataFrame([outcome.row() for outcome in outcomes], columns=list(COLUMNS))


if __name__ == "__main__":
    main()
