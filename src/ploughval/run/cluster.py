"""Several tests side by side on a dask cluster that is there."""

from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from ploughval.errors import DataError, MissingExtraError


def run_on_cluster(
    job: Callable[..., Any],
    folders: Sequence[Path],
    targets: Sequence[Path | None],
    *,
    scheduler: str,
    finished: Callable[[int, Any], None],
    **options: Any,
) -> None:
    """Run a job for each folder on a cluster; ``finished(index, result or exception)`` is called for each.

    Parameters
    ----------
    job : callable
        ``job(folder, out, **options)``, at module level.
    folders, targets : sequence of Path
        Test folders, and where the results of each go (None: the folder's own results).
    scheduler : str
        Address of a dask scheduler.
    finished : callable
        Gets the index of the folder and what the job returned or raised.
    **options
        Handed to every job.

    Raises
    ------
    MissingExtraError
        When dask.distributed is not installed.
    DataError
        When the scheduler does not answer.
    """
    client = _connect(scheduler)
    try:
        futures = [
            client.submit(partial(job, **options), folder.resolve(), target and target.resolve(), pure=False)
            for folder, target in zip(folders, targets, strict=True)
        ]
        for index, future in enumerate(futures):
            failure = future.exception()
            finished(index, failure if failure is not None else future.result())
    finally:
        client.close()


def _connect(address: str) -> Any:
    try:
        distributed: Any = import_module("distributed")  # an extra: not there in a plain installation
    except ImportError:
        raise MissingExtraError("distributed", "cluster", "--scheduler") from None
    try:
        return distributed.Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise DataError(
            f"the dask scheduler does not answer ({error}); start one or leave --scheduler out", path=address
        ) from None
