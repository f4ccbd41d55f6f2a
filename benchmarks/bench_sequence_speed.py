"""Seconds and memory of a whole test of 60 photographs of 12 megapixels with 5 000 points, beside its errors.

python benchmarks/bench_sequence_speed.py                     # makes the test (a minute) and processes it
python benchmarks/bench_sequence_speed.py --folder t          # a test that is there, or is made there
python benchmarks/bench_sequence_speed.py --format png --frames 8
"""

import argparse
import os
import platform
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from sequences.big import BIG, first_frames, make_big
from sequences.errors import errors_of
from sequences.process import Processed, process_afresh
from sequences.rows import Row, missed, side_by_side

LIMITS = {"photographs": 45.0, "whole": 60.0, "memory": 1.5}  # s, s, GB: a test of 60 photographs


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print; write the table as CSV into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/sequences"))
    parser.add_argument("--folder", type=Path, help="made by this script; made where there is none")
    parser.add_argument("--format", choices=["jpg", "png"], default="jpg")
    parser.add_argument("--frames", type=int, default=BIG.frames, help="only the first ones")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as scratch:
        folder = _folder(options, Path(scratch))
        run = process_afresh(folder, workers=options.workers, results=Path(scratch) / "results")
        print(run.log)
        rows = [*speed_rows(run, options.frames), *errors_of(folder, run.results)]
    name = f"{options.frames} photographs, {options.format}, {options.workers} workers"
    table = side_by_side({name: rows})
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    print(table.to_string(float_format=lambda v: f"{v:.4g}"))
    for figure in missed(rows):
        print(f"missed: {figure}")
    options.out.mkdir(parents=True, exist_ok=True)
    end = (
        ""
        if options.frames == BIG.frames and options.format == "jpg"
        else f"-{options.frames}-{options.format}"
    )
    table.to_csv(options.out / f"speed{end}.csv", float_format="%.5g", index_label="quantity")


def _folder(options: argparse.Namespace, scratch: Path) -> Path:
    whole: Path = options.folder if options.folder is not None else scratch / "big"
    if not (whole / "test.toml").is_file():
        make_big(whole, replace(BIG, image_format=options.format))
    if options.frames >= BIG.frames:
        return whole
    part = scratch / f"first{options.frames}"
    first_frames(whole, part, options.frames)
    return part


def speed_rows(run: Processed, frames: int) -> list[Row]:
    """Seconds of each stage from the record, of the whole command, and its peak memory."""
    whole = frames == BIG.frames
    rows = [
        Row("exit code", float(run.exit_code), "1", most=0),
        Row("whole command", run.seconds, "s", most=LIMITS["whole"] if whole else None),
        Row("peak memory", run.peak_GB, "GB", most=LIMITS["memory"]),
    ]
    for stage, seconds in run.record.get("timings_s", {}).items():
        limit = LIMITS["photographs"] if whole and stage == "photographs" else None
        rows.append(Row(f"stage {stage}", float(seconds), "s", most=limit))
    return rows


if __name__ == "__main__":
    main()
