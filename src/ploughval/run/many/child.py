"""A process that works on tests, from the outside: started, given tasks, listened to, let go."""

import json
import logging
import os
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
    "OPENCV_FOR_THREADS_NUM",
)
"""Variables that say how many threads the libraries beneath use."""
LINE_BYTES = 65536
"""Of the error stream, that are kept in memory at a time."""
KEPT_LINES = 3
"""Of the error stream, to say what a process last said."""


@dataclass(frozen=True, slots=True)
class Task:
    """One test for a process."""

    index: int
    folder: str
    out: str | None
    options: dict[str, Any]

    def line(self) -> bytes:
        """As it is told to a process."""
        told = {"folder": self.folder, "out": self.out, "options": self.options}
        return json.dumps(told).encode() + b"\n"


class Child:
    """A process of ``worker.py``.

    Parameters
    ----------
    job : str
        "module:function" that it calls.
    threads : int
        Threads for the libraries beneath, unless the environment says how many.
    said : callable
        Gets each line of its error stream, in another thread.

    Raises
    ------
    OSError
        When the system has no room for another process.
    """

    def __init__(self, job: str, threads: int, said: Callable[[str], None]) -> None:
        level = logging.getLogger("ploughval").getEffectiveLevel()
        self.process = subprocess.Popen(
            # -P: nothing is imported from the working folder
            [sys.executable, "-P", "-m", "ploughval.run.many.worker", job, str(level)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={name: str(threads) for name in THREADS} | os.environ,
        )
        self._last: deque[str] = deque(maxlen=KEPT_LINES)
        self._said = said
        self._reader = threading.Thread(target=self._read_errors, daemon=True)
        self._reader.start()

    def _read_errors(self) -> None:
        assert self.process.stderr is not None
        for line in iter(partial(self.process.stderr.readline, LINE_BYTES), b""):
            text = line.decode(errors="replace").rstrip()
            self._last.append(text)
            self._said(text)

    def give(self, task: Task) -> bool:
        """Hand over a task; whether the process was there to take it."""
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(task.line())
            self.process.stdin.flush()
        except OSError:
            return False
        return True

    def told(self) -> Iterator[dict[str, Any]]:
        """What it tells, until it ends; other lines, printed before it had its channel, are said instead."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if not line.endswith(b"\n"):  # it died while it wrote
                return
            told = _mapping(line)
            if told is None:
                self._said(line.decode(errors="replace").rstrip())
            else:
                yield told

    def release(self) -> None:
        """Nothing more will come: let it end; what it is in the middle of, it gives up."""
        assert self.process.stdin is not None
        try:
            self.process.stdin.close()
        except OSError:  # it has gone
            return

    def end(self) -> str:
        """Let it end, wait for that, and say how it ended."""
        self.release()
        code = self.process.wait()
        self._reader.join()
        for stream in (self.process.stdout, self.process.stderr):
            assert stream is not None
            stream.close()
        return " | ".join([ending(code), *self._last])


def _mapping(line: bytes) -> dict[str, Any] | None:
    try:
        told = json.loads(line)
    except ValueError:
        return None
    return told if isinstance(told, dict) else None


def ending(code: int) -> str:
    """What the exit code of a process says.

    >>> ending(-9)
    'SIGKILL (the system does so where memory is short)'
    >>> ending(3)
    'exit code 3'
    """
    try:
        name = signal.Signals(-code).name
    except ValueError:
        return f"exit code {code}"
    return f"{name} (the system does so where memory is short)" if name == "SIGKILL" else name
