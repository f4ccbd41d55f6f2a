"""A process that works on tests: ``python -m ploughval.run.many.worker MODULE:FUNCTION LEVEL``.

A task is a line of JSON on the input: ``{"folder", "out", "options"}``. The output has lines of JSON:
``{"progress"}``, ``{"log"}``, and at the end of each task ``{"answer"}``. What else is printed goes to the
error stream. When the input ends the process ends: where it is idle at once, where it works as if
interrupted.
"""

import io
import json
import logging
import os
import queue
import signal
import sys
import threading
import time
from _thread import interrupt_main
from collections.abc import Callable
from importlib import import_module
from types import FrameType
from typing import Any

from ploughval.run.many.answers import answer_of

GRACE_S = 10.0
"""Between being interrupted and a hard end, s."""
ENDED = 143
"""Exit code of a worker that was told to stop in the middle."""
Send = Callable[[dict[str, Any]], None]


class Channel:
    """Lines of JSON to whoever started this process, from any thread; its end is not heard here."""

    def __init__(self, descriptor: int) -> None:
        self._file = os.fdopen(descriptor, "w", encoding="ascii", newline="\n")
        self._turn = threading.Lock()

    def send(self, told: dict[str, Any]) -> None:
        """Write a mapping as one line."""
        with self._turn:
            try:
                self._file.write(json.dumps(told) + "\n")
                self._file.flush()
            except BrokenPipeError:  # then the input ends too, which ends this process
                return


class _Forward(logging.Handler):
    """Sends lines of the log."""

    def __init__(self, send: Send) -> None:
        super().__init__()
        self._send = send

    def emit(self, record: logging.LogRecord) -> None:
        self._send({"log": [record.levelno, record.name, self.format(record)]})


class Worker:
    """Does one task after the other until its input ends.

    Parameters
    ----------
    job : callable
        ``job(folder, out=..., progress=..., **options)``.
    send : callable
        Takes the mappings that go back.
    """

    def __init__(self, job: Callable[..., Any], send: Send) -> None:
        self._job, self._send = job, send
        self._tasks: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
        self._busy = threading.Event()

    def listen(self) -> None:
        """Take tasks from the input until it ends; then stop what goes on."""
        # unbuffered: a thread that waits in sys.stdin would hold up the end of the interpreter
        for line in io.FileIO(0, closefd=False):
            self._busy.set()  # here, so that an end of the input right after it is not missed
            self._tasks.put(json.loads(line))
        self._tasks.put(None)
        if self._busy.is_set():
            _interrupt()
            time.sleep(GRACE_S)
            os._exit(ENDED)

    def work(self) -> None:
        """Do tasks as they come."""
        for task in iter(self._tasks.get, None):
            answer = self._answer(task)
            self._busy.clear()
            self._send({"answer": answer})

    def _answer(self, task: dict[str, Any]) -> dict[str, Any]:
        def progress(stage: str, done: int, total: int) -> None:
            self._send({"progress": [stage, done, total]})

        try:
            result = self._job(task["folder"], out=task["out"], progress=progress, **task["options"])
        except Exception as error:
            logging.getLogger(__name__).debug("internal error", exc_info=True)
            result = error
        return answer_of(result)


def _interrupt() -> None:
    """Raise in the main thread, also where it waits for something, as far as the system can do that."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGTERM)
    else:
        interrupt_main(signal.SIGTERM)


def _stop(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def main(job: str, level: str) -> int:
    """Work until the input ends; the exit code."""
    channel = Channel(os.dup(1))
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of the terminal: whoever started this process decides
    signal.signal(signal.SIGTERM, _stop)
    logging.basicConfig(level=logging.WARNING, format="%(message)s", handlers=[_Forward(channel.send)])
    logging.getLogger("ploughval").setLevel(int(level))
    logging.captureWarnings(True)
    module, _, function = job.partition(":")
    try:
        worker = Worker(getattr(import_module(module), function), channel.send)
        threading.Thread(target=worker.listen, daemon=True).start()
        worker.work()
    except KeyboardInterrupt:
        return ENDED
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
