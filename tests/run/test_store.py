"""Result files are whole or absent, and stage results are found again only under their own key."""

import json
import os

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError
from ploughval.run.store import Store, key_of, write_aside, write_csv, write_json


def test_a_write_that_fails_leaves_the_old_file_and_no_scrap(tmp_path):
    target = tmp_path / "table.csv"
    target.write_text("old")

    def fail(path):
        path.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(DataError, match=r"table\.csv.*No space left"):
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


def test_keys_of_different_parts_never_meet():
    assert key_of("ab", "c") != key_of("a", "bc")
    assert key_of("ab", "c") == key_of("ab", "c")


def test_a_stage_comes_back_only_under_its_key_and_unharmed(tmp_path):
    store = Store(tmp_path)
    arrays = {"x": np.linspace(0, 1, 5), "text": np.array('{"3": "reason"}')}
    store.save("window", key_of("one"), arrays)
    assert store.load("window", key_of("two")) is None
    kept = store.load("window", key_of("one"))
    assert np.array_equal(kept["x"], arrays["x"])
    assert str(kept["text"]) == '{"3": "reason"}'
    assert Store(tmp_path, fresh=True).load("window", key_of("one")) is None


def test_a_truncated_stage_is_run_again_not_read(tmp_path):
    store = Store(tmp_path)
    store.save("window", key_of("one"), {"x": np.arange(1000.0)})
    (path,) = (tmp_path / ".store").glob("*.npz")
    path.write_bytes(path.read_bytes()[:100])
    assert store.load("window", key_of("one")) is None


def test_a_new_key_replaces_the_old_one(tmp_path):
    store = Store(tmp_path)
    store.save("window", key_of("one"), {"x": np.arange(3)})
    store.save("window", key_of("two"), {"x": np.arange(3)})
    assert len(list((tmp_path / ".store").glob("*.npz"))) == 1
