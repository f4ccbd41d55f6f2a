"""Runs a broken folder in a process of its own, with a limit of memory, and judges what it said and left."""

import ctypes
import hashlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from broken.base import Case

LIMIT_BYTES = 3 << 30
"""Address space of the process; what it may hold in memory is `PEAK_MB`."""
PEAK_MB = 2048
SECONDS = 60.0
"""What a folder may take on a machine that is shared; the table says what it took."""
_LIBC = ctypes.CDLL(None)
_DROP, _OVERRIDE, _READ_SEARCH = 24, 1, 2
"""PR_CAPBSET_DROP, and the powers by which root reads and writes what is closed (linux/capability.h)."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of one folder: exit code, seconds, peak of memory, faults of the judge."""

    name: str
    code: int
    seconds: float
    peak_MB: float
    said: str
    faults: tuple[str, ...]


def tree(folder: Path) -> dict[str, str]:
    """Every entry of a folder with its kind and contents, so that a change shows."""
    found: dict[str, str] = {}
    for path in sorted(folder.rglob("*")):
        state = path.lstat()
        mark = f"{state.st_mode:o} {state.st_size} {state.st_mtime_ns}"
        if path.is_symlink():
            mark += f" -> {path.readlink()}"
        elif path.is_file() and state.st_size < 1 << 22 and os.access(path, os.R_OK):
            mark += hashlib.sha256(path.read_bytes()).hexdigest()
        found[os.fsencode(path.relative_to(folder)).decode("latin-1")] = mark
    return found


def judge(case: Case, code: int, said: str, out: Path, changed: Sequence[str]) -> tuple[str, ...]:
    """What is wrong with how a folder was answered; empty where nothing is."""
    said = said.replace(str(out.parent), "")  # the place of a case is no answer
    faults = [] if code in case.codes else [f"exit code {code}; expected {case.codes}"]
    faults += [f"not said: {part!r}" for part in case.told if part not in said]
    faults += [
        f"said: {word}" for word in ("Traceback", "internal error", "fault in ploughval") if word in said
    ]
    faults += [f"changed: {name}" for name in changed]
    if code == 2:
        faults += [f"left in OUT: {path.name}" for path in out.glob("*") if path.name != ".store"]
        faults += [] if "refused: " in said else ["no word of refusal"]
    if code in (0, 1):
        faults += [f"not there: {name}" for name in case.kept if not _holds_numbers(out / name)]
    if (
        code == 1
        and (out / "run.json").is_file()
        and '"complete": false' not in (out / "run.json").read_text()
    ):
        faults.append("run.json says complete")
    return tuple(faults)


def _holds_numbers(path: Path) -> bool:
    if not path.is_file() or path.stat().st_size == 0:
        return False
    return path.suffix != ".csv" or len(path.read_text().splitlines()) > 1


def make(case: Case, sound: Path, place: Path) -> Path:
    """The broken folder, as ``place/in/<its name>``."""
    folder = place / "in" / case.folder
    shutil.rmtree(place, ignore_errors=True)
    folder.parent.mkdir(parents=True)
    shutil.copytree(sound, folder)
    case.spoil(folder)
    return folder


def run(case: Case, folder: Path, out: Path) -> Verdict:
    """Process a folder in a process of its own; without root's powers where the case is of permissions."""
    before = tree(folder.parent)
    command = [
        str(Path(sys.executable).with_name("ploughval")),
        "process",
        "--workers",
        "2",
        "--out",
        str(out),
        "--",
        str(folder),
    ]
    permissions = case.name.startswith("permission")
    heard = out.parent / "said.txt"
    start = time.perf_counter()
    with heard.open("wb") as file:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            preexec_fn=_limited_without_powers if permissions else _limited,
        )
    code, peak = _ended(process.pid, start)
    process.returncode = code
    seconds = time.perf_counter() - start
    after = tree(folder.parent)
    changed = sorted(k for k in before | after if before.get(k) != after.get(k))
    said = heard.read_text(encoding="utf-8", errors="backslashreplace")
    faults = [*judge(case, code, said, out, changed)]
    faults += [f"took {seconds:.0f} s"] if seconds > SECONDS else []
    faults += [f"held {peak:.0f} MB"] if peak > PEAK_MB else []
    return Verdict(case.name, code, seconds, peak, said, tuple(faults))


def _limited() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (LIMIT_BYTES, LIMIT_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _limited_without_powers() -> None:
    _limited()
    for power in (_OVERRIDE, _READ_SEARCH):  # refused to any other user, who has none
        _LIBC.prctl(_DROP, power, 0, 0, 0)


def _ended(pid: int, start: float) -> tuple[int, float]:
    """Exit code and peak of memory, MB, of a process; it is killed where it does not end by itself."""
    while True:
        done, status, usage = os.wait4(pid, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status), usage.ru_maxrss / 1024
        if time.perf_counter() - start > 4 * SECONDS:
            os.kill(pid, signal.SIGKILL)
            start = float("inf")
        time.sleep(0.02)
