"""Kills runs of a made test with SIGKILL, at chosen acts and after given times, and runs them again.

After each kill every file must be absent, as it was, or whole and new. After another run all bytes must be
those of a run that nobody killed, and no stage that had been finished is made again. Needs fork and /proc.
"""

import argparse
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

import ploughval.run.walk.photographs
from ploughval.report import write_single
from ploughval.run import process_folder
from ploughval.run.kept.stages import STATE
from ploughval.run.kept.written import write_text
from ploughval.run.walk.pieces import state_of
from ploughval.synth import EXAMPLE, make_folder

SMALL = replace(
    EXAMPLE, seed=2, rate_hz=10.0, rest_s=3.0, frames=4, displacement_mm=8.0, mm_per_px=0.4, ahead_mm=60.0
)
SETTINGS = "\n[compare]\ndraws = 16\n\n[piv]\nspacing_px = 30.0\n"
EARLIER = "\n[compare]\ndraws = 20\n\n[piv]\nspacing_px = 30.0\nzncc_min = 0.6\n"
KINDS = ("begin", "half", "before", "after", "unlink", "stage")
"""When a run dies: a file has been opened, is half written, is whole but not renamed, has just been renamed;
a file has just been removed; a stage begins or a photograph is done."""
VARIES = ("timings_s", "stages")  # parts of run.json that tell of the run, not of the test


@dataclass(frozen=True, slots=True)
class Act:
    """One thing that a run does: of a kind, the number among these, and what it is done to."""

    kind: str
    number: int
    name: str


