"""The CSV export holds every table with a description that people and programs read."""

import json

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import Status
from ploughval.export import export_results, tables


@pytest.fixture(scope="module")
def written(folder, tmp_path_factory):
    return export_results(folder, "csv", tmp_path_factory.mktemp("tables"))[0].parent


def read(path):
    return pd.read_csv(path, keep_default_na=False, na_values=[""])


@pytest.mark.parametrize("name", ["force", "surface", "model/bands", "budget"])
def test_a_table_comes_back_to_nine_digits(folder, written, name):
    found = read(written / f"{name.replace('/', '_')}.csv")
    pd.testing.assert_frame_equal(found, read(folder / f"{name}.csv"), check_dtype=False, rtol=1e-8)


def test_tracks_have_a_row_for_each_point_and_photograph_with_the_reason_in_words(written, tracks):
    found = read(written / "tracks.csv")
    frames, points = tracks.sizes["frame"], tracks.sizes["point"]
    assert len(found) == frames * points
    row = found[(found["frame"] == 6) & (found["point"] == 3)].iloc[0]
    assert row["status"] == Status.LOST.meaning
    assert np.isnan(row["x_mm"])
    assert row["u_mm"] == pytest.approx(float(tracks["u_mm"][6]), rel=1e-8)
    wide = found.pivot_table(index="frame", columns="point", values="y_mm", dropna=False)
    np.testing.assert_allclose(wide.to_numpy(), tracks["y_mm"].to_numpy(), rtol=1e-8)


def test_every_column_of_every_file_is_explained_and_no_other(written):
    told = pd.read_csv(written / "columns.csv", keep_default_na=False)
    there = {
        (path.stem, column)
        for path in written.glob("*.csv")
        if path.name != "columns.csv"
        for column in read(path)
    }
    assert set(zip(told["table"], told["column"], strict=True)) == there
    assert (told["meaning"].str.len() > 0).all()


def test_the_data_package_describes_each_file_as_it_is(written):
    package = json.loads((written / "datapackage.json").read_text(encoding="utf-8"))
    assert package["settings"]["blade"]["width_mm"] == 218.0
    assert (package["title"], package["name"]) == ("d30 β/01", "d30-01")  # names of packages are ASCII
    names = {path.name for path in written.glob("*.csv")} - {"columns.csv"}
    assert {resource["path"] for resource in package["resources"]} == names
    for resource in package["resources"]:
        table, fields = read(written / resource["path"]), resource["schema"]["fields"]
        assert [field["name"] for field in fields] == list(table)
        for field in fields:
            values = table[field["name"]].dropna()
            kinds = {"string": lambda v: isinstance(v, str), "integer": lambda v: float(v).is_integer()}
            assert all(kinds.get(field["type"], lambda v: not isinstance(v, str))(v) for v in values)


def test_the_same_results_give_the_same_bytes_and_an_older_export_is_replaced(folder, tmp_path):
    first = {path: path.read_bytes() for path in export_results(folder, "csv", tmp_path)}
    (tmp_path / "csv" / "of_an_older_version.csv").write_text("a\n1\n")
    assert {path: path.read_bytes() for path in export_results(folder, "csv", tmp_path)} == first
    assert {path.name for path in (tmp_path / "csv").iterdir()} == {path.name for path in first}
    assert [path.name for path in tmp_path.iterdir()] == ["csv"]


def test_tracks_written_some_photographs_at_a_time_are_the_same_to_the_byte(
    folder, written, tmp_path, monkeypatch, tracks
):
    monkeypatch.setattr(tables, "_ROWS_AT_ONCE", 3 * tracks.sizes["point"] + 1)
    part = export_results(folder, "csv", tmp_path)[0].parent
    assert (part / "tracks.csv").read_bytes() == (written / "tracks.csv").read_bytes()
