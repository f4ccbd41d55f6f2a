"""Whether an error says that memory has run out, whatever library raised it, and what is said of it then."""

import errno

REMEDY = (
    "Give it fewer --workers, end other programs, crop the photographs or widen [piv] spacing_px, or take a "
    "machine with more; finished stages are kept, and the same command goes on from there"
)
_OPENCV_NO_MEMORY = -4
_TOLD = ("can't start new thread", "cannot allocate memory")


def is_short_of_memory(error: BaseException | None) -> bool:
    """Whether memory has run out: of NumPy, OpenCV, the system, a thread, a library that is loaded.

    >>> is_short_of_memory(MemoryError()), is_short_of_memory(RuntimeError("can't start new thread"))
    (True, True)
    >>> is_short_of_memory(ValueError("x"))
    False
    """
    if error is None:
        return False
    if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
        return True
    if type(error).__module__ == "cv2" and getattr(error, "code", None) == _OPENCV_NO_MEMORY:
        return True
    said = str(error).lower()
    if isinstance(error, OSError | RuntimeError | ImportError) and any(text in said for text in _TOLD):
        return True
    return is_short_of_memory(error.__cause__)


def shortage(error: BaseException) -> str:
    """The message, with the remedy.

    >>> shortage(MemoryError("Unable to allocate 3 GiB"))[:43]
    'out of memory (Unable to allocate 3 GiB). G'
    """
    what = " ".join(str(error).split())
    return f"out of memory ({what}). {REMEDY}" if what else f"out of memory. {REMEDY}"
