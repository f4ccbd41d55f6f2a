"""What a worker of a dask cluster does: a range of frames of a test, told and answered as plain values."""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ploughval.errors import DataError
from ploughval.run import provenance
from ploughval.run.kept.lock import wait_for
from ploughval.run.many.answers import answer_of
from ploughval.run.many.places import SETTINGS, folder_of
from ploughval.run.outcome import Outcome
from ploughval.run.remote.ranges import Reached, advance
from ploughval.run.remote.staging import Staged, copy_name, remove_copy
from ploughval.run.urls import is_url, without_secrets

RANGE, WORKER = "range", "worker"
HELD_S = 100.0
"""How long a worker waits for a result folder: the last one that had the test may be cut off from the cluster
and still at work on its range, or be dead without the server of the files knowing (NFS: 90 s), s."""
_ONE = threading.Lock()  # a process works on one test at a time: figures and caches are the process's
_COPIES = threading.Lock()  # held to begin with a copy, and to remove one
_in_use: set[str] = set()


def identity() -> dict[str, str]:
    """What has to be the same on every machine for the same numbers: code and versions."""
    there = {"code": provenance.code_digest(), **provenance.versions()}
    return {**there, "dask": version("dask"), "distributed": version("distributed")}


def differences(there: dict[str, str], here: dict[str, str]) -> str:
    """In what two identities differ, in words; empty where they do not.

    >>> differences({"numpy": "2.1", "code": "a"}, {"numpy": "2.4", "code": "b"})
    "numpy 2.1 there, 2.4 here, ploughval's own code"
    """
    versions = sorted({*there, *here} - {"code"})
    told = [f"{n} {there.get(n)} there, {here.get(n)} here" for n in versions if there.get(n) != here.get(n)]
    return ", ".join([*told, *["ploughval's own code"] * (there.get("code") != here.get("code"))])


def settings_digest(folder: str) -> str:
    """SHA-256 of a test's settings as this machine sees them; empty for a URL."""
    return "" if is_url(folder) else provenance.file_digest(Path(folder_of(folder)) / SETTINGS)


def work(told: dict[str, Any]) -> dict[str, Any]:
    """Work on a test up to a frame; what became of that, as values that JSON holds.

    Parameters
    ----------
    told : dict
        job ("module:function"), folder, out, frame, fresh; identity and settings as they are where the run
        was started, and seen, a file that can be seen from there, or empty.
    """
    distributed: Any = import_module("distributed")
    worker = distributed.get_worker()
    try:
        with _ONE:
            answer = _advance(told, worker)
    except Exception as error:  # every error is an answer: dask would print what it was told, secrets too
        logging.getLogger(__name__).debug("internal error", exc_info=True)
        places = told["folder"], told["out"]
        texts = {kind: without_secrets(text, *places) for kind, text in answer_of(error).items()}
        return {WORKER: worker.address, **texts}
    if isinstance(answer, Reached):
        return {WORKER: worker.address, RANGE: asdict(answer)}
    return {WORKER: worker.address, **answer_of(answer)}


def forget(copy: str, *, dask_worker: Any) -> None:
    """Remove the copy of a test, by its name, from this worker's disk, unless a range is worked on in it.

    So it is where this worker had been cut off: the range was given to another, and both are at work on it.
    """
    with _COPIES:
        if copy not in _in_use:
            remove_copy(Path(dask_worker.local_directory), copy)


@contextmanager
def _using(copy: str) -> Iterator[None]:
    with _COPIES:
        _in_use.add(copy)
    try:
        yield
    finally:
        _in_use.discard(copy)


def _advance(told: dict[str, Any], worker: Any) -> Reached | Outcome:
    refuse_other(told["identity"], worker.address)
    refuse_unseen(told, worker.address)
    module, _, function = told["job"].partition(":")
    job = getattr(import_module(module), function)
    staged = Staged(told["folder"], told["out"], Path(worker.local_directory))
    answer: Reached | Outcome | None = None
    with _using(copy_name(told["folder"], told["out"])):
        try:
            wait_for(staged.out, HELD_S)
            threads = worker.state.nthreads
            answer = advance(job, staged, told["frame"], workers=threads, fresh=told["fresh"])
        finally:
            if not isinstance(answer, Reached):
                staged.remove()
    return answer


def refuse_other(here: dict[str, str], worker: str) -> None:
    """Refuse to work for a run of other code or versions.

    Raises
    ------
    DataError
        Saying in what they differ.
    """
    told = differences(identity(), here)
    if told:
        raise DataError(f"does not have what this machine has ({told}); {SAME}", path=worker)


SAME = "install the same versions on both, so that the numbers are the same"


def refuse_unseen(told: dict[str, Any], worker: str) -> None:
    """Refuse a test that this worker does not see as the machine does that started the run.

    Raises
    ------
    DataError
        Naming the folder.
    """
    remedy = "put it on a file system that both share, or name it by a URL"
    digest = settings_digest(told["folder"])
    if digest != told["settings"]:
        what = "is not seen" if digest == "unreadable" else f"holds another {SETTINGS}"
        raise DataError(f"{what} on the worker {worker}; {remedy}", path=told["folder"])
    if told["seen"] and not Path(told["seen"]).is_file():
        raise DataError(f"is not the same folder on the worker {worker}; {remedy}", path=told["out"])
