"""How long the command line takes to answer: median, least and greatest of repeated runs, in seconds.

    python benchmarks/start_time.py [--runs 21]

Beside it, in the same turns, Python that does nothing, and `import ploughval`.
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

COMMAND = str(Path(sys.executable).with_name("ploughval"))
CASES = {
    "python -c pass": (sys.executable, "-c", "pass"),
    "import ploughval": (sys.executable, "-c", "import ploughval"),
    "ploughval --version": (COMMAND, "--version"),
    "ploughval --help": (COMMAND, "--help"),
    "ploughval process --help": (COMMAND, "process", "--help"),
}


def main() -> None:
    """Print a line a case."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=21, help="of each case, after one that does not count")
    runs = parser.parse_args().runs
    taken: dict[str, list[float]] = {name: [] for name in CASES}
    for _ in range(runs + 1):
        for name, command in CASES.items():
            taken[name].append(seconds(command))
    print("case,median_s,least_s,greatest_s")
    for name, every in taken.items():
        counted = every[1:]
        print(f"{name},{median(counted):.3f},{min(counted):.3f},{max(counted):.3f}")


def seconds(command: tuple[str, ...]) -> float:
    """How long a program takes that has to succeed."""
    begun = time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begun


if __name__ == "__main__":
    main()
