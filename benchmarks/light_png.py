"""Pictures of the reports made small, where they are: one palette of at most 64 colours, nothing dithered.

python benchmarks/light_png.py reports/*/*.png        # lighten pictures that exist
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from drawing.png import lighten


def main(arguments: Sequence[str] | None = None) -> None:
    """Lighten each picture that is named."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pictures", nargs="+", type=Path)
    for path in parser.parse_args(arguments).pictures:
        before = path.stat().st_size
        print(f"{path}: {before} -> {lighten(path)} bytes")


if __name__ == "__main__":
    main()
