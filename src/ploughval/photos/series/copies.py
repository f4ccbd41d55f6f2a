"""Files that are copies of others: same bytes, and a name that a file manager gives to a copy."""

import contextlib
import hashlib
import re
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

_SAMPLE_BYTES = 65_536
_COPY = re.compile(
    r"(.+?)(?: ?\([0-9]+\)|[ _-]+(?:copy|kopie|copie|copia)(?: ?\(?[0-9]+\)?)?)+", re.IGNORECASE
)


def same_files(files: Sequence[Path]) -> list[list[Path]]:
    """Groups of files that hold the same bytes, each in the order given.

    Files of different size are told apart without being read, and most others by their middle.
    """
    alike: list[list[Path]] = [list(files)]
    for mark in (_size, _middle, _digest):
        marked: defaultdict[tuple[int, int | bytes], list[Path]] = defaultdict(list)
        for number, group in enumerate(alike):
            for path in group:
                with contextlib.suppress(OSError):  # what cannot be read is named when its header is
                    marked[number, mark(path)].append(path)
        alike = [group for group in marked.values() if len(group) > 1 and group[0].stat().st_size]
    return alike


def _size(path: Path) -> int:
    return path.stat().st_size


def _middle(path: Path) -> bytes:
    with path.open("rb") as file:
        file.seek(max(_size(path) - _SAMPLE_BYTES, 0) // 2)
        return file.read(_SAMPLE_BYTES)


def _digest(path: Path) -> bytes:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").digest()


def is_copy_of(copy: Path, original: Path) -> bool:
    """Whether a name is what a file manager makes of another.

    >>> is_copy_of(Path("IMG_1 (2).jpg"), Path("IMG_1.jpg")), is_copy_of(Path("IMG_2.jpg"), Path("IMG_1.jpg"))
    (True, False)
    """
    match = _COPY.fullmatch(copy.stem)
    return match is not None and match[1] == original.stem
