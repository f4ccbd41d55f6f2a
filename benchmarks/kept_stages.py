"""What each stage of a test costs to make, to find again and to keep: the table of docs/resuming.md."""

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from ploughval import process
from ploughval.run.kept.stages import PAGE, STAGES

FILES = {stage.title: stage.name for stage in STAGES} | {"report": PAGE}


def run(folder: Path, out: Path) -> dict[str, float]:
    """Process a folder; the processor's time of each stage, and of all, s."""
    begun: dict[str, float] = {}
    taken: dict[str, float] = {}

    def heard(stage: str, done: int, total: int) -> None:
        begun.setdefault(stage, time.process_time())
        taken[stage] = time.process_time() - begun[stage]

    start = time.process_time()
    process(folder, out=out, progress=heard)
    return taken | {"all": time.process_time() - start}


def rows_of(folder: Path) -> list[str]:
    """A line for each stage of a folder."""
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "out"
        made, found = run(folder, out), run(folder, out)
        rows = []
        for stage, seconds in made.items():
            files = list((out / ".store").glob(f"{FILES.get(stage, '-')}-*.npz"))
            size = f"{sum(path.stat().st_size for path in files) / 1e6:.2f}" if files else ""
            rows.append(f"{folder.name} | {stage} | {seconds:.2f} | {found.get(stage, 0.0):.2f} | {size}")
    return rows


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, help="test folders")
    print("test | stage | first run, s of a processor | run again, s | kept, MB")
    for folder in parser.parse_args(argv).folders:
        print("\n".join(rows_of(folder)), flush=True)


if __name__ == "__main__":
    main()
