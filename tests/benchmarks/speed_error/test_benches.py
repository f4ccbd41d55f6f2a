"""Benches are found in a checkout and in an installed package, by name, and make their page at the end."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ploughval.errors import ConfigError
from ploughval.run import benches
from ploughval.run.benches import Benches, bench_folder, run_benches, write_bench_page
from speed_error.machine import machine_facts, read_machine, write_machine

ROOT = Path(__file__).parents[3]
SCRIPT = """import argparse
from pathlib import Path


def main(arguments):
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path)
    parser.add_argument({option!r}, action="store_true")
    given = parser.parse_args(arguments)
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "{name}.csv").write_text(str(vars(given)))
"""


@pytest.fixture
def scripts(tmp_path, monkeypatch):
    """Two scripts, of which one has a quick run."""
    folder = tmp_path / "scripts"
    folder.mkdir()
    (folder / "bench_one.py").write_text(SCRIPT.format(name="one", option="--quick").replace("'", '"'))
    (folder / "bench_two.py").write_text(SCRIPT.format(name="two", option="--slow"))
    monkeypatch.setattr(benches, "bench_folder", lambda: folder)
    monkeypatch.setattr(sys, "path", list(sys.path))
    return folder


def test_an_unknown_name_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(ConfigError, match=r"'pif'.*compare.*fit.*force.*model.*piv.*sequences.*whole"):
        run_benches(Benches(("piv", "pif"), tmp_path))
    assert not list(tmp_path.iterdir())


def test_scripts_run_by_name_and_tell_what_they_wrote(scripts, tmp_path):
    assert [path.name for path in run_benches(Benches(("two",), tmp_path / "o"))] == ["two.csv"]
    assert [path.name for path in run_benches(Benches((), tmp_path / "p"))] == ["one.csv", "two.csv"]


def test_a_quick_run_leaves_out_scripts_without_one(scripts, tmp_path):
    written = run_benches(Benches((), tmp_path / "o", quick=True))
    assert [path.name for path in written] == ["one.csv"]
    assert "'quick': True" in written[0].read_text()


def test_a_quick_run_does_not_write_over_what_is_kept():
    assert Benches().folder == benches.KEPT
    quick = Benches(quick=True).folder
    assert quick != benches.KEPT
    assert not quick.resolve().is_relative_to(Path.cwd())
    assert Benches(out=Path("here"), quick=True).folder == Path("here")


def test_every_script_of_the_checkout_has_a_quick_run():
    named = sorted(bench_folder().glob("bench_*.py"))
    lacking = [path.name for path in named if '"--quick"' not in path.read_text(encoding="utf-8")]
    assert lacking in ([], ["bench_sequence_speed.py"])  # a test of a laboratory's size has no small one


@pytest.mark.slow
def test_an_installed_package_finds_its_scripts_and_makes_the_page(tmp_path, write_some):
    site, ignore = tmp_path / "site", shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "src" / "ploughval", site / "ploughval", ignore=ignore)
    shutil.copytree(ROOT / "benchmarks", site / "ploughval" / "benchmarks", ignore=ignore)
    tables = write_some(tmp_path / "tables", "compare.csv")
    command = [sys.executable, "-m", "ploughval.cli", "bench", "--page", "--out", str(tables)]
    environment = {**os.environ, "PYTHONPATH": str(site)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tables / "index.html").is_file()
    asked = "from ploughval.run.benches import bench_folder; print(bench_folder())"
    found = subprocess.run(
        [sys.executable, "-c", asked],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert Path(found.stdout.strip()) == site / "ploughval" / "benchmarks"


def test_the_page_alone_measures_nothing(tmp_path, write_some):
    tables = write_some(tmp_path, "model-settings.csv")
    before = {path.name: path.read_bytes() for path in tables.glob("*.csv")}
    written = write_bench_page(tables)
    assert {"index.html", "README.md", "model.png"} <= {path.name for path in written}
    assert {path.name: path.read_bytes() for path in tables.glob("*.csv")} == before


def test_the_machine_is_told_without_a_name_or_a_path(tmp_path):
    write_machine(tmp_path)
    facts = read_machine(tmp_path)
    assert facts == machine_facts()
    assert facts["cores"] >= 1
    told = (tmp_path / "machine.json").read_text(encoding="utf-8")
    assert os.uname().nodename not in told
    assert "/" not in told
