"""The bytes of a text table looked through once: NUL bytes, number of lines, a last line that is cut off."""

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ploughval.errors import DataError

_BLOCK = 1 << 24
_TAIL = 65_536


@dataclass(frozen=True, slots=True)
class TextBytes:
    """What stands in a file's bytes.

    Attributes
    ----------
    path : Path
    start, tail : bytes
        The first and last 64 KiB or more.
    line_ends : int
        Number of line feeds.
    nul_line : int or None
        Line, from 1, of the first NUL byte that has text after it; None without any.
    cleaned : bytes or None
        The whole file with NUL bytes at its end taken off and each other run of them made one question
        mark, so that no number is read from it; None where the file itself can be read.
    """

    path: Path
    start: bytes
    tail: bytes
    line_ends: int
    nul_line: int | None = None
    cleaned: bytes | None = None

    @property
    def source(self) -> Path | io.BytesIO:
        """What to read the table from."""
        return self.path if self.cleaned is None else io.BytesIO(self.cleaned)

    @property
    def is_wide(self) -> bool:
        """Whether NUL bytes belong to the letters (UTF-16)."""
        return self.cleaned is None and b"\0" in self.start

    def lines(self, encoding: str) -> Iterator[str]:
        """The lines one by one."""
        with io.TextIOWrapper(
            self.path.open("rb") if self.cleaned is None else io.BytesIO(self.cleaned),
            encoding=encoding,
            errors="replace",
        ) as file:
            yield from file


def look_through(path: Path) -> TextBytes:
    """Look through a file once.

    Raises
    ------
    DataError
        The file cannot be read.
    """
    try:
        with path.open("rb") as file:
            start = file.read(4 * _TAIL)
            file.seek(0)
            ends = nuls = 0
            tail = b""
            while block := file.read(_BLOCK):
                ends += block.count(b"\n")
                nuls += block.count(b"\0")
                tail = (tail + block)[-_TAIL:]
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror or error}", path=path) from None
    if nuls == 0 or _wide(start):
        return TextBytes(path, start, tail, ends)
    data = path.read_bytes().rstrip(b"\0")
    first = data.find(b"\0")
    line = None if first < 0 else data.count(b"\n", 0, first) + 1
    data = re.sub(rb"\0+", b"?", data)
    return TextBytes(path, data[: 4 * _TAIL], data[-_TAIL:], data.count(b"\n"), line, data)


def _wide(start: bytes) -> bool:
    """Whether this is UTF-16: by its mark, or NUL bytes in every other place and only there."""
    if start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    halves = [start[offset:4096:2] for offset in (0, 1)]
    return len(halves[1]) > 1 and any(
        half.count(0) > 0.9 * len(half) and other.count(0) == 0 for half, other in (halves, halves[::-1])
    )


def last_line_is_cut(content: TextBytes, encoding: str) -> bool:
    """Whether the last line lacks its end and is shorter than the lines before in fields or in digits."""
    if content.is_wide:
        return False
    lines = re.split(r"\r\n|\r|\n", content.tail.decode(encoding, errors="replace"))
    if not lines[-1].strip():
        return False
    *before, last = lines[-21:]
    before = [line for line in before if line.strip()][1:]  # the first may be the end of a line
    if len(before) < 3:
        return False
    pieces, others = re.split(r"[;,\t| ]+", last), [re.split(r"[;,\t| ]+", line) for line in before]
    if len(pieces) < min(map(len, others)):
        return True
    return len(_decimals(pieces[-1])) < min(len(_decimals(fields[-1])) for fields in others)


def _decimals(field: str) -> str:
    found = re.fullmatch(r'"?[+-]?\d+\.(\d+)"?', field)
    return found[1] if found else ""
