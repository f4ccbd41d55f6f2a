"""Tests and ranges of their frames on a dask cluster that is there."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any
from uuid import uuid4

from ploughval.errors import DataError, MissingExtraError
from ploughval.run import cluster_work
from ploughval.run.answers import ElsewhereError, result_of
from ploughval.run.child import Task
from ploughval.run.pool import Hearers
from ploughval.run.ranges import Pace, Reached
from ploughval.run.urls import is_url, joined, shown

ANSWER_S = 10
"""How long a scheduler has to answer, s."""
WORKERS_S = 30
"""How long to wait for a first worker, s."""
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
    client = _connected(scheduler)
    try:
        _refuse_workers(client, scheduler)
        _Run(client, job, hearers, pace or Pace()).all(tasks)
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


class _Run:
    """Gives ranges to a cluster and hears what became of them."""

    def __init__(self, client: Any, job: str, hearers: Hearers, pace: Pace) -> None:
        self._client, self._job, self._hearers, self._pace = client, job, hearers, pace
        self._name = f"ploughval-{uuid4().hex[:12]}"
        self._identity = cluster_work.identity()
        self._going: dict[str, _Test] = {}

    def all(self, tasks: Sequence[Task]) -> None:
        """Work on all of them."""
        distributed: Any = import_module("distributed")
        try:
            first = [self._submit(self._begun(task)) for task in tasks]
            futures = distributed.as_completed(first, loop=self._client.loop)
            del first
            for future in futures:
                test = self._going.pop(future.key)
                following = self._taken(test, future)
                if following is not None:
                    futures.add(following)
        finally:
            for test in self._going.values():
                _unlit(test)

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

    def _submit(self, test: _Test) -> Any:
        """Hand a range over: earlier tests first, where the last range was, if that worker is still there."""
        key = f"{self._name}-{test.task.index}-{test.told['frame']}"
        self._going[key] = test
        last = test.workers[-1:]
        kept = {"workers": last, "allow_other_workers": True} if last else {}
        options = {"key": key, "pure": False, "priority": -test.task.index, **kept}
        return self._client.submit(cluster_work.work, test.told, **options)

    def _taken(self, test: _Test, future: Any) -> Any:
        """Take in what became of a range; what follows it, or None at the end of the test."""
        answer = _answer(future, test.told["folder"])
        if isinstance(answer, Exception):
            return self._end(test, answer)
        worker = answer.pop(cluster_work.WORKER)
        test.workers = [*(w for w in test.workers if w != worker), worker]
        if cluster_work.RANGE not in answer:
            return self._end(test, result_of(answer))
        reached = Reached(**answer[cluster_work.RANGE])
        test.frames = max(test.frames, reached.frames)
        self._tell(test, reached.frame)
        test.told = {**test.told, "frame": self._pace.after(reached), "fresh": False}
        return self._submit(test)

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
            places = test.told["folder"], test.told["out"]
            self._client.run(cluster_work.forget, *places, workers=others, on_error="ignore")


def _answer(future: Any, folder: str) -> dict[str, Any] | Exception:
    """What a worker answered, or how there is no answer."""
    if future.status == "finished":
        return dict(future.result())
    stays = "what is done stays: run it again to go on"
    if future.status != "error":
        return DataError(f"the connection to the scheduler was lost; {stays}", path=shown(folder))
    error = future.exception()
    if type(error).__name__ == "KilledWorker":
        remedy = "give workers more memory, or look into their logs"
        last = error.last_worker.address
        told = f"given up, for one worker after the other died at it, the last of them {last}"
        return DataError(f"{told}; {remedy}; {stays}", path=shown(folder))
    return ElsewhereError(f"{type(error).__name__}: {error}")


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
        Naming the first few of them.
    """
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except TimeoutError:
        raise DataError(
            f"has no workers after {WORKERS_S} s; start some: dask worker {address} --nthreads 1",
            path=address,
        ) from None
    here, faults = cluster_work.identity(), []
    for worker, there in client.run(cluster_work.identity, on_error="return").items():
        if isinstance(there, Exception):
            faults.append(f"{worker} cannot import it ({type(there).__name__}: {there})")
        elif told := cluster_work.differences(there, here):
            faults.append(f"{worker} ({told})")
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
