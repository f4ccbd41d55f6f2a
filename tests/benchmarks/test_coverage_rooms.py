"""Shares of lines that ran, from a package written by hand."""

from pathlib import Path

import pytest

import coverage_rooms
from coverage_rooms import PACKAGE, Lines, lines_of, table_of


class Measured:
    """Stands for coverage: lines 1 to 6 are statements, 3 and 6 did not run."""

    def analysis2(self, path):
        return path, [1, 2, 3, 5, 6], [], [3, 6], ""


def test_lines_within_a_compiled_function_are_told_from_others(tmp_path):
    path = tmp_path / "a.py"
    path.write_text(
        "from numba import njit\n@njit(cache=True)\ndef f(x):\n    '''Text.'''\n    y = x\n    return y\n"
    )
    lines = lines_of(path, Measured())
    assert lines.plain == {1, 2, 3}
    assert lines.kernels == {5, 6}
    assert lines.run == {1, 2, 5}
    assert lines.percent == pytest.approx(60.0)


def test_rooms_are_folders_and_shares_are_of_lines_not_of_files():
    files = [
        Lines(PACKAGE / "axes.py", frozenset({1, 2, 3, 4}), frozenset(), frozenset({1})),
        Lines(PACKAGE / "model" / "a.py", frozenset(range(9)), frozenset({10, 11}), frozenset({0, 10})),
        Lines(PACKAGE / "model" / "fit" / "b.py", frozenset({1}), frozenset({2, 3}), frozenset({1, 2, 3})),
    ]
    assert table_of(files) == [
        ["model", 2, 10, "20.0", 4, "75.0"],
        ["shared", 1, 4, "25.0", 0, ""],
        ["all", 3, 14, "21.4", 4, "75.0"],
    ]


def test_files_below_the_least_share_are_listed_lowest_first(tmp_path):
    files = [
        Lines(PACKAGE / name, frozenset(range(10)), frozenset(), frozenset(range(run)))
        for name, run in (("a.py", 8), ("b.py", 9), ("c.py", 1))
    ]
    files.append(Lines(PACKAGE / "empty.py", frozenset(), frozenset(), frozenset()))
    coverage_rooms.write(tmp_path, files, 90.0)
    assert Path(tmp_path / "files.csv").read_text() == "file,lines,run_percent\nc.py,10,10.0\na.py,10,80.0\n"
