"""What is said where a disk refuses a file: full, over its quota, read-only, without permission."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ploughval.errors import DataError

_ELSEWHERE = "or choose another place"
_SAID = {
    errno.ENOSPC: ("no space is left on the disk, or no room for another file", f"Free some, {_ELSEWHERE}"),
    errno.EDQUOT: ("your quota of the disk is used up", f"Free some, {_ELSEWHERE}"),
    errno.EFBIG: ("it is larger than a file may be there (ulimit -f)", f"Raise the limit, {_ELSEWHERE}"),
    errno.EROFS: ("the disk can only be read", "Choose another place"),
    errno.EACCES: ("permission denied", f"Allow writing there, {_ELSEWHERE}"),
    errno.EPERM: ("the system does not permit it", f"Allow writing there, {_ELSEWHERE}"),
    errno.ENOTDIR: ("what should be a folder above it is a file", "Move that, or choose another place"),
    errno.EEXIST: ("what should be a folder above it is a file", "Move that, or choose another place"),
    errno.EISDIR: ("there is a folder of this name", "Move that, or choose another place"),
    errno.EMFILE: ("too many files are open (ulimit -n)", "Raise the limit"),
    errno.EIO: ("the disk failed", f"See to the disk, {_ELSEWHERE}"),
}


@contextmanager
def unwritable(path: Path) -> Iterator[None]:
    """Turn a refusal of the disk into one message: the file, what is missing, what to do.

    A block that runs out of memory is left to say so itself.

    Raises
    ------
    DataError
        In place of an OSError.
    """
    try:
        yield
    except OSError as error:
        if error.errno == errno.ENOMEM:
            raise
        raise refusal(path, error) from error


def is_refusal(error: OSError) -> bool:
    """Whether it is the disk that has no room or takes nothing, of which no program is the cause."""
    return error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG, errno.EIO)


def refusal(path: Path | str, error: OSError) -> DataError:
    """The message for a file that the disk refuses.

    >>> print(refusal("d30/results/force.csv", OSError(errno.EROFS, "Read-only file system")))
    d30/results/force.csv: cannot be written: the disk can only be read. Choose another place
    """
    code = error.errno or 0
    what, remedy = _SAID.get(code, (error.strerror or str(error), f"See to that, {_ELSEWHERE}"))
    return DataError(f"cannot be written: {what}. {remedy}", path=path)
