"""The command ``export``: files, messages, exit codes, JSON."""

import json

import pytest
from typer.testing import CliRunner

from ploughval.cli import app

run = CliRunner().invoke


def test_several_formats_are_written_and_named(own_folder, tmp_path):
    told = run(app, ["export", str(own_folder), "--to", "mat", "--to", "csv", "--out", str(tmp_path)])
    assert told.exit_code == 0
    for name in ("d30-01.mat", "csv/force.csv", "csv/datapackage.json"):
        assert f"wrote {tmp_path / name}" in told.output
        assert (tmp_path / name).is_file()


def test_json_lists_the_files_by_format(own_folder, tmp_path):
    told = run(app, ["export", str(own_folder), "--to", "vtk", "--out", str(tmp_path), "--json"])
    found = json.loads(told.stdout)
    assert found["exit_code"] == 0
    assert str(tmp_path / "vtk" / "points.pvd") in found["vtk"]


@pytest.mark.parametrize(("to", "said"), [("xls", "expected one of netcdf"), ("csv", "process it first")])
def test_what_cannot_be_exported_is_refused_with_code_2(tmp_path, to, said):
    told = run(app, ["export", str(tmp_path), "--to", to])
    assert told.exit_code == 2
    assert said in told.output
    assert "Traceback" not in told.output
    assert not any(tmp_path.iterdir())
