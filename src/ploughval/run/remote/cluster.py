"""Tests and ranges of their frames on a dask cluster that is there."""

import logging
import queue
import threading
import time
from asyncio import CancelledError
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any
from uuid import uuid4

from ploughval.errors import DataError, MissingExtraError
from ploughval.quiet import hushed
from ploughval.run.many.answers import ElsewhereError, result_of
from ploughval.run.many.child import Task
from ploughval.run.many.pool import Hearers
from ploughval.run.remote import cluster_work
from ploughval.run.remote.ranges import Pace, Reached
from ploughval.run.remote.staging import copy_name
from ploughval.run.urls import is_url, joined, shown

ANSWER_S = 10
"""How long a scheduler has to answer, s."""
WORKERS_S = 30
"""How long to wait for a first worker, s."""
HEARD_S = 60.0
"""How long workers have to say what they are: one that compiles is deaf meanwhile, s."""
TIDY_S = 10.0
"""How long is waited at the end for workers that remove copies, s."""
TURN_S = 5.0
"""Between two looks whether there still are workers, s."""
STAYS = "what is done stays: run it again to go on"
_TOLD = 3  # workers that a message names


def run_on_cluster(
    job: str, tasks: Sequence[Task], hearers: Hearers, *, scheduler: str, pace: Pace | None = None
) -> None:
    """Work on tests on a cluster, range by range of their frames; what becomes of each is heard as it ends.

    A worker that dies costs the range that it worked on: dask gives it to another, which goes on from what
    the ranges before it kept.

    Parameters
    ----------
    job : str
        "module:function" that is called as ``function(folder, out=, workers=, progress=)``.
    tasks : sequence of Task
        The tests; of their options ``fresh`` counts.
    hearers : Hearers
        Who hears of their stages and their ends.
    scheduler : str
        Address of a dask scheduler.
    pace : Pace or None
        How long a range is.

    Raises
    ------
    MissingExtraError
        When dask.distributed is not installed.
    DataError
        When the scheduler does not answer, has no workers, or one of them has other versions.
    """
    with hushed("distributed.client", logging.CRITICAL):  # a lost scheduler or worker is told here
        client = _connected(scheduler)
        try:
            _refuse_workers(client, scheduler)
            ClusterRun(client, job, hearers, pace or Pace()).all(tasks)
        finally:
            client.close()


@dataclass(slots=True)
class _Test:
    """A test on its way: what workers are told of it, which of them had it, and how far it is."""

    task: Task
    told: dict[str, Any]
    beacon: Path | None
    workers: list[str] = field(default_factory=list)
    frames: int = 0
    alone: bool = False  # no other is worked on meanwhile


