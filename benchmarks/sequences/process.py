"""`ploughval process` in a process of its own: seconds, peak memory, what it said."""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_KIB = 1024.0


@dataclass(frozen=True, slots=True)
class Processed:
    """One run of the command.

    Attributes
    ----------
    exit_code : int
    seconds : float
        Start of the interpreter and the page included.
    peak_GB : float
        Largest resident memory of the process, 1e9 bytes.
    log : str
        What it wrote on both channels.
    results : Path
    """

    exit_code: int
    seconds: float
    peak_GB: float
    log: str
    results: Path

    @property
    def record(self) -> dict[str, Any]:
        """run.json, or an empty record where there is none."""
        path = self.results / "run.json"
        return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def process_afresh(folder: Path, *, workers: int = 2, results: Path | None = None) -> Processed:
    """Process a folder from the start, nothing kept from an earlier run."""
    results = folder / "results" if results is None else results
    command = [sys.executable, "-m", "ploughval.cli", "process", str(folder)]
    command += ["--fresh", "--workers", str(workers), "--out", str(results)]
    start = time.perf_counter()
    with tempfile.TemporaryFile("w+", encoding="utf-8") as channel:
        child = subprocess.Popen(command, stdout=channel, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(child.pid, 0)
        seconds = time.perf_counter() - start
        child.returncode = os.waitstatus_to_exitcode(status)
        channel.seek(0)
        text = channel.read()
    return Processed(child.returncode, seconds, usage.ru_maxrss * _KIB / 1e9, text, results)
