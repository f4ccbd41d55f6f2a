"""What ten thousand tests need: bytes, core hours, memory and cost, from runs of a few kinds of tests.

    python benchmarks/size_many.py [--quick] [--cut N] [--big FOLDER] [--out DIR]

Each kind is a made test that is processed to its report in a process of its own with one thread, at two
lengths; what a photograph takes is their difference, and longer tests are told from it. Bytes are those of
the files; the processor's time and the greatest memory are the process's (`wait4`). The walk is also left
half-way, to weigh what a worker would leave for the next. Writes sizes.csv and prints what many tests take.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import pandas as pd

from ploughval.run.walk.photographs import walk_to
from ploughval.synth import EXAMPLE, make_folder
from sequences.big import BIG, SPACING_PX, first_frames, make_big

TESTS = 10_000
GBIT_S = 1.0
CORE_HOUR, GB_MONTH = 0.04, 0.023
"""Prices that the table assumes, in one currency: an hour of one core with 4 GB; a GB kept for a month."""
SMALL_SHAPE = (1732, 2310)  # rows, columns of 4 Mpx
SMALL_MM_PER_PX = 0.1 * 3000 / SMALL_SHAPE[0]
QUICK_MM_PER_PX = 0.8


@dataclass(frozen=True, slots=True)
class Size:
    """What one test takes.

    Attributes
    ----------
    kind : str
    frames : int
    measured : bool
        Whether such a test was run, or is told from shorter ones.
    in_MB, out_MB, store_MB, state_MB : float
        Input files, result files, what is kept to resume, and what a walk left half-way; 1e6 bytes.
    cpu_s : float
        Processor's time, s.
    memory_GB : float
        Greatest memory of the process, 1e9 bytes.
    """

    kind: str
    frames: int
    measured: bool
    in_MB: float
    out_MB: float
    store_MB: float
    state_MB: float
    cpu_s: float
    memory_GB: float


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, and write sizes.csv into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument(
        "--cut", type=int, default=60, help="longest series that is processed, of 60 photographs"
    )
    parser.add_argument("--big", type=Path, help="a folder that big_sequence.make_big made, to be used again")
    parser.add_argument("--quick", action="store_true", help="tiny tests: a smoke run")
    options = parser.parse_args(arguments)
    lengths = (2, 4) if options.quick else (options.cut // 3, options.cut)
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        sizes = [measured("no photographs", _bare(scratch / "bare", quick=options.quick), 0, scratch)]
        for kind, folder in _seen(scratch, options.big, options.cut, quick=options.quick):
            short, long = (measured(kind, _cut(folder, n, scratch), n, scratch) for n in lengths)
            told = {60, 600} if kind.startswith("12") else {60}
            sizes += [short, long, *(scaled(short, long, n) for n in sorted(told - set(lengths)))]
            print(short, long, sep="\n", flush=True)
    table = pd.DataFrame([asdict(size) for size in sizes])
    options.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out / "sizes.csv", index=False, float_format="%.4g", lineterminator="\n")
    print(table.to_string(index=False, float_format="{:.3g}".format))
    print(many([size for size in sizes if size.frames in (0, 60, 600)]).to_string(index=False))


def measured(kind: str, folder: Path, frames: int, scratch: Path) -> Size:
    """Process a test in a process of its own."""
    out = scratch / f"out-{folder.name}"
    half = scratch / f"half-{folder.name}"
    if frames:
        walk_to(folder, out=half, frame=max(frames // 2, 1))
    command = [
        sys.executable,
        "-m",
        "ploughval.cli",
        "process",
        str(folder),
        "--workers",
        "1",
        "--out",
        str(out),
    ]
    child = subprocess.Popen([*command, "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert child.stdout is not None
    answer = json.loads(child.stdout.read())
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode > 1:
        raise SystemExit(f"{kind} was not processed: {answer}")
    store = _bytes(out / ".store")
    return Size(
        kind=kind,
        frames=frames,
        measured=True,
        in_MB=_bytes(folder) / 1e6,
        out_MB=(_bytes(out) - store) / 1e6,
        store_MB=store / 1e6,
        state_MB=_bytes(half / ".store") / 1e6,
        cpu_s=used.ru_utime + used.ru_stime,
        memory_GB=used.ru_maxrss * 1024 / 1e9,
    )


def scaled(short: Size, long: Size, frames: int) -> Size:
    """A test of more photographs, each of which takes what those took by which two tests differ.

    Its memory is that of the longer test: a walk holds a few photographs, however many there are.
    """
    share = (frames - long.frames) / (long.frames - short.frames)
    names = ("in_MB", "out_MB", "store_MB", "state_MB", "cpu_s")
    told = {
        name: getattr(long, name) + share * (getattr(long, name) - getattr(short, name)) for name in names
    }
    return replace(long, frames=frames, measured=False, **told)


def many(sizes: Sequence[Size], count: int = TESTS) -> pd.DataFrame:
    """Bytes, hours, cost and transfer of so many tests of each kind."""
    rows = []
    for size in sizes:
        core_hours = count * size.cpu_s / 3600
        kept_GB = count * (size.out_MB + size.store_MB) / 1e3
        moved_MB = size.in_MB + size.out_MB + size.store_MB
        rows.append(
            {
                "kind": f"{size.frames} x {size.kind}" if size.frames else size.kind,
                "in_TB": round(count * size.in_MB / 1e6, 3),
                "out_and_store_TB": round(kept_GB / 1e3, 3),
                "core_hours": round(core_hours),
                "compute": round(core_hours * CORE_HOUR),
                "kept_a_month": round(GB_MONTH * (count * size.in_MB / 1e3 + kept_GB)),
                "transfer_h": round(count * moved_MB * 8e6 / (GBIT_S * 1e9) / 3600, 1),
                "cores_that_fill_the_line": round(size.cpu_s / (moved_MB * 8e6 / (GBIT_S * 1e9)), 1),
                "scratch_GB_a_worker": round(moved_MB / 1e3, 2),
                "memory_GB_a_worker": round(size.memory_GB, 2),
            }
        )
    return pd.DataFrame(rows)


def _bare(folder: Path, *, quick: bool) -> Path:
    recipe = replace(EXAMPLE, photographs=False)
    make_folder(folder, replace(recipe, displacement_mm=3.0) if quick else recipe)
    return folder


def _seen(scratch: Path, big: Path | None, cut: int, *, quick: bool) -> list[tuple[str, Path]]:
    """Kinds of tests with photographs, each with a made folder."""
    if quick:
        tiny = replace(EXAMPLE, frames=4, mm_per_px=QUICK_MM_PER_PX, displacement_mm=4.0)
        make_folder(scratch / "tiny", tiny)
        return [("12 Mpx", scratch / "tiny")]
    small = replace(
        BIG, mm_per_px=SMALL_MM_PER_PX, frames=cut, displacement_mm=BIG.displacement_mm * cut / 60
    )
    spacing = SPACING_PX * SMALL_SHAPE[0] / 3000
    make_big(scratch / "small", small, spacing_px=spacing, shape=SMALL_SHAPE)
    if big is None:
        big = scratch / "big"
        make_big(big, replace(BIG, frames=cut, displacement_mm=BIG.displacement_mm * cut / 60))
    return [("4 Mpx", scratch / "small"), ("12 Mpx", big)]


def _cut(folder: Path, count: int, scratch: Path) -> Path:
    out = scratch / f"{folder.name}-{count}"
    first_frames(folder, out, count)
    return out


def _bytes(folder: Path) -> int:
    truth = folder / "truth"
    return sum(p.stat().st_size for p in folder.rglob("*") if p.is_file() and truth not in p.parents)


if __name__ == "__main__":
    main()
