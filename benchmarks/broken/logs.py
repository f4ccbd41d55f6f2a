"""Broken folders: logs of the load cells, their empty runs, and files that calibrate."""

import gzip
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from broken.base import Case, Spoil, changed, rows, setting, written

LOG = "loadcells.csv"
PHOTOS = ("tracks.nc", "surface.csv", "blade.csv", "run.json")
MEASURED = ("force.csv", *PHOTOS)
_HEADER = "time_s,displacement_mm,moment_upper_Nm,moment_lower_Nm"
Lines = list[str]


def _lost(name: str, spoil: Spoil, *told: str) -> Case:
    """The force is lost, the photographs are kept."""
    return Case(f"log: {name}", spoil, (LOG, *told), (1,), PHOTOS)


def _mended(name: str, spoil: Spoil, *told: str) -> Case:
    """A warning says what was done about it."""
    return Case(f"log: {name}", spoil, told, (0, 1), MEASURED)


def cells(change: Callable[[int, list[str]], list[str]]) -> Callable[[Lines], Lines]:
    """The fields of each row, counted from 0, through a function; the header stays."""

    def changed_rows(lines: Lines) -> Lines:
        return [lines[0], *(",".join(change(k, line.split(","))) for k, line in enumerate(lines[1:]))]

    return changed_rows


def _column(place: int, change: Callable[[int, str], str]) -> Spoil:
    """One column's cells through a function."""
    return rows(LOG, cells(lambda k, row: [*row[:place], change(k, row[place]), *row[place + 1 :]]))


def long_log(count: int, *, line: bytes = b"%d,%.1f,0.125,0.0625\n") -> Spoil:
    """A log of so many rows, written in blocks."""

    def spoil(folder: Path) -> None:
        block = 100_000
        with (folder / LOG).open("wb") as file:
            file.write(_HEADER.encode() + b"\n")
            for start in range(0, count, block):
                file.writelines(line % (k, k * 1e-3) for k in range(start, min(start + block, count)))

    return spoil


def repeated_log(count: int) -> Spoil:
    """A log of so many rows that are all the same, written fast."""

    def spoil(folder: Path) -> None:
        row = b"1.000,0.001,0.125,0.0625\n"
        block = row * 1_000_000
        with (folder / LOG).open("wb") as file:
            file.write(_HEADER.encode() + b"\n")
            for start in range(0, count, 1_000_000):
                file.write(block[: len(row) * min(1_000_000, count - start)])

    return spoil


def sparse(name: str, size: int) -> Spoil:
    """A file that says it is this large and holds nothing but a hole."""

    def spoil(folder: Path) -> None:
        path = folder / name
        path.unlink(missing_ok=True)
        with path.open("wb") as file:
            file.truncate(size)

    return spoil