class Acts:
    """Counts what a run does, and kills it at one of its acts."""

    def __init__(self, at: Act | None, heard: Callable[[Act], None] = lambda act: None) -> None:
        self._at, self._heard = at, heard
        self._counts = dict.fromkeys(KINDS, 0)

    def tell(self, kind: str, name: str, last: Callable[[], object] = lambda: None) -> None:
        """Take down an act; where it is the one to die at, do the last thing and die."""
        act = Act(kind, self._counts[kind], name)
        self._counts[kind] += 1
        self._heard(act)
        if self._at is not None and (act.kind, act.number) == (self._at.kind, self._at.number):
            last()
            os.kill(os.getpid(), signal.SIGKILL)

    def progress(self, stage: str, done: int, total: int) -> None:
        """Hear of a stage."""
        self.tell("stage", f"{stage} {done} of {total}")

    def install(self) -> None:
        """Watch how files come about; only ever in a process of its own."""
        make, sync, rename, remove = tempfile.mkstemp, os.fsync, os.replace, os.unlink

        def making(*given: Any, **named: Any) -> tuple[int, str]:
            handle, name = make(*given, **named)
            self.tell("begin", _final(name))
            return handle, name

        def syncing(handle: int) -> None:
            size = os.fstat(handle).st_size
            if not os.path.isdir(f"/proc/self/fd/{handle}"):
                name = _final(os.readlink(f"/proc/self/fd/{handle}"))
                self.tell("half", name, lambda: os.ftruncate(handle, size // 2))
            sync(handle)

        def renaming(source: Any, target: Any, **named: Any) -> None:
            self.tell("before", Path(target).name)
            rename(source, target, **named)
            self.tell("after", Path(target).name)

        def removing(path: Any, **named: Any) -> None:
            there = os.path.lexists(path)
            remove(path, **named)
            if there:
                self.tell("unlink", Path(path).name)

        tempfile.mkstemp, os.fsync, os.replace, os.unlink = making, syncing, renaming, removing  # type: ignore[assignment]


def _final(name: str) -> str:
    """The final name of a temporary file."""
    stem, _, rest = Path(name).name[1:].partition(".part-")
    return stem + Path(rest).suffix


def quick_page(results: Path, progress: Any = None) -> Path:
    """In place of the report, which takes most of a small test's time: a page of the metrics."""
    write_text(results / "report.html", (results / "metrics.json").read_text("utf-8"))
    return results / "report.html"


def in_child(work: Callable[[], None]) -> int:
    """Run something in a process of its own; the signal that it died of, 0 where it ended well.

    Raises
    ------
    RuntimeError
        When it raised something, which is printed.
    """
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        try:
            work()
        except BaseException as error:
            sys.stderr.write(f"{type(error).__name__}: {error}\n")
            os._exit(1)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    if os.WIFEXITED(status) and os.WEXITSTATUS(status) != 0:
        raise RuntimeError("a run ended with an error of its own")
    return os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0


class Trial:
    """A made test, what an undisturbed run leaves of it, and runs of it that are killed.

    Attributes
    ----------
    acts : dict of bool to list of Act
        What an undisturbed run does, in an empty folder and over an earlier run's results.
    """

    def __init__(self, folder: Path, page: Callable[..., Path]) -> None:
        self._folder, self._page = folder, page
        self._test, self._out = folder / "test", folder / "out"
        self._settings, self._told = self._test / "test.toml", folder / "acts.json"
        folder.mkdir(parents=True)
        make_folder(self._test, SMALL)
        plain = self._settings.read_text("utf-8")
        self._settings.write_text(plain + EARLIER, encoding="utf-8")
        # in this process, so that those that are forked have all code at hand
        process_folder(self._test, out=self._folder / "earlier", page=page)
        self._settings.write_text(plain + SETTINGS, encoding="utf-8")
        self.acts: dict[bool, list[Act]] = {}
        for earlier in (True, False):
            self._begin(earlier)
            self.process(self._out, told=self._told)
            self.acts[earlier] = [Act(*act) for act in json.loads(self._told.read_text("utf-8"))]
        self._whole, self._earlier = files_of(self._out), files_of(self._folder / "earlier")

    def process(self, out: Path, *, at: Act | None = None, told: Path | None = None) -> int:
        """Process the test in a process of its own, which dies at an act; the signal that it died of."""
        heard: list[Act] = []

        def work() -> None:
            ploughval.run.walk.photographs.EVERY_S = 0.0  # a piece of the walk after every photograph
            acts = Acts(at, heard.append)
            acts.install()
            process_folder(self._test, out=out, page=self._page, progress=acts.progress)
            if told is not None:
                text = json.dumps([[act.kind, act.number, act.name] for act in heard])
                told.write_text(text, encoding="utf-8")

        return in_child(work)

    def spent(self) -> float:
        """How long the command line takes, s."""
        self._begin(earlier=False)
        return self.command(self._out, None)

    def command(self, out: Path, kill_after_s: float | None) -> float:
        """Process the test by the command line, killed after a time; how long it ran, s."""
        line = [sys.executable, "-m", "ploughval.cli", "process", str(self._test), "--out", str(out)]
        start = time.monotonic()
        with subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
            try:
                run.wait(kill_after_s)
            except subprocess.TimeoutExpired:
                run.kill()
        return time.monotonic() - start

    def faults_at(self, act: Act, *, earlier: bool) -> list[str]:
        """What is wrong after a run has died at an act and another one went on; empty where nothing is."""
        self._begin(earlier)
        if self.process(self._out, at=act) != signal.SIGKILL:
            return ["the run did not die"]
        return self._judged()

    def faults_after(self, seconds: float, *, earlier: bool) -> list[str]:
        """The same after a run of the command line was killed after a time."""
        self._begin(earlier)
        self.command(self._out, seconds)
        return self._judged()

    def _begin(self, earlier: bool) -> None:
        shutil.rmtree(self._out, ignore_errors=True)
        if earlier:
            shutil.copytree(self._folder / "earlier", self._out)

    def _judged(self) -> list[str]:
        """Judge what a killed run left, run again, and judge what that left."""
        faults, left = self._half_written(), files_of(self._out)
        self.process(self._out, told=self._told)
        again = files_of(self._out)
        for name in sorted(again.keys() | self._whole.keys()):
            if again.get(name) != self._whole.get(name):
                faults.append(f"{name} is not that of a run that nobody killed")
        faults += [f"{path.name} was left" for path in self._out.rglob("*") if is_passing(path)]
        return [*faults, *self._made_again(left)]

    def _half_written(self) -> list[str]:
        """Files that are neither absent nor as they were nor whole and new; a record without its files."""
        there = files_of(self._out)
        faults = [
            f"{name} is half written"
            for name, content in there.items()
            if content not in (self._whole.get(name), self._earlier.get(name))
            and not (name.startswith("walk") and is_whole(self._out / ".store" / name))
        ]
        for state in (self._whole, self._earlier):
            if there.get("run.json") == state["run.json"]:
                results = [name for name in state if name not in ("run.json", "report.html")]
                results = [name for name in results if not name.endswith(".npz")]
                faults += [f"run.json stands beside another {n}" for n in results if there.get(n) != state[n]]
        return faults

    def _made_again(self, left: dict[str, bytes]) -> list[str]:
        """Stages and photographs that were finished when the run died and were worked on all the same."""
        notes = json.loads((self._out / "run.json").read_text("utf-8"))["stages"]
        faults, titles = [], {"window": "photographs", "page": "report"}
        for name in left.keys() & {name for name in self._whole if name.endswith(".npz")}:
            stage = name.split("-")[0]
            if notes[titles.get(stage, stage)]["done"] != "reused":
                faults.append(f"{stage} had been finished and was made again")
        (window,) = [name for name in self._whole if name.startswith("window-")]
        key = window.removeprefix("window-")
        reached = frame_of(left.get(f"{STATE}-{key}"))
        acts = [Act(*act) for act in json.loads(self._told.read_text("utf-8"))]
        walked = {act.name for act in acts if act.name.startswith("photographs ")}
        walked = {name for name in walked if name.endswith(f" of {SMALL.frames}")}
        expected = 0 if window in left else SMALL.frames - reached
        if len(walked) != expected:
            faults.append(f"{len(walked)} photographs were walked; expected {expected}")
        return faults


def is_passing(path: Path) -> bool:
    """Whether a file of a result folder is there only while a run is at work."""
    return ".part-" in path.name or path.name == "lock" or path.name.startswith("walk")


def frame_of(state: bytes | None) -> int:
    """The next frame of a walk, from the bytes of the file with its state; 0 where there is none."""
    if state is None:
        return 0
    with np.load(io.BytesIO(state), allow_pickle=False) as file:
        return int(state_of(dict(file))["frame"])


def is_whole(path: Path) -> bool:
    """Whether all arrays of a file can be read."""
    with np.load(path, allow_pickle=False) as file:
        return all(file[name] is not None for name in file.files)


def files_of(folder: Path) -> dict[str, bytes]:
    """Contents of all files of a result folder by name, but temporary ones and what of run.json varies."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if not path.is_file() or ".part-" in name or path.name == "lock":
            continue
        content = path.read_bytes()
        if name == "run.json":
            record = {key: value for key, value in json.loads(content).items() if key not in VARIES}
            content = json.dumps(record, sort_keys=True).encode()
        found[path.name if path.suffix == ".npz" else name] = content
    return found


def chosen(acts: Sequence[Act], count: int) -> list[Act]:
    """As many acts, evenly over those of each kind."""
    each = max(1, count // len(KINDS))
    found: list[Act] = []
    for kind in KINDS:
        own = [act for act in acts if act.kind == kind]
        places = np.unique(np.linspace(0, len(own) - 1, min(each, len(own))).round().astype(int))
        found += [own[place] for place in places.tolist()]
    return found


QUICK = (  # kind of act, on what, and whether over an earlier run's results
    ("stage", "photographs 3 of 4", True),
    ("half", "window", False),
    ("unlink", "report.html", True),
    ("after", "run.json", True),
)


def quick_acts(trial: Trial) -> list[tuple[Act, bool]]:
    """One act of each kind that matters."""
    return [
        (next(act for act in trial.acts[earlier] if act.kind == kind and act.name.startswith(name)), earlier)
        for kind, name, earlier in QUICK
    ]


def all_acts(trial: Trial, places: int) -> list[tuple[Act, bool]]:
    """So many acts, half of them over an earlier run's results."""
    return [(act, earlier) for earlier in (False, True) for act in chosen(trial.acts[earlier], places // 2)]


def killed_at(trial: Trial, acts: Sequence[tuple[Act, bool]]) -> list[dict[str, Any]]:
    """Kill at acts, each over an earlier run's results or not; a row each, printed as it comes."""
    return [
        _row(f"{act.kind} {act.number}: {act.name}", earlier, trial.faults_at(act, earlier=earlier))
        for act, earlier in acts
    ]


def killed_after(trial: Trial, moments: int) -> list[dict[str, Any]]:
    """Kill the command line after so many times, evenly over a whole run; a row each."""
    whole = trial.spent()
    rows = []
    for moment in range(moments):
        after, earlier = whole * (moment + 0.5) / moments, bool(moment % 2)
        place = f"after {after:.2f} s of {whole:.2f}"
        rows.append(_row(place, earlier, trial.faults_after(after, earlier=earlier)))
    return rows


def _row(place: str, earlier: bool, faults: list[str]) -> dict[str, Any]:
    over = "earlier results" if earlier else "an empty folder"
    print(f"{place:44s} over {over:16s} {'; '.join(faults) or 'the same bytes'}", flush=True)
    return {"place": place, "over": over, "faults": faults}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the trials; 1 where anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", type=int, default=48, help="acts to die at")
    parser.add_argument("--moments", type=int, default=20, help="times after which the command is killed")
    parser.add_argument("--quick", action="store_true", help="a few acts that matter, and no times")
    given = parser.parse_args(argv)
    cv2.setNumThreads(1)  # threads do not outlive a fork
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        if given.quick or given.places:
            trial = Trial(Path(scratch) / "acts", quick_page)
            rows += killed_at(trial, quick_acts(trial) if given.quick else all_acts(trial, given.places))
        if given.moments and not given.quick:
            rows += killed_after(Trial(Path(scratch) / "moments", write_single), given.moments)
    bad = [row for row in rows if row["faults"]]
    print(f"{len(rows)} kills, {len(bad)} of them with faults")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
