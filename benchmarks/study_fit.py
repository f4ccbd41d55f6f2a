"""Study of the fit: coverage of its intervals, landscapes of objectives, the paper's soil, other physics."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from fit_study.coverage import coverage, shares
from fit_study.example import example, rankine
from fit_study.figures import intervals_figure, landscapes_figure, save, virtual_figure
from fit_study.folders import folders
from fit_study.objectives import compare_objectives

PARTS = ("objectives", "example", "coverage", "folders")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the parts asked for; tables and figures go to --out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/fit"))
    parser.add_argument("--parts", nargs="*", default=list(PARTS), choices=PARTS)
    parser.add_argument("--count", type=int, default=100, help="made records of a case")
    parser.add_argument("--first", type=int, default=0, help="first record: parts of a study add up")
    parser.add_argument("--cases", type=int, nargs="*", default=None, help="which cases of the coverage")
    parser.add_argument(
        "--tests", type=Path, help="made test folders (hundred_tests.py), for the part folders"
    )
    options = parser.parse_args(arguments)
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    if "objectives" in options.parts:
        table, maps = compare_objectives(out)
        print(table.to_string(index=False))
        save(landscapes_figure(maps), out / "landscapes.png")
    if "example" in options.parts:
        table, curves = example(out)
        save(intervals_figure(table), out / "example.png")
        if curves["record"].str.startswith("material").any():
            save(virtual_figure(curves), out / "virtual.png")
        print(rankine(out).to_string(index=False))
    if "coverage" in options.parts:
        fits = coverage(options.count, out, first=options.first, cases=options.cases)
        table = shares(fits)
        table.to_csv(out / "coverage.csv", index=False, float_format="%.4g")
        print(table.to_string(index=False))
    if "folders" in options.parts and options.tests is not None:
        fits = folders(options.tests, out, first=options.first, count=options.count)
        table = shares(fits)
        table.to_csv(out / "folders.csv", index=False, float_format="%.4g")
        print(table.to_string(index=False))


if __name__ == "__main__":
    main()