class ClusterRun:
    """Gives ranges to a cluster and hears what became of them.

    As many tests are on their way as the cluster has threads. When a worker dies dask blames all that was
    assigned to it: a test that it gives up is tried once more alone, so that it is the one to blame.

    Parameters
    ----------
    client : distributed.Client
    job : str
        As of :func:`run_on_cluster`, like the others.
    hearers : Hearers
    pace : Pace
    """

    def __init__(self, client: Any, job: str, hearers: Hearers, pace: Pace) -> None:
        self._client, self._job, self._hearers, self._pace = client, job, hearers, pace
        self._name = f"ploughval-{uuid4().hex[:12]}"
        self._identity = cluster_work.identity()
        self._waiting: deque[Task] = deque()
        self._suspects: deque[_Test] = deque()
        self._going: dict[str, tuple[_Test, Any]] = {}
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._tidying: list[Asked] = []

    def all(self, tasks: Sequence[Task]) -> None:
        """Work on all of them."""
        self._waiting.extend(tasks)
        try:
            while self._fill():
                future = self._next()
                if future is None:
                    return self._give_up(f"no worker was there for {WORKERS_S} s")
                if future.status not in ("finished", "error"):
                    return self._give_up("the connection to the scheduler was lost")
                self._take(self._going.pop(future.key)[0], future)
                # else dask works on it again when the worker dies that has its answer
                del future
        finally:
            for test, _ in self._going.values():
                _unlit(test)
            until = time.monotonic() + TIDY_S
            for asked in self._tidying:
                asked.answer(max(until - time.monotonic(), 0.0))

    def _fill(self) -> bool:
        """Hand over tests as far as there are threads for them; whether one is on its way."""
        if self._waiting and not any(test.alone for test, _ in self._going.values()):
            room = max(self._threads(), 1)  # without a worker one test waits for the next
            while self._waiting and len(self._going) < room:
                self._submit(self._begun(self._waiting.popleft()))
        if self._suspects and not self._going:
            self._submit(replace(self._suspects.popleft(), alone=True))
        return bool(self._going)

    def _next(self) -> Any:
        """The next range that ended; None where no worker is there for long."""
        without_s = 0.0
        while without_s < WORKERS_S:
            try:
                return self._done.get(timeout=TURN_S)
            except queue.Empty:
                without_s = 0.0 if self._threads() else without_s + TURN_S
        return None

    def _threads(self) -> int:
        try:
            return sum(self._client.ncores().values())
        except Exception:  # whatever it is, the ranges that are on their way end with it
            return 0

    def _give_up(self, why: str) -> None:
        """Tell of all tests that are left why nothing becomes of them."""
        tests = [test for test, _ in self._going.values()] + list(self._suspects)
        for test in tests:
            _unlit(test)
        left = [*(test.task for test in tests), *self._waiting]
        for task in sorted(left, key=lambda one: one.index):
            error = DataError(f"not done: {why}; {STAYS}", path=shown(task.folder))
            self._hearers.finished(task.index, error)

    def _begun(self, task: Task) -> _Test:
        folder = task.folder if is_url(task.folder) else str(Path(task.folder).resolve())
        out = str(joined(folder, "results")) if task.out is None else task.out
        out = out if is_url(out) else str(Path(out).resolve())
        beacon = _beacon(folder, out)
        told = {
            "job": self._job,
            "folder": folder,
            "out": out,
            "frame": self._pace.first_frames,
            "fresh": bool(task.options.get("fresh")),
            "identity": self._identity,
            "settings": cluster_work.settings_digest(folder),
            "seen": "" if beacon is None else str(beacon),
        }
        return _Test(task, told, beacon)

    def _submit(self, test: _Test) -> None:
        """Hand a range over: earlier tests first, where the last range was, if that worker is still there."""
        alone = "-alone" if test.alone else ""
        key = f"{self._name}-{test.task.index}-{test.told['frame']}{alone}"
        last = test.workers[-1:]
        kept = {"workers": last, "allow_other_workers": True} if last else {}
        options = {"key": key, "pure": False, "priority": -test.task.index, **kept}
        future = self._client.submit(cluster_work.work, test.told, **options)
        self._going[key] = test, future
        future.add_done_callback(self._done.put)

    def _take(self, test: _Test, future: Any) -> None:
        """Take in what became of a range, and hand over what follows it."""
        if future.status == "error":
            return self._blame(test, future.exception())
        answer = dict(future.result())
        worker = answer.pop(cluster_work.WORKER)
        test.workers = [*(w for w in test.workers if w != worker), worker]
        if cluster_work.RANGE not in answer:
            return self._end(test, result_of(answer))
        reached = Reached(**answer[cluster_work.RANGE])
        test.frames = max(test.frames, reached.frames)
        self._tell(test, reached.frame)
        test.alone = False  # it has not killed its worker in this range
        test.told = {**test.told, "frame": self._pace.after(reached), "fresh": False}
        return self._submit(test)

    def _blame(self, test: _Test, error: BaseException) -> None:
        """Try a test once more alone when workers died, maybe at another one; then give it up."""
        if type(error).__name__ != "KilledWorker":
            return self._end(test, ElsewhereError(f"{type(error).__name__}: {error}"))
        if not test.alone:
            self._suspects.append(test)
            return None
        told = "given up: one worker after the other died at it"
        remedy = "give workers more memory, or look into their logs"
        return self._end(test, DataError(f"{told}; {remedy}; {STAYS}", path=shown(test.told["folder"])))

    def _tell(self, test: _Test, frame: int) -> None:
        if self._hearers.watched is not None and test.frames:
            self._hearers.watched(test.task.index)("photographs", frame, test.frames)

    def _end(self, test: _Test, result: Any) -> None:
        _unlit(test)
        if test.frames:
            self._tell(test, test.frames)
        if is_url(test.told["folder"]) or is_url(test.told["out"]):
            self._forget(test)
        self._hearers.finished(test.task.index, result)

    def _forget(self, test: _Test) -> None:
        """Let workers that had earlier ranges of a test remove their copies; the last one has done so."""
        there = set(self._client.ncores())
        others = [worker for worker in test.workers if worker in there]
        if others:
            copy = copy_name(test.told["folder"], test.told["out"])
            self._tidying.append(Asked(self._client, cluster_work.forget, copy, workers=others))


