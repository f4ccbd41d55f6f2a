"""What each stage of a test costs to make, to find again and to keep: the table of docs/resuming.md."""

import argparse
import json
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from ploughval import process
from ploughval.run import Outcome
from ploughval.run.stages import PAGE, STAGES

FILES = {stage.title: stage.name for stage in STAGES} | {"report": PAGE}


def run(folder: Path, out: Path) -> tuple[Outcome, dict[str, float]]:
    """Process a folder; its outcome and the time of each stage, of the page too, s."""
    ends: dict[str, float] = {}
    begun: dict[str, float] = {}

    def heard(stage: str, done: int, total: int) -> None:
        begun.setdefault(stage, time.perf_counter())
        ends[stage] = time.perf_counter()

    outcome = process(folder, out=out, progress=heard)
    record = json.loads((out / "run.json").read_text("utf-8"))
    taken = dict(record["timings_s"])
    taken["report"] = ends["report"] - begun["report"] if "report" in begun else float("nan")
    return outcome, taken


def rows_of(folder: Path) -> list[str]:
    """A line for each stage of a folder."""
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "out"
        first, made = run(folder, out)
        again, found = run(folder, out)
        rows = []
        for stage, seconds in made.items():
            files = list((out / ".store").glob(f"{FILES.get(stage, '-')}-*.npz"))
            size = f"{sum(path.stat().st_size for path in files) / 1e6:.2f}" if files else ""
            rows.append(f"{folder.name} | {stage} | {seconds:.2f} | {found[stage]:.2f} | {size}")
        rows.append(f"{folder.name} | all | {first.seconds:.2f} | {again.seconds:.2f} | ")
    return rows


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, help="test folders")
    print("test | stage | first run, s | run again, s | kept, MB")
    for folder in parser.parse_args(argv).folders:
        print("\n".join(rows_of(folder)), flush=True)


if __name__ == "__main__":
    main()