def one_line(size: int, *, after: int) -> Spoil:
    """One line of so many bytes after some rows that are sound."""

    def spoil(folder: Path) -> None:
        lines = (folder / LOG).read_bytes().splitlines(keepends=True)
        with (folder / LOG).open("wb") as file:
            file.writelines([*lines[:after], b"1," * (size // 2), b"\n", *lines[after:]])

    return spoil


def _shapes() -> list[Case]:
    return [
        _lost("zero bytes", written(LOG, b""), "no row of numbers", "time_s"),
        _lost("headers without rows", rows(LOG, lambda lines: lines[:1]), "no row of numbers"),
        _lost("one row", rows(LOG, lambda lines: lines[:2]), "fewer than two", "time_s"),
        _lost("two rows", rows(LOG, lambda lines: lines[:3]), "rows"),
        Case("log: three rows", rows(LOG, lambda lines: lines[:4]), (), (0, 1), PHOTOS),
        _lost("blank lines", written(LOG, b"\n" * 5000), "no row of numbers"),
        _lost(
            "headers alone, again and again", rows(LOG, lambda lines: lines[:1] * 500), "no row of numbers"
        ),
        _lost("without headers", rows(LOG, lambda lines: lines[1:]), "no column", "time_s", "columns"),
        _lost(
            "another column's name",
            changed(LOG, lambda d: d.replace(b"moment_upper_Nm", b"M1")),
            "moment_upper_Nm",
            "M1",
        ),
        _lost(
            "a column missing",
            rows(LOG, lambda lines: [line.rsplit(",", 1)[0] for line in lines]),
            "moment_lower_Nm",
        ),
        _lost(
            "a column twice",
            rows(LOG, lambda lines: [f"{line},{line.split(',')[2]}" for line in lines]),
            "moment_upper_Nm",
        ),
        _mended("cut off in its last line", changed(LOG, lambda d: d[:-15]), "the last line is cut off"),
        _mended(
            "a row with too many fields",
            rows(LOG, lambda x: [*x[:40], f"{x[40]},1,2,3", *x[41:]]),
            "too many fields",
            "41",
        ),
        _mended(
            "a row with too few fields", rows(LOG, lambda x: [*x[:40], "3.9,1", *x[41:]]), "too few fields"
        ),
        _mended("the headers once more", rows(LOG, lambda x: [*x[:40], x[0], *x[40:]]), "headers once more"),
        _mended("a stray quote", rows(LOG, lambda x: [*x[:40], '"' + x[40], *x[41:]])),
    ]


def _bytes() -> list[Case]:
    text = _HEADER.encode() + b"\n"
    noise = np.random.default_rng(3).bytes(20_000)
    return [
        _lost("random bytes", written(LOG, noise), "no row of numbers"),
        _lost("zeros", written(LOG, bytes(20_000)), "no row of numbers"),
        _lost("doubles, binary", written(LOG, np.arange(4000.0).tobytes()), "no row of numbers"),
        _lost("headers, then binary", written(LOG, text + np.arange(4000.0).tobytes()), LOG),
        _lost("a spreadsheet", written(LOG, b"PK\x03\x04" + noise), "spreadsheet", "CSV"),
        _lost("an old spreadsheet", written(LOG, b"\xd0\xcf\x11\xe0" + noise), "spreadsheet"),
        _lost("packed by gzip", changed(LOG, gzip.compress), "packed", "gzip"),
        _lost("a picture", written(LOG, b"\x89PNG\r\n\x1a\n" + noise), LOG),
        _lost("HTML", written(LOG, "<html><body>not found</body></html>\n" * 40), "no row of numbers"),
        _lost("JSON", written(LOG, json.dumps([{"time_s": 1.0, "force": 2.0}] * 99)), LOG),
        _mended("NUL bytes at its end", changed(LOG, lambda d: d + bytes(4096)), "NUL bytes"),
        _mended("NUL bytes in a row", changed(LOG, lambda d: d[:2000] + bytes(9) + d[2009:]), "NUL bytes"),
        _mended("UTF-16 with mark", changed(LOG, lambda d: d.decode().encode("utf-16"))),
        _mended("UTF-16 without mark", changed(LOG, lambda d: d.decode().encode("utf-16-le"))),
        _mended("UTF-16 of the other order", changed(LOG, lambda d: d.decode().encode("utf-16-be"))),
        _mended("UTF-8 with mark", changed(LOG, lambda d: b"\xef\xbb\xbf" + d)),
        _lost("two marks of UTF-8", changed(LOG, lambda d: b"\xef\xbb\xbf" * 2 + d), "time_s"),
        _lost("UTF-32", changed(LOG, lambda d: d.decode().encode("utf-32")), "no row of numbers"),
        _mended("Latin-1 above the table", changed(LOG, lambda d: b"K\xfchlung: 20 \xb0C\n" + d)),
        _mended("line ends of Windows", changed(LOG, lambda d: d.replace(b"\n", b"\r\n"))),
        _mended("line ends of old Macs", changed(LOG, lambda d: d.replace(b"\n", b"\r"))),
        _lost("cut off in UTF-16", changed(LOG, lambda d: d.decode().encode("utf-16")[:7]), LOG),
    ]


def _dialects() -> list[Case]:
    def german(data: bytes) -> bytes:
        return data.replace(b",", b";").replace(b".", b",")

    def mixed(k: int, row: list[str]) -> list[str]:
        return [row[0].replace(".", ","), *row[1:]]

    return [
        _mended("semicolons and decimal commas", changed(LOG, german)),
        _mended("tabs", changed(LOG, lambda d: d.replace(b",", b"\t"))),
        _lost("decimal commas between commas", changed(LOG, lambda d: d.replace(b".", b",")), LOG),
        _lost(
            "two decimal signs",
            rows(LOG, lambda x: [x[0].replace(",", ";"), *(";".join(mixed(0, r.split(","))) for r in x[1:])]),
            "one decimal sign",
        ),
        _lost(
            "marks between thousands",
            rows(LOG, lambda x: [x[0].replace(",", ";"), *(f"1.{k:03d},5;{k};1,5;1.5" for k in range(99))]),
            LOG,
        ),
        _lost("words for numbers", _column(2, lambda k, cell: "high"), "moment_upper"),
    ]


def _values() -> list[Case]:
    return [
        _mended(
            "a word among the numbers",
            _column(2, lambda k, c: "err" if k == 50 else c),
            "moment_upper",
            "'err'",
        ),
        _mended("infinite readings", _column(2, lambda k, c: "inf" if k == 50 else c), "not finite"),
        _mended("1e300 among the readings", _column(2, lambda k, c: "1e300" if k == 50 else c), "not finite"),
        _lost("readings that are all nan", _column(2, lambda k, c: "nan"), "moment_upper"),
        _lost("readings that are all 1e300", _column(2, lambda k, c: "1e300"), "moment_upper"),
        _lost("readings that are all empty", _column(3, lambda k, c: ""), "moment_lower"),
        Case(
            "log: readings that are all zero",
            _column(2, lambda k, c: "0"),
            ("moment_upper",),
            (0, 1),
            PHOTOS,
        ),
        Case("log: a blade that never moves", _column(1, lambda k, c: "0"), ("motion",), (0, 1), PHOTOS),
        Case("log: displacements of 1e29 mm", _column(1, lambda k, c: f"{k}e28"), (), (0, 1), PHOTOS),
        Case("log: moments of 1e29", _column(2, lambda k, c: f"{k}e28"), (), (0, 1), PHOTOS),
        Case(
            "log: displacements that are all nan",
            _column(1, lambda k, c: "nan"),
            ("displacement",),
            (0, 1),
            PHOTOS,
        ),
    ]


def _times() -> list[Case]:
    def back(lines: Lines) -> Lines:
        return [lines[0], *reversed(lines[1:])]

    return [
        _mended("times backwards", rows(LOG, back), "order"),
        _lost(
            "times that are all the same", _column(0, lambda k, c: "5.0"), "all times", "time_s", "rate_hz"
        ),
        _lost("times that are words", _column(0, lambda k, c: "noon"), "'noon'", "not understood"),
        _lost("times that are nan", _column(0, lambda k, c: "nan"), "fewer than two times"),
        _lost("times of 1e300", _column(0, lambda k, c: f"{k + 1}e300"), "fewer than two times"),
        _lost("times that are infinite", _column(0, lambda k, c: "inf"), "fewer than two times"),
        _mended("a clock put back", _column(0, lambda k, c: str(float(c) - 3.0 * (k > 60))), "clock"),
        _mended(
            "a clock that leaps on", _column(0, lambda k, c: str(float(c) + 500.0 * (k > 90))), "jumps on"
        ),
        _mended("every time twice", _column(0, lambda k, c: str(k // 2 / 5)), "time"),
        _lost("times in the year 30 000", _column(0, lambda k, c: str(float(c) + 9e11)), "rest_s", "9e+11"),
        _lost("dates of no calendar", _column(0, lambda k, c: f"2024-02-30 10:00:{k % 60:02d}"), LOG),
        _mended(
            "dates that can mean two", _column(0, lambda k, c: f"03/04/2024 10:{k // 60:02d}:{k % 60:02d}")
        ),
        _lost(
            "sample numbers without rate", changed(LOG, lambda d: d.replace(b"time_s", b"sample")), "time_s"
        ),
        Case(
            "times: photographs before the log",
            setting("camera.clock_offset_s", "-500.0"),
            ("outside the log",),
            (0, 1),
            MEASURED,
        ),
        Case(
            "times: photographs after the log",
            setting("camera.clock_offset_s", "1e12"),
            ("outside the log",),
            (0, 1),
            MEASURED,
        ),
        Case(
            "times: half of the photographs after the log",
            rows("photos.csv", lambda x: [*x[:3], "0002.png,900", "0003.png,902"]),
            ("outside the log",),
            (0, 1),
            MEASURED,
        ),
    ]


def _large() -> list[Case]:
    many = ("GB", "expected at most", "Thin it out")
    return [
        Case("log: 50 million rows", repeated_log(50_000_000), (LOG, *many), (1,), PHOTOS, heavy=True),
        Case("log: 5 million rows", long_log(5_000_000), (), (0, 1), PHOTOS, heavy=True),
        Case(
            "log: one line of 100 MB",
            one_line(100_000_000, after=30),
            (LOG, "line 31", "MB"),
            (1,),
            PHOTOS,
            heavy=True,
        ),
        Case("log: one line of 3 MB", one_line(3_000_000, after=30), (LOG, "line 31", "MB"), (1,), PHOTOS),
        Case("log: a first line of 3 MB", one_line(3_000_000, after=0), (LOG, "line 1", "MB"), (1,), PHOTOS),
        Case("log: 100 MB of zeros", sparse(LOG, 100_000_000), (LOG,), (1,), PHOTOS, heavy=True),
        Case("log: 3 TB of nothing", sparse(LOG, 3 << 40), (LOG, "GB"), (1, 2), heavy=True),
        Case(
            "size: a photograph of 3 TB",
            sparse("photos/0002.png", 3 << 40),
            ("0002.png", "GB"),
            (1, 2),
            heavy=True,
        ),
        Case(
            "times: a table of 3 TB",
            sparse("photos.csv", 3 << 40),
            ("photos.csv", "TB", "at most"),
            heavy=True,
        ),
        Case("toml: 3 TB", sparse("test.toml", 3 << 40), ("test.toml", "MB"), heavy=True),
    ]


def cases() -> list[Case]:
    """All of them."""
    return [*_shapes(), *_bytes(), *_dialects(), *_values(), *_times(), *_large()]