class Asked:
    """A call of a function on workers that is not waited for without end, as dask would for a frozen worker.

    Parameters
    ----------
    client : distributed.Client
    function : callable
    *args
        Of the function.
    workers : list of str or None
        Addresses; None: all.
    """

    def __init__(
        self, client: Any, function: Callable[..., Any], *args: str, workers: list[str] | None = None
    ) -> None:
        self._answers: list[dict[str, Any]] = []
        call = partial(client.run, function, *args, workers=workers, on_error="return")
        self._thread = threading.Thread(target=self._call, args=(call,), daemon=True)
        self._thread.start()

    def _call(self, call: Callable[[], dict[str, Any]]) -> None:
        with suppress(Exception, CancelledError):  # a client that is closed meanwhile
            self._answers.append(call())

    def answer(self, patience_s: float) -> dict[str, Any] | None:
        """What each worker returned or raised, by its address; None without an answer in time."""
        self._thread.join(patience_s)
        return self._answers[0] if self._answers else None


def _connected(address: str) -> Any:
    try:
        distributed: Any = import_module("distributed")  # an extra: not there in a plain installation
    except ImportError:
        raise MissingExtraError("distributed", "cluster", "--scheduler") from None
    try:
        return distributed.Client(address, timeout=ANSWER_S, set_as_default=False)
    except (
        OSError,
        ValueError,
        TypeError,
        RuntimeError,
    ) as error:  # the latter two: tls:// without its files
        raise DataError(
            f"the dask scheduler does not answer ({error}); start one or leave --scheduler out", path=address
        ) from None


def _refuse_workers(client: Any, address: str) -> None:
    """Refuse a cluster without workers, or with one that has other code or versions.

    Raises
    ------
    DataError
        Naming the first few of them; or when they do not answer.
    """
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except TimeoutError:
        raise DataError(
            f"has no workers after {WORKERS_S} s; start some: dask worker {address} --nthreads 1",
            path=address,
        ) from None
    here, faults = cluster_work.identity(), []
    told = Asked(client, cluster_work.identity).answer(HEARD_S)
    if told is None:
        raise DataError(
            f"not all workers answer within {HEARD_S:g} s; look into their logs, start those again that hang",
            path=address,
        )
    for worker, there in told.items():
        if isinstance(there, Exception):
            faults.append(f"{worker} cannot import it ({type(there).__name__}: {there})")
        elif unlike := cluster_work.differences(there, here):
            faults.append(f"{worker} ({unlike})")
    if faults:
        more = f" and {len(faults) - _TOLD} more" if len(faults) > _TOLD else ""
        raise DataError(
            f"workers do not have the ploughval that this machine has: {'; '.join(faults[:_TOLD])}{more}; "
            f"{cluster_work.SAME}",
            path=address,
        )


def _beacon(folder: str, out: str) -> Path | None:
    """A file in a result folder apart from its test by which workers tell that they see the same folder."""
    if is_url(out) or (not is_url(folder) and Path(out).is_relative_to(folder)):
        return None
    path = Path(out) / f".seen-{uuid4().hex}"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    except OSError:  # only workers can write there, if anyone can
        return None
    return path


def _unlit(test: _Test) -> None:
    """Take a beacon away, and the folder that was made for it alone."""
    if test.beacon is not None:
        with suppress(OSError):
            test.beacon.unlink(missing_ok=True)
            test.beacon.parent.rmdir()
