"""What is said of an error that is no fault of ploughval: its input, the disk, the memory."""

from ploughval.disk import is_refusal, refusal
from ploughval.errors import PloughvalError
from ploughval.memory import is_short_of_memory, shortage


def refusal_of(error: BaseException) -> str | None:
    """The message of an error that a user or a small machine can cause; None: a fault of ploughval.

    >>> refusal_of(PloughvalError("no log")), refusal_of(KeyError("a"))
    ('no log', None)
    """
    if isinstance(error, PloughvalError):
        return str(error)
    if is_short_of_memory(error):
        return shortage(error)
    if isinstance(error, OSError) and is_refusal(error):
        return str(refusal(error.filename or "the output", error))
    return None
