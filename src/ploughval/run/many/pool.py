"""Processes that work on tests side by side: fed, heard, replaced where one dies, and ended.

They are told of tests, and tell of them, in lines of JSON (``worker.py``).
"""

import logging
import queue
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from ploughval.run.many.answers import LostError, result_of
from ploughval.run.many.child import Child, Task
from ploughval.watch import Progress

GRACE_S = 10.0
"""Between telling processes to stop and ending them, s."""
TURN_S = 0.5
"""A wait in which an interruption is heard on every system, s."""


@dataclass(frozen=True, slots=True)
class Hearers:
    """Who hears of tests, always in the thread that runs the pool.

    Attributes
    ----------
    finished : callable
        Gets the index of a test, and its outcome or error.
    watched : callable or None
        Gives, for the index of a test, who hears of its stages.
    """

    finished: Callable[[int, Any], None]
    watched: Callable[[int], Progress] | None = None


class Pool:
    """So many processes, each with so many threads.

    Parameters
    ----------
    job : str
        "module:function" that is called as ``function(folder, out=..., progress=..., **options)``.
    processes : int
        Processes side by side.
    threads : int
        Threads of each, for the libraries beneath.
    """

    def __init__(self, job: str, processes: int, threads: int) -> None:
        self._job, self._processes, self._threads = job, processes, threads
        self._tasks: queue.SimpleQueue[Task] = queue.SimpleQueue()
        self._events: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._children: list[Child] = []
        self._turn = threading.Lock()
        self._stopped = False

    def run(self, tasks: Sequence[Task], hearers: Hearers) -> None:
        """Work on all tasks; a process that dies costs the test it worked on, and another takes its place."""
        for task in tasks:
            self._tasks.put(task)
        slots = [
            threading.Thread(target=self._serve, args=(hearers,), daemon=True)
            for _ in range(min(self._processes, len(tasks)))
        ]
        try:
            for slot in slots:
                slot.start()
            left = len(slots)
            while left:
                try:
                    event = self._events.get(timeout=TURN_S)
                except queue.Empty:
                    continue
                if event is None:
                    left -= 1
                else:
                    event()
        finally:
            self._stop()
            for slot in slots:
                slot.join(timeout=GRACE_S)

    def _serve(self, hearers: Hearers) -> None:
        """In a thread of its own: see that what fails here is raised where the pool runs, and ends it."""
        try:
            self._give_tasks(hearers)
        except Exception as error:
            self._events.put(partial(_raised, error))
        finally:
            self._events.put(None)

    def _give_tasks(self, hearers: Hearers) -> None:
        """Give tasks to one process after the other, till none is left."""
        child: Child | None = None
        try:
            while (task := self._next()) is not None:
                try:
                    child = self._taken(task, child)
                except OSError as error:
                    self._finish(hearers, task, LostError(f"no process could be started: {error}"))
                    continue
                if not self._heard(child, task, hearers):
                    ending = child.end()
                    child = None
                    if not self._stopped:
                        self._finish(hearers, task, LostError(ending))
        finally:
            if child is not None:
                child.end()

    def _next(self) -> Task | None:
        try:
            return None if self._stopped else self._tasks.get_nowait()
        except queue.Empty:
            return None

    def _taken(self, task: Task, child: Child | None) -> Child:
        """The process that has taken a task: a new one where there is none, or it has died."""
        if child is not None:
            if child.give(task):
                return child
            child.end()
        with self._turn:
            if self._stopped:
                raise OSError("all is to stop")
            child = Child(self._job, self._threads, self._said)
            self._children.append(child)
        child.give(task)  # one that has died already tells nothing: the task is lost, as with a later death
        return child

    def _heard(self, child: Child, task: Task, hearers: Hearers) -> bool:
        """Pass on what a process tells of a task; whether it lived to answer."""
        hear = None if hearers.watched is None else hearers.watched(task.index)
        for told in child.told():
            if "answer" in told:
                self._finish(hearers, task, result_of(told["answer"]))
                return True
            if "log" in told:
                self._log(*told["log"])
            elif hear is not None:
                self._tell(hear, *told["progress"])
        return False

    def _finish(self, hearers: Hearers, task: Task, result: Any) -> None:
        self._events.put(lambda: hearers.finished(task.index, result))

    def _tell(self, hear: Progress, stage: str, done: int, total: int) -> None:
        self._events.put(lambda: hear(stage, done, total))

    def _said(self, text: str) -> None:
        self._log(logging.WARNING, __name__, text)

    def _log(self, level: int, name: str, text: str) -> None:
        self._events.put(lambda: logging.getLogger(name).log(level, "%s", text))

    def _stop(self) -> None:
        """End every process that is left: asked first, so that it takes its temporary files away."""
        with self._turn:
            self._stopped = True
        left = [child for child in self._children if child.process.poll() is None]
        until = time.monotonic() + GRACE_S
        try:
            for child in left:
                child.release()
            for child in left:
                child.process.wait(timeout=max(until - time.monotonic(), 0.0))
        except subprocess.TimeoutExpired:
            logging.getLogger(__name__).debug("a process did not end by itself")
        finally:
            for child in left:
                child.process.kill()


def _raised(error: Exception) -> None:
    raise error
