"""The largest files that are read: what is larger is refused by name before anything of it is decoded."""

import stat
from pathlib import Path

from ploughval.errors import DataError

PICTURE_PIXELS = 160_000_000
"""Pixels of one photograph; the largest sensors of one exposure have 151 million."""
SAMPLE_BYTES = 6 * PICTURE_PIXELS
"""What a decoder holds of one picture: with that, no file takes more than 2 GB of memory to read."""
PICTURE_SIDE_PX = 32_766
"""Side of one photograph, px; OpenCV maps no picture with a longer one."""
MM_PER_PX = 1000.0
"""Scale of a photograph: no laboratory is seen at a metre a pixel."""
PICTURE_BYTES = 512 << 20
"""A picture file whose decoder takes it whole."""
PICTURES = 1_000_000
"""Pictures in one file."""
LOG_BYTES = 640 << 20
"""One file of a log; in any form it is read within 2 GB of memory."""
LOG_ROWS = 5_000_000
"""Rows of a log in all its files: 83 minutes at 1 kHz, processed within 2 GB of memory."""
LINE_BYTES = 1 << 20
"""One line of a text table."""
SETTINGS_BYTES = 8 << 20
"""test.toml, calibration.json, and tables of times or known loads."""
FILE_BYTES = 1 << 36
"""Any file: each is read once from end to end for its digest."""

_UNITS = ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB"))


def size_in_words(count: float) -> str:
    """A number of bytes in the largest unit that it fills.

    >>> size_in_words(8 << 20), size_in_words(12)
    ('8.39 MB', '12 bytes')
    """
    for factor, unit in _UNITS:
        if count >= factor:
            return f"{count / factor:.3g} {unit}"
    return f"{count:.0f} bytes"


def refuse_large(path: Path, most_bytes: int, remedy: str) -> None:
    """Refuse a file above a limit, and what is no file: a pipe or a device gives bytes without end, or none.

    Parameters
    ----------
    path : Path
        The file.
    most_bytes : int
        The limit.
    remedy : str
        What to do about a file that is too large: a sentence without its end.

    Raises
    ------
    DataError
    OSError
        A file that is not there.
    """
    state = path.stat()
    if not stat.S_ISREG(state.st_mode):
        raise DataError("is no file but a directory, pipe or device; expected a file", path=path)
    if state.st_size > most_bytes:
        raise DataError(
            f"holds {size_in_words(state.st_size)}; expected at most {size_in_words(most_bytes)}. {remedy}",
            path=path,
        )


def read_limited(path: Path, most_bytes: int, remedy: str) -> bytes:
    """All bytes of a file of at most this size.

    Raises
    ------
    DataError
        A file that is larger, or is none.
    OSError
        A file that cannot be read.
    """
    refuse_large(path, most_bytes, remedy)
    return path.read_bytes()
