"""Several tests on one machine: threads, processes or both, with and without compiled kernels on disk.

    python benchmarks/bench_many.py [--quick | --large] [--warm] [--tests N] [--cores N,N] [--out DIR]

Made folders of some photographs are processed, each to its report, in a process of their own for each way of
sharing the cores: ``processes x threads``, 0 processes: in the process that was started. Told are the clock,
the processor's time, and the greatest memory of all processes together (what they share counted once; Linux).
"""

import argparse
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ploughval import process
from ploughval.run.many.child import Task
from ploughval.run.many.pool import Hearers, Pool
from ploughval.synth import EXAMPLE, make_folder
from sequences.big import BIG, framed
from speed_error.tables import write_rows

RECIPE = replace(EXAMPLE, frames=8, displacement_mm=16.0)
LARGE = replace(BIG, frames=4, displacement_mm=4.0, box_length_mm=370.0)
QUICK = replace(EXAMPLE, frames=3, displacement_mm=4.0, mm_per_px=0.5)
PAUSE_S = 0.1  # between two looks at the memory
WARM, COLD = "warm", "cold"
FEW = 2  # tests that show what compiling costs


@dataclass(frozen=True, slots=True)
class Way:
    """Processes side by side (0: none, all in the process that was started), and threads of each."""

    processes: int
    threads: int


def ways(cores: int) -> list[Way]:
    """Every way of sharing the cores evenly: threads only, processes only, and what lies between."""
    return [Way(0, cores), *(Way(n, cores // n) for n in range(2, cores + 1) if cores % n == 0)]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure every way and print a row for each; write many.csv into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--tests", type=int, default=8)
    parser.add_argument("--cores", default="1,2", help="joined by commas")
    parser.add_argument("--quick", action="store_true", help="two tiny tests")
    parser.add_argument("--large", action="store_true", help="four photographs of 12 million px each")
    parser.add_argument("--warm", action="store_true", help="leave out the runs that compile anew")
    parser.add_argument("--one", nargs=2, type=int, metavar=("PROCESSES", "THREADS"), help=argparse.SUPPRESS)
    parser.add_argument("folders", nargs="*", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.one:
        work(Way(*options.one), options.folders)
        return
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        recipe = QUICK if options.quick else framed(LARGE) if options.large else RECIPE
        folders = [Path(scratch) / f"t{n}" for n in range(2 if options.quick else options.tests)]
        for seed, folder in enumerate(folders):
            make_folder(folder, replace(recipe, seed=seed))
        chosen = [way for cores in options.cores.split(",") for way in ways(int(cores))]
        work(Way(0, 1), folders[:1])  # compiled and read once before anything is measured
        again = [] if options.quick or options.warm else chosen[1:]
        for kernels, way in [(WARM, way) for way in chosen] + [(COLD, way) for way in again]:
            some = folders if kernels == WARM else folders[:FEW]
            rows.append(measured(way, some, kernels, Path(scratch)))
            print(rows[-1], flush=True)
    write_rows(options.out / "many.csv", list(rows[0]), rows)


def work(way: Way, folders: Sequence[Path]) -> None:
    """Process the folders anew in one way."""
    if way.processes == 0:
        for folder in folders:
            process(folder, workers=way.threads, fresh=True)
        return
    failed: list[object] = []

    def finished(index: int, result: object) -> None:
        if isinstance(result, Exception):
            failed.append(result)

    options = {"workers": way.threads, "fresh": True}
    tasks = [Task(index, str(folder), None, options) for index, folder in enumerate(folders)]
    Pool("ploughval:process", way.processes, way.threads).run(tasks, Hearers(finished))
    if failed:
        raise SystemExit(f"not processed: {failed}")


def measured(way: Way, folders: Sequence[Path], kernels: str, scratch: Path) -> dict[str, object]:
    """A row: one way in a process of its own."""
    environment = dict(os.environ)
    if kernels == COLD:
        environment["NUMBA_CACHE_DIR"] = tempfile.mkdtemp(dir=scratch)
    command = [sys.executable, __file__, "--one", str(way.processes), str(way.threads), *map(str, folders)]
    start = time.perf_counter()
    running = subprocess.Popen(command, env=environment)
    looking = Memory(running.pid)
    _, status, used = os.wait4(running.pid, 0)
    seconds, peak = time.perf_counter() - start, looking.end()
    running.returncode = os.waitstatus_to_exitcode(status)
    if running.returncode:
        raise SystemExit(f"{way} ended with {running.returncode}")
    return {
        "kernels": kernels,
        "cores": max(way.processes, 1) * way.threads,
        "processes": way.processes,
        "threads": way.threads,
        "tests": len(folders),
        "seconds": round(seconds, 1),
        "cpu_seconds": round(used.ru_utime + used.ru_stime, 1),
        "peak_MB": round(peak / 1e6),
    }


class Memory:
    """Looks on and on at the memory of a process and all that it started; NaN where that is not told."""

    def __init__(self, pid: int) -> None:
        self._pid, self._most, self._over = pid, float("nan"), threading.Event()
        self._looking = threading.Thread(target=self._look, daemon=True)
        self._looking.start()

    def _look(self) -> None:
        while not self._over.wait(PAUSE_S):
            found = sum(_bytes_of(pid) for pid in _family(self._pid))
            if found and not found <= self._most:
                self._most = float(found)

    def end(self) -> float:
        """The most that was seen, bytes."""
        self._over.set()
        self._looking.join()
        return self._most


def _family(pid: int) -> list[int]:
    found = [pid]
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            children = task.read_text().split()
        except OSError:  # it has just ended
            continue
        for child in children:
            found += _family(int(child))
    return found


def _bytes_of(pid: int) -> int:
    """What a process holds, with its share of what it shares with others."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return next((1024 * int(line.split()[1]) for line in lines if line.startswith("Pss:")), 0)


if __name__ == "__main__":
    main()
