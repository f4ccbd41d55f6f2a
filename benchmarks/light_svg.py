"""Figures of pages that exist, made small: tenths of a unit, few points, few greys.

python benchmarks/light_svg.py PAGE...
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from drawing.svg import light


def main(arguments: Sequence[str] | None = None) -> None:
    """Lighten each page that is named."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pages", nargs="+", type=Path)
    for path in parser.parse_args(arguments).pages:
        before = path.read_text(encoding="utf-8")
        after = light(before)
        path.write_text(after, encoding="utf-8", newline="\n")
        print(f"{path}: {len(before)} -> {len(after)} characters")


if __name__ == "__main__":
    main()
