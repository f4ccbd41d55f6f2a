"""Broken test folders, each with what must be said of it, and a run that judges the answers.

python benchmarks/broken_folders.py OUT                      # make them all
python benchmarks/broken_folders.py OUT --only "log: "       # those whose names hold this
python benchmarks/broken_folders.py OUT --run [--heavy]      # make, process and judge each
python benchmarks/broken_folders.py OUT --run --every 10     # a sample: each tenth

Each is made from one small sound test. A run is a process of its own under a limit of memory; it is judged by
its exit code, by what its messages hold (file, place, value, remedy), by the test folder, which must not
change, by its results, by seconds and by its peak of memory.
"""

import argparse
import csv
import re
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from broken import logs, names, pictures, settings, tables
from broken.base import Case, make_sound
from broken.run import Verdict, make, run

KINDS = (
    pictures,
    names,
    logs,
    tables,
    settings,
)


def all_cases() -> list[Case]:
    """Every broken folder."""
    return [case for kind in KINDS for case in kind.cases()]


def place_of(case: Case, number: int) -> str:
    """Name of the folder in which a case stands."""
    return f"{number:03d}-" + re.sub(r"[^A-Za-z0-9.]+", "-", case.name)[:80].strip("-")


def _judged(cases: Sequence[tuple[int, Case]], sound: Path, out: Path, *, keep: bool) -> list[Verdict]:
    verdicts = []
    for number, case in cases:
        place = out / place_of(case, number)
        verdict = run(case, make(case, sound, place), place / "out")
        verdicts.append(verdict)
        print(
            f"{number:4d} {verdict.code:4d} {verdict.seconds:6.1f} s {verdict.peak_MB:6.0f} MB  {case.name}",
            flush=True,
        )
        for fault in verdict.faults:
            print(f"       WRONG: {fault}")
        if verdict.faults:
            print("".join(f"         | {line}\n" for line in verdict.said.splitlines()[:12]))
        elif not keep:
            shutil.rmtree(place)
    return verdicts


def _distribution(code: int, verdicts: Sequence[Verdict]) -> str:
    """How many ended with an exit code, and the seconds and memory of half, nine in ten and all of them."""
    seconds, peak_MB = (sorted(getattr(v, name) for v in verdicts) for name in ("seconds", "peak_MB"))
    places = [min(int(share * len(verdicts)), len(verdicts) - 1) for share in (0.5, 0.9, 1.0)]
    took = ", ".join(f"{seconds[k]:.1f}" for k in places)
    held = ", ".join(f"{peak_MB[k]:.0f}" for k in places)
    return f"exit code {code}: {len(verdicts)}; median, nine in ten, most: {took} s; {held} MB"


def main(arguments: Sequence[str] | None = None) -> int:
    """Make, and where asked run, the folders; 1 where an answer is wrong."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", default="", help="cases whose names hold this text")
    parser.add_argument("--run", action="store_true", help="process and judge each")
    parser.add_argument("--every", type=int, default=1, help="each Nth case alone")
    parser.add_argument("--first", type=int, default=0, help="number of the case that --every begins with")
    parser.add_argument("--heavy", action="store_true", help="those of gigabytes too")
    parser.add_argument("--keep", action="store_true", help="folders that were answered rightly are kept too")
    options = parser.parse_args(arguments)
    out = options.out.resolve()
    sound = out / "sound"
    make_sound(sound)
    every = [(k, case) for k, case in enumerate(all_cases()) if options.only in case.name]
    cases = [(k, case) for k, case in every if options.heavy or not case.heavy]
    cases = cases[options.first :: options.every]
    if not options.run:
        for number, case in cases:
            make(case, sound, out / place_of(case, number))
        print(f"made {len(cases)} broken folders in {out}")
        return 0
    verdicts = _judged(cases, sound, out, keep=options.keep)
    with (out / "verdicts.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["case", "exit_code", "seconds", "peak_MB", "faults"])
        table.writerows(
            [v.name, v.code, f"{v.seconds:.2f}", f"{v.peak_MB:.0f}", "; ".join(v.faults)] for v in verdicts
        )
    wrong = sum(bool(v.faults) for v in verdicts)
    print(f"{len(verdicts)} folders, {wrong} answered wrongly")
    for code in sorted({v.code for v in verdicts}):
        print(_distribution(code, [v for v in verdicts if v.code == code]))
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
