"""One run at a time in a result folder: a lock that the system takes back when its holder dies."""

import errno
import json
import logging
import os
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

from ploughval.disk import unwritable
from ploughval.errors import DataError
from ploughval.run.kept.store import CACHE

LOCK = "lock"
_NONE_HERE = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL, errno.EPERM}
"""A file system, often of a network, that has no locks."""
_TAKEN = {errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES, errno.EDEADLK}
_FAR = 1 << 30  # byte that is locked where a lock keeps others from reading what it covers
_TURN_S = 0.2  # between two looks whether a folder is free
_TRIES = 100  # to make the folder beside holders who take it back
_log = logging.getLogger(__name__)


class HeldError(DataError):
    """Another run holds the folder."""


@contextmanager
def locked(results: Path) -> Iterator[None]:
    """Hold a result folder for one run.

    The lock belongs to the open file: it ends with the process, however that dies, so that no stale lock
    is ever to be removed by hand. Where the file system has no locks the run goes on, with a warning in the
    log. What was made for the lock alone is gone at the end.

    Parameters
    ----------
    results : Path
        Result folder; made when missing.

    Raises
    ------
    HeldError
        When another run holds the folder, saying which.
    DataError
        When the folder cannot be written.
    """
    path, there = results / CACHE / LOCK, results.is_dir()
    with unwritable(path):
        file = _own(path)
    try:
        yield
    finally:
        _leave(path, file)
        if not there:
            with suppress(OSError):
                results.rmdir()


def wait_for(results: Path, patience_s: float) -> None:
    """Wait until no run holds a result folder.

    Parameters
    ----------
    results : Path
        Result folder.
    patience_s : float
        For how long, s.

    Raises
    ------
    HeldError
        When one holds it still.
    """
    until = time.monotonic() + patience_s
    while True:
        try:
            with locked(results):
                return
        except HeldError:
            if time.monotonic() > until:
                raise
        time.sleep(_TURN_S)


def _own(path: Path) -> int:
    """Open the lock's file and take it; what its last holder takes back meanwhile is made anew."""
    tries = 0
    while True:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except (FileNotFoundError, FileExistsError):  # also where a folder goes while it is being made
            tries += 1
            if tries == _TRIES:
                raise
            continue
        try:
            has_locks = _take(path, file)
            if not has_locks or _is_same(path, file):
                _sign(file)
                return file
        except BaseException:
            os.close(file)
            raise
        os.close(file)


def _take(path: Path, file: int) -> bool:
    """Take the lock; False where the file system has none."""
    try:
        _lock(file)
    except OSError as error:
        if error.errno in _TAKEN:
            raise HeldError(
                f"another run is at work in it ({_holder(file)}); wait for its end, or end it; "
                "process and report can write elsewhere (--out)",
                path=path.parent.parent,
            ) from None
        if error.errno not in _NONE_HERE:
            raise
        reason = error.strerror or str(error)
        _log.warning(
            "%s: the file system has no locks (%s): let no second run write here", path.parent.parent, reason
        )
        return False
    return True


if sys.platform == "win32":
    import msvcrt

    def _lock(file: int) -> None:
        os.lseek(file, _FAR, os.SEEK_SET)
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _is_same(path: Path, file: int) -> bool:
    """Whether the path still names the open file."""
    try:
        return os.path.samestat(path.stat(), os.fstat(file))
    except FileNotFoundError:
        return False


def _sign(file: int) -> None:
    """Say in the lock's file who holds it; only a help for those who read it, so a full disk may refuse."""
    who = {
        "pid": os.getpid(),
        "host": socket.gethostname(),
        "since": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    with suppress(OSError):
        os.ftruncate(file, 0)
        os.lseek(file, 0, os.SEEK_SET)
        os.write(file, json.dumps(who).encode())


def _holder(file: int) -> str:
    """Who holds the lock, as far as its file tells."""
    try:
        os.lseek(file, 0, os.SEEK_SET)
        who = json.loads(os.read(file, 1000))
        return f"process {int(who['pid'])} on {str(who['host'])!r} since {who['since']!s}"
    except (OSError, ValueError, KeyError, TypeError):
        return "it does not say which"


def _leave(path: Path, file: int) -> None:
    """Remove the file while it is still held, let go, and take back its folder if that stayed empty."""
    with suppress(OSError):
        if _is_same(path, file):
            path.unlink()
    os.close(file)
    with suppress(OSError):
        path.parent.rmdir()
