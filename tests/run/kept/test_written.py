"""Result files are whole or absent."""

import json
import os

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError
from ploughval.run.kept.written import clean_aside, write_aside, write_csv, write_json


def test_a_write_that_fails_leaves_the_old_file_and_no_scrap(tmp_path):
    target = tmp_path / "table.csv"
    target.write_text("old")

    def fail(path):
        path.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(DataError, match=r"table\.csv.*no space is left"):
        write_aside(target, fail)
    assert target.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["table.csv"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission_is_named(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(DataError, match=r"x\.json"):
        write_json(tmp_path / "x.json", {})


def test_json_has_null_for_nan_and_infinity_and_sorted_keys(tmp_path):
    path = tmp_path / "x.json"
    write_json(path, {"b": np.float64("nan"), "a": [1.5, np.inf, np.int64(3), np.bool_(True)]})
    assert json.loads(path.read_text()) == {"a": [1.5, None, 3, True], "b": None}
    assert path.read_text().index('"a"') < path.read_text().index('"b"')


def test_csv_has_empty_cells_for_nan_and_keeps_nine_digits(tmp_path):
    path = tmp_path / "t.csv"
    write_csv(
        path, pd.DataFrame({"x_mm": [1.23456789e-3, np.nan], "n": [1, 2], "extra": [0, 0]}), ["n", "x_mm"]
    )
    assert path.read_bytes() == b"n,x_mm\n1,0.00123456789\n2,\n"


def test_what_a_killed_writer_left_is_removed_and_nothing_else(tmp_path):
    kept = {".hidden", ".table.csv", "table.part-abcdefgh.csv", ".notes-12345678.txt", ".table.part-ABC.csv"}
    for name in kept | {".table.part-abcdefgh.csv", ".x\ny.part-0123456_.json", ".lone.part-abcd_fgh"}:
        (tmp_path / name).write_text("x")
    clean_aside(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == kept
    clean_aside(tmp_path / "missing")


def test_a_writer_that_is_killed_leaves_what_the_cleaning_knows(tmp_path):
    seen = []
    write_aside(tmp_path / "long.name.csv", lambda path: seen.append(path) or path.write_text("x"))
    (dead,) = seen
    dead.write_text("half")
    clean_aside(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["long.name.csv"]


@pytest.mark.skipif(os.name == "nt", reason="a folder cannot be opened there")
def test_a_file_is_synced_before_it_has_its_name_and_its_folder_after(tmp_path, monkeypatch):
    target, order = tmp_path / "x.json", []
    sync = os.fsync

    def watched(handle):
        order.append(("folder" if os.path.isdir(f"/proc/self/fd/{handle}") else "file", target.exists()))
        sync(handle)

    if not os.path.isdir("/proc/self/fd"):
        pytest.skip("needs /proc/self/fd")
    monkeypatch.setattr(os, "fsync", watched)
    write_json(target, {})
    assert order == [("file", False), ("folder", True)]
