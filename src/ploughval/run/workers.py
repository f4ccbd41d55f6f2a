"""Several tests: one after the other here, side by side in processes, or on a dask cluster."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from ploughval.limits import size_in_words
from ploughval.run.many.child import Task
from ploughval.run.many.machine import free_bytes
from ploughval.run.many.needs import needed_bytes
from ploughval.run.many.places import refuse_doubles, result_folders
from ploughval.run.many.pool import Hearers, Pool


class Job(Protocol):
    """Processes one test; a function at module level, so that other processes can be told of it by name."""

    __module__: str
    __qualname__: str

    def __call__(self, folder: str, *, out: str | None, **options: Any) -> Any:
        """Process a folder into out (None: the folder's own results)."""


@dataclass(frozen=True, slots=True)
class Share:
    """How tests share this machine.

    Attributes
    ----------
    processes : int
        Tests side by side, each in a process of its own; 1: one after the other in this process.
    threads : int
        Threads of each test.
    remark : str
        Why fewer than could be, where that is so.
    """

    processes: int
    threads: int
    remark: str = ""


def share_of(folders: Sequence[str], workers: int) -> Share:
    """Share threads among tests: a process for each as far as threads, tests and memory go.

    Parameters
    ----------
    folders : sequence of str
        Test folders.
    workers : int
        Threads in all.
    """
    most = min(workers, len(folders))
    if most == 1:
        return Share(1, workers)
    needed, free = max(needed_bytes(folder) for folder in folders), free_bytes()
    fitting = most if free is None else min(max(free // needed, 1), most)
    remark = ""
    if fitting < most:
        remark = (
            f"{fitting} of {most} tests side by side: one may take {size_in_words(needed)}, "
            f"and {size_in_words(free or 0)} of memory are free"
        )
    return Share(fitting, workers // fitting, remark)


def run_all(
    job: Job,
    folders: Sequence[str],
    hearers: Hearers,
    *,
    out: str | None = None,
    share: Share = Share(1, 1),
    scheduler: str | None = None,
    **options: Any,
) -> None:
    """Run a job for each folder; what becomes of each is heard as it ends, in whatever order.

    Parameters
    ----------
    job : callable
        ``job(folder, out=..., **options)``.
    folders : sequence of str
        Test folders.
    hearers : Hearers
        Who hears of their stages and their ends.
    out : str or None
        As in :func:`result_folders`.
    share : Share
        How they share this machine.
    scheduler : str or None
        Address of a dask scheduler, which then shares the work instead.
    **options
        Handed to every job; values that JSON holds.

    Raises
    ------
    ConfigError
        When a test is given twice, or two would write into one folder; then none is run.
    MissingExtraError
        When a scheduler is named and dask.distributed is not installed.
    DataError
        When the scheduler does not answer.
    """
    targets = result_folders(folders, out)
    refuse_doubles(folders, targets)
    threads = {} if scheduler else {"workers": share.threads}
    tasks = [
        Task(index, folder, target, {**options, **threads})
        for index, (folder, target) in enumerate(zip(folders, targets, strict=True))
    ]
    name = f"{job.__module__}:{job.__qualname__}"
    if scheduler is not None:
        from ploughval.run.remote.cluster import run_on_cluster

        run_on_cluster(name, tasks, hearers, scheduler=scheduler)
        return
    if share.processes > 1:
        Pool(name, share.processes, share.threads).run(tasks, hearers)
        return
    for task in tasks:
        hearers.finished(task.index, _done_here(job, task, hearers))


def _done_here(job: Job, task: Task, hearers: Hearers) -> Any:
    """What a job returns or raises in this process."""
    heard = {} if hearers.watched is None else {"progress": hearers.watched(task.index)}
    try:
        return job(task.folder, out=task.out, **task.options, **heard)
    except Exception as error:
        return error
