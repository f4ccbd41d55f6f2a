"""Several test folders on the command line, a process each: as one by one, and none stops another."""

import json
import re
import shutil

import pytest
from typer.testing import CliRunner

from broken.base import make_sound
from ploughval.cli import app

TIMES = ("timings_s", "seconds")


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A test that lacks an empty run, one whose settings are refused, and one of the load cells alone."""
    root = tmp_path_factory.mktemp("many")
    make_sound(root / "lacking")
    settings = root / "lacking" / "test.toml"
    text = settings.read_text()
    for name in ("refused", "force"):
        shutil.copytree(root / "lacking", root / name)
    settings.write_text(text.replace('["empty/*.csv"]', '["empty/run1.csv", "none.csv"]'))
    (root / "refused" / "test.toml").write_text("[blade]\ndepth_mm = -1.0\n")
    (root / "force" / "test.toml").write_text(re.sub(r"(?ms)^\[(camera|tracers)\].*?(?=^\[|\Z)", "", text))
    return [root / name for name in ("lacking", "refused", "force")]


def results(folder):
    """The bytes of every result file; run.json without its times, and without the page, which shows them."""
    shown = [path for path in folder.rglob("*") if path.is_file() and ".store" not in path.parts]
    found = {path.relative_to(folder).as_posix(): path.read_bytes() for path in shown}
    del found["report.html"]
    record = json.loads(found.pop("run.json"))
    return found | {"run.json": {key: value for key, value in record.items() if key not in TIMES}}


def test_side_by_side_each_test_ends_as_it_would_alone(folders, tmp_path, monkeypatch):
    together = run("process", *folders, "--out", tmp_path / "o", "--workers", 2, "--json")
    assert together.exit_code == 2, together.output
    summary = json.loads(together.stdout)
    assert [row["folder"] for row in summary["tests"]] == [str(folder) for folder in folders]
    assert [row["exit_code"] for row in summary["tests"]] == [1, 2, 0]
    assert "none.csv" in summary["tests"][0]["faults"][0]
    assert "blade.depth_mm" in summary["tests"][1]["error"]
    assert not (tmp_path / "o" / "refused").exists()
    for line in together.stderr.splitlines():
        assert json.loads(line)["event"] in ("progress", "message", "log")
    monkeypatch.setattr("ploughval.report.page.single_page", lambda *_: "without the seconds of its figures")
    assert run("process", folders[0], "--out", tmp_path / "alone").exit_code == 1
    assert "tracks.nc" in results(tmp_path / "alone")
    assert results(tmp_path / "o" / "lacking") == results(tmp_path / "alone")


def test_a_test_given_twice_is_refused_before_anything_runs(folders, tmp_path):
    result = run("process", folders[2], folders[0], f"{folders[2]}/", "--out", tmp_path / "o")
    assert result.exit_code == 2
    assert "again; expected each test once" in result.stderr
    assert not (tmp_path / "o").exists()
