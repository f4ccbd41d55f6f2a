"""Several tests: one after the other here, or side by side on a dask cluster."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

from ploughval.run.cluster import run_on_cluster
from ploughval.watch import Progress


class Job(Protocol):
    """Processes one test folder; has to be a module-level function for a cluster."""

    def __call__(self, folder: Path, out: Path | None, **options: Any) -> Any:
        """Process a folder into out (None: the folder's own results)."""


def result_folders(folders: Sequence[Path], out: Path | None) -> list[Path | None]:
    """Where each test's results go: OUT itself for one test, OUT/<folder name> for several.

    >>> result_folders([Path("a"), Path("b")], Path("o"))[1].as_posix()
    'o/b'
    >>> result_folders([Path("x/a"), Path("y/a")], Path("o"))[1].as_posix()
    'o/a-2'
    """
    if out is None:
        return [None] * len(folders)
    if len(folders) == 1:
        return [out]
    names: list[str] = []
    for folder in folders:
        name, count = folder.resolve().name, 1
        while (name if count == 1 else f"{name}-{count}") in names:
            count += 1
        names.append(name if count == 1 else f"{name}-{count}")
    return [out / name for name in names]


def run_all(
    job: Job,
    folders: Sequence[Path],
    *,
    out: Path | None,
    scheduler: str | None,
    finished: Callable[[int, Any], None],
    watched: Callable[[int], Progress] | None = None,
    **options: Any,
) -> None:
    """Run a job for each folder; ``finished(index, result or exception)`` is called for each.

    Parameters
    ----------
    job : callable
        ``job(folder, out, **options)``.
    folders : sequence of Path
        Test folders.
    out : Path or None
        As in :func:`result_folders`.
    scheduler : str or None
        Address of a dask scheduler; None: here, one after the other.
    finished : callable
        Gets the index of the folder and what the job returned or raised.
    watched : callable or None
        Gives, for the index of a folder, who hears of its stages; a cluster does not tell of them.
    **options
        Handed to every job.

    Raises
    ------
    MissingExtraError
        When a scheduler is named and dask.distributed is not installed.
    DataError
        When the scheduler does not answer.
    """
    targets = result_folders(folders, out)
    if scheduler is None:
        for index, (folder, target) in enumerate(zip(folders, targets, strict=True)):
            heard = {} if watched is None else {"progress": watched(index)}
            try:
                result = job(folder, target, **options, **heard)
            except Exception as error:
                finished(index, error)
            else:
                finished(index, result)
        return
    run_on_cluster(job, folders, targets, scheduler=scheduler, finished=finished, **options)
