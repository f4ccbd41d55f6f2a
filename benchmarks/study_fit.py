"""Study of the fit: coverage of its intervals, objectives on their landscapes, and other physics."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from fit_coverage import coverage

PARTS = ("coverage",)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the parts asked for; tables go to --out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/fit"))
    parser.add_argument("--parts", nargs="*", default=list(PARTS), choices=PARTS)
    parser.add_argument("--count", type=int, default=100, help="made records of a case")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    if "coverage" in options.parts:
        print(coverage(options.count, options.out).to_string(index=False))


if __name__ == "__main__":
    main()
