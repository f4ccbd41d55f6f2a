"""The bytes of a text table, looked through once and made plain: encoding, NUL bytes, ends of lines."""

import codecs
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from ploughval.errors import DataError
from ploughval.limits import LINE_BYTES, LOG_BYTES, LOG_ROWS, refuse_large, size_in_words

_ABOVE = 1000  # lines above a table are none of its rows
_BLOCK = 1 << 24
_REMEDY = "Thin it out or part it: [loadcells] log may list several files"
_PACKED = {
    b"\x1f\x8b": "gzip",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
    b"(\xb5/\xfd": "zstd",
    b"7z\xbc\xaf": "7z",
}
_SPREADSHEETS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")  # of Excel and LibreOffice, new and old
_START = 262_144
_TAIL = 65_536


@dataclass(frozen=True, slots=True)
class TextBytes:
    """A text file to be read.

    Attributes
    ----------
    path : Path
    encoding : str
    start, tail : bytes
        The first and last part.
    nuls : bool
        Whether there were NUL bytes that belong to no letter.
    nul_line : int or None
        Line, from 1, of the first of them that has text after it.
    plain : bytes or None
        The whole file in UTF-8 or in its own encoding with line feeds alone, NUL bytes at its end taken off
        and each other run of them made one question mark, so that no number is read from it; None where the
        file can be read as it is.
    """

    path: Path
    encoding: str
    start: bytes
    tail: bytes
    nuls: bool = False
    nul_line: int | None = None
    plain: bytes | None = None

    def open(self) -> BinaryIO:
        """What to read the table from."""
        return self.path.open("rb") if self.plain is None else io.BytesIO(self.plain)

    def lines(self) -> Iterator[str]:
        """The lines one by one."""
        with io.TextIOWrapper(self.open(), encoding=self.encoding, errors="replace") as file:
            yield from file

    def last_line_is_cut(self) -> bool:
        """Whether the last line lacks its end and is shorter than the lines before in fields or digits."""
        *before, last = self.tail.decode(self.encoding, errors="replace").split("\n")[-21:]
        before = [line for line in before if line.strip()][1:]  # the first may be the end of a line
        if not last.strip() or len(before) < 3:
            return False
        pieces, others = _pieces(last), [_pieces(line) for line in before]
        if len(pieces) < min(map(len, others)):
            return True
        return _decimals(pieces[-1]) < min(_decimals(fields[-1]) for fields in others)


def look_through(path: Path) -> TextBytes:
    """Look through a file once.

    Raises
    ------
    DataError
        The file cannot be read, is a spreadsheet or packed, or is larger than any log that is read.
    """
    try:
        refuse_large(path, LOG_BYTES, _REMEDY)
        with path.open("rb") as file:
            start = file.read(_START)
            _refuse_kind(path, start)
            file.seek(0)
            nuls, returns, tail = False, 0, b""
            size = _Size(path)
            while block := file.read(_BLOCK):
                size.take(block)
                nuls = nuls or b"\0" in block
                if b"\r" in block or tail.endswith(b"\r"):
                    returns += block.count(b"\r") - block.count(b"\r\n")
                    returns -= tail.endswith(b"\r") and block.startswith(b"\n")
                tail = (tail + block[-_TAIL:])[-_TAIL:]
        encoding = _encoding(start)
        if not nuls and returns == 0 and not encoding.startswith("utf-16"):
            return TextBytes(path, encoding, start, tail)
        data = path.read_bytes()
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror or error}", path=path) from None
    return _made_plain(path, data, encoding)


def _refuse_kind(path: Path, start: bytes) -> None:
    if start.startswith(_SPREADSHEETS):
        raise DataError("is a spreadsheet; expected a text table. Save it as CSV", path=path)
    packed = next((name for sign, name in _PACKED.items() if start.startswith(sign)), None)
    if packed is not None:
        raise DataError(f"is packed ({packed}); expected a text table. Unpack it", path=path)


class _Size:
    """Lines of a file and the length of the longest, refused as soon as they are too many or too long."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._feeds = self._returns = self._since = 0

    def take(self, block: bytes) -> None:
        """The next block."""
        feeds, returns = block.count(b"\n"), block.count(b"\r")
        sign = b"\n" if feeds else b"\r"
        self._refuse_long(block, sign)
        self._feeds, self._returns = self._feeds + feeds, self._returns + returns
        count = max(self._feeds, self._returns)
        if count > LOG_ROWS + _ABOVE:
            raise DataError(
                f"holds more than {LOG_ROWS // 1_000_000} million rows; expected at most as many. {_REMEDY}",
                path=self._path,
            )

    def _refuse_long(self, block: bytes, sign: bytes) -> None:
        place = 0
        while place < len(block):
            end = block.find(sign, place)
            stop = len(block) if end < 0 else end
            length = stop - place
            if self._since + length > LINE_BYTES:  # NUL bytes are no text: a file's end may hold many
                length -= block.count(0, place, stop)
            if self._since + length > LINE_BYTES:
                line = max(self._feeds, self._returns) + block.count(sign, 0, place) + 1
                raise DataError(
                    f"line {line} is longer than {size_in_words(LINE_BYTES)}; expected a text table with one "
                    "row a line",
                    path=self._path,
                )
            if end < 0:
                self._since += length
                return
            # from the last end of line within reach on: no line between is longer
            near = block.rfind(sign, place, place + LINE_BYTES)
            place, self._since = max(near, end) + 1, 0


def _made_plain(path: Path, data: bytes, encoding: str) -> TextBytes:
    if encoding.startswith("utf-16"):
        data, encoding = (
            data.decode(encoding, errors="replace").encode("utf-8", errors="replace"),
            "utf-8-sig",
        )
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    nuls = b"\0" in data
    data = data.rstrip(b"\0")
    first = data.find(b"\0")
    line = None if first < 0 else data.count(b"\n", 0, first) + 1
    data = re.sub(rb"\0+", b"?", data)
    return TextBytes(path, encoding, data[:_START], data[-_TAIL:], nuls, line, data)


def _encoding(start: bytes) -> str:
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    for offset, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        zeros, letters = start[offset:4096:2], start[1 - offset : 4096 : 2]
        if len(zeros) > 1 and zeros.count(0) > 0.9 * len(zeros) and letters.count(0) == 0:
            return encoding
    try:
        start.decode("utf-8")
    except UnicodeDecodeError as error:
        if error.start < len(start) - 4:  # not just a letter cut in two by the end of the block
            return "latin-1"
    return "utf-8-sig"


def _pieces(line: str) -> list[str]:
    return re.split(r"[;,\t| ]+", line.rstrip("\r"))


def _decimals(field: str) -> int:
    found = re.fullmatch(r'"?[+-]?\d+\.(\d+)"?', field)
    return len(found[1]) if found else 0
