"""Whether an error says that memory has run out, whatever library raised it, and what is said of it then."""

import errno
import mmap

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


def raise_shortage(error: BaseException, needed_bytes: int) -> None:
    """Raise MemoryError where a reader lacked memory that a sound file may need.

    A damaged file can ask for any amount: where what a sound one needs is still there, the file is at fault.
    """
    if is_short_of_memory(error) and not _has_room(needed_bytes):
        raise MemoryError(*error.args) from error


def _has_room(size_bytes: int) -> bool:
    try:
        mmap.mmap(-1, size_bytes).close()  # none of it is touched
    except (OSError, ValueError, OverflowError):
        return False
    return True


def shortage(error: BaseException) -> str:
    """The message, with the remedy.

    >>> shortage(MemoryError("Unable to allocate 3 GiB"))[:43]
    'out of memory (Unable to allocate 3 GiB). G'
    """
    what = " ".join(
        str(getattr(error, "err", error)).split()
    )  # OpenCV's alone, without its place in the source
    return f"out of memory ({what}). {REMEDY}" if what else f"out of memory. {REMEDY}"
