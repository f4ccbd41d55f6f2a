"""Where an export goes: aside first, over nothing that is not an export, with one message if that fails."""

import errno
import shutil

import pytest

from ploughval import load_results
from ploughval.errors import ConfigError, DataError
from ploughval.export import Format, export_results, formats_of, placing


def test_exports_stand_in_the_result_folder_where_no_other_is_named(own_folder):
    (path,) = export_results(own_folder, Format.MAT)
    assert path == own_folder / "export" / "d30-01.mat"


def test_a_test_folder_stands_for_its_results(make_results, tmp_path):
    make_results(tmp_path / "results")
    assert export_results(tmp_path, "netcdf", tmp_path / "out")[0].is_file()


def test_a_format_that_is_not_known_is_refused_before_anything_is_read(tmp_path):
    with pytest.raises(ConfigError, match=r"got 'xls'; expected one of netcdf, csv, mat, vtk"):
        export_results(tmp_path / "nowhere", "xls")
    with pytest.raises(ConfigError, match="2 faults"):
        formats_of(["xls", "csv", "ods"])
    assert formats_of(["csv", "mat", "csv"]) == [Format.CSV, Format.MAT]


def test_results_that_are_not_whole_are_refused(own_folder, tmp_path):
    (own_folder / "run.json").unlink()
    with pytest.raises(DataError, match="process it first"):
        export_results(own_folder, "csv", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("to", "name"), [("csv", "notes.txt"), ("vtk", "points/mine.csv")])
def test_a_folder_with_a_file_of_another_is_left_as_it_was(own_folder, tmp_path, to, name):
    foreign = tmp_path / to / name
    foreign.parent.mkdir(parents=True)
    foreign.write_text("mine")
    with pytest.raises(DataError, match=rf"{to}: holds {name}, .* another --out"):
        export_results(own_folder, to, tmp_path)
    assert [path for path in tmp_path.rglob("*") if path.is_file() and own_folder not in path.parents] == [
        foreign
    ]


@pytest.mark.parametrize("kind", ["file", "link"])
def test_a_file_or_a_link_in_the_folders_place_is_left_alone(own_folder, tmp_path, kind):
    place, other = tmp_path / "vtk", tmp_path / "other"
    other.mkdir()
    place.write_text("mine") if kind == "file" else place.symlink_to(other)
    with pytest.raises(DataError, match="is a file or a link"):
        export_results(own_folder, "vtk", tmp_path)
    assert place.is_symlink() == (kind == "link")
    assert not any(other.iterdir())


@pytest.mark.parametrize("to", ["csv", "vtk", "mat", "netcdf"])
def test_a_full_disk_ends_in_one_message_and_leaves_the_older_export(own_folder, tmp_path, monkeypatch, to):
    written = export_results(own_folder, to, tmp_path / "out")
    before = {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()}

    def full(*_, **options):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    with pytest.raises(DataError, match="no space is left on the disk") as told:
        export_results(own_folder, to, tmp_path / "out")
    assert ".part-" not in str(told.value)
    monkeypatch.undo()
    assert {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()} == before
    assert all(path.is_file() for path in written)


def test_an_older_folder_comes_back_where_the_new_one_cannot_take_its_place(tmp_path, monkeypatch):
    target = tmp_path / "csv"
    target.mkdir()
    (target / "old.csv").write_text("old")
    rename = placing.Path.rename

    def refused(self, other):
        if self.name == "new":
            raise OSError(errno.EACCES, "Permission denied")
        return rename(self, other)

    monkeypatch.setattr(placing.Path, "rename", refused)
    with pytest.raises(DataError, match="permission denied"):
        placing.replace_folder(target, lambda folder: (folder / "new.csv").write_text("new"), {".csv"})
    assert [path.name for path in target.iterdir()] == ["old.csv"]
    assert [path.name for path in tmp_path.iterdir()] == ["csv"]


def test_a_test_with_a_force_alone_exports_its_force_alone(own_folder, tmp_path):
    for path in own_folder.glob("*"):
        if path.name not in ("run.json", "force.csv"):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    for to in ("netcdf", "mat"):
        assert len(export_results(own_folder, to, tmp_path)) == 1
    names = {path.name for path in export_results(own_folder, "csv", tmp_path)}
    assert names == {"columns.csv", "datapackage.json", "force.csv", "frames.csv", "notes.csv"}
    assert [path.name for path in export_results(own_folder, "vtk", tmp_path)] == ["README.md"]


def test_a_spoiled_table_is_refused_by_name_and_nothing_is_written(own_folder, tmp_path):
    (own_folder / "bands.csv").write_text("band,u_start_mm\n1,x\n")
    with pytest.raises(DataError, match=r"bands\.csv: columns u_end_mm"):
        export_results(own_folder, "csv", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("text", "said"), [("{", "not readable as JSON"), ("[1]", "expected a JSON object")])
def test_a_spoiled_record_is_refused_by_name_and_nothing_is_written(own_folder, tmp_path, text, said):
    (own_folder / "fit.json").write_text(text)
    with pytest.raises(DataError, match=rf"fit\.json: .*{said}"):
        export_results(own_folder, "mat", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    with pytest.raises(DataError, match=said):
        load_results(own_folder).fit  # noqa: B018
