"""Lines of each room that the tests run: the tables of reports/coverage, from coverage's data.

`make coverage` measures: the whole suite with its subprocesses, then the kernels' tests once more without
compiling, since compiled code is not traced. Ends with exit code 1 below the least share of lines outside
kernels; kernels are held to plain twins instead.
"""

import argparse
import ast
import csv
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from coverage import Coverage

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "ploughval"
COMPILED = re.compile(r"\b(njit|compiled|inlined)\b")
COLUMNS = ("room", "files", "lines", "run_percent", "kernel_lines", "kernel_run_percent")


class Lines(NamedTuple):
    """Lines of a file, kernels' and others, and which of them ran."""

    path: Path
    plain: frozenset[int]
    kernels: frozenset[int]
    run: frozenset[int]

    @property
    def room(self) -> str:
        """The folder of the package; of a file that is in none, "shared"."""
        parts = self.path.relative_to(PACKAGE).parts
        return parts[0] if len(parts) > 1 else "shared"

    @property
    def percent(self) -> float:
        """Share of all lines that ran, percent."""
        return _percent(self.run, self.plain | self.kernels)


def lines_of(path: Path, measured: "Coverage") -> Lines:
    """Lines of a file as coverage counts them."""
    _, statements, _, missing, _ = measured.analysis2(str(path))
    compiled = _compiled(path)
    every = frozenset(statements)
    return Lines(path, every - compiled, every & compiled, every - frozenset(missing))


def table_of(files: Sequence[Lines]) -> list[list[object]]:
    """A row a room, and one of all."""
    rooms = {room: [file for file in files if file.room == room] for room in sorted({f.room for f in files})}
    return [_row(room, own) for room, own in (*rooms.items(), ("all", files))]


def _compiled(path: Path) -> frozenset[int]:
    """Lines within functions that numba compiles."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    functions = (node for node in nodes if isinstance(node, ast.FunctionDef))
    kernels = (node for node in functions if COMPILED.search(" ".join(map(ast.unparse, node.decorator_list))))
    return frozenset(
        line for node in kernels for line in range(node.body[0].lineno, (node.end_lineno or 0) + 1)
    )


def _row(room: str, files: Iterable[Lines]) -> list[object]:
    own = list(files)
    plain, kernels, run = (set(_places(own, kind)) for kind in ("plain", "kernels", "run"))
    shares = [f"{_percent(run, lines):.1f}" if lines else "" for lines in (plain, kernels)]
    return [room, len(own), len(plain), shares[0], len(kernels), shares[1]]


def _places(files: Iterable[Lines], kind: str) -> Iterator[tuple[Path, int]]:
    return ((file.path, line) for file in files for line in getattr(file, kind))


def _percent(run: Iterable[object], lines: Iterable[object]) -> float:
    every = set(lines)
    return 100.0 * len(every & set(run)) / len(every) if every else 100.0


def write(out: Path, files: Sequence[Lines], least: float) -> None:
    """rooms.csv, and files.csv of the files of which less than the least share ran."""
    out.mkdir(parents=True, exist_ok=True)
    low = [
        [str(file.path.relative_to(PACKAGE)), len(file.plain | file.kernels), f"{file.percent:.1f}"]
        for file in sorted(files, key=lambda file: file.percent)
        if file.percent < least
    ]
    tables = {"rooms.csv": [COLUMNS, *table_of(files)], "files.csv": [("file", "lines", "run_percent"), *low]}
    for name, rows in tables.items():
        with (out / name).open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the table and write it; 1 where less than the least share of lines outside kernels ran."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=ROOT / ".coverage", help="coverage's file")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "coverage")
    parser.add_argument("--least", type=float, default=90.0, help="percent of lines outside kernels")
    options = parser.parse_args(argv)
    from coverage import Coverage  # needed to measure, not to count

    measured = Coverage(data_file=str(options.data))
    measured.load()
    files = [lines_of(path, measured) for path in sorted(PACKAGE.rglob("*.py"))]
    write(options.out, files, options.least)
    for row in (COLUMNS, *table_of(files)):
        print("  ".join(f"{cell!s:>12}" for cell in row))
    return int(_percent(_places(files, "run"), _places(files, "plain")) < options.least)


if __name__ == "__main__":
    sys.exit(main())
