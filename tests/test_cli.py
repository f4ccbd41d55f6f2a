"""The command line: verbs, exit codes, messages without tracebacks."""

import json
import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from importlib.metadata import version

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from ploughval.cli import app
from ploughval.synth import EXAMPLE, make_folder

VERBS = ("init", "check", "process", "simulate", "fit", "report", "synth", "bench", "demo")


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_its_help(verb):
    result = run(verb, "--help")
    assert result.exit_code == 0
    assert "Usage" in result.output


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from ploughval.cli import app; from typer.testing import CliRunner;"
        "assert CliRunner().invoke(app, ['--help']).exit_code == 0;"
        "names = {'numpy', 'pandas', 'matplotlib', 'numba', 'cv2', 'scipy', 'xarray', 'pydantic'};"
        "heavy = names & set(sys.modules);"
        "print(sorted(heavy)); sys.exit(bool(heavy))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_version_is_that_of_the_installed_package():
    result = run("--version")
    assert (result.exit_code, result.output) == (0, f"ploughval {version('ploughval')}\n")


def test_refused_settings_end_with_2_and_name_every_fault_without_a_traceback(tmp_path, model_settings):
    (tmp_path / "test.toml").write_text(
        model_settings.replace("depth_mm = 30.0", "depth_mm = -3\ncolour = 1")
    )
    result = run("process", tmp_path)
    assert result.exit_code == 2
    assert "blade.depth_mm" in result.stderr
    assert "blade.colour" in result.stderr
    assert "Traceback" not in result.output
    assert not (tmp_path / "results").exists()


def test_a_folder_without_settings_is_told_how_to_get_them(tmp_path):
    result = run("process", tmp_path)
    assert result.exit_code == 2
    assert "ploughval init" in result.stderr


def test_simulate_needs_neither_photographs_nor_logs_and_prints_rankines_force(model_only):
    """P0 = 16 kN/m3 x (30 mm)^2 / 2 x tan^2(70 degrees) x 1 m = 54.350 N."""
    result = run(
        "simulate", model_only / "test.toml", "--out", model_only / "m", "--displacement", 30, "--json"
    )
    assert result.exit_code == 0, result.output
    summary = json.loads(result.stdout)
    assert summary["P0_N"] == pytest.approx(54.350, abs=5e-4)
    assert {p.name for p in (model_only / "m").iterdir()} == {
        "force.csv",
        "bands.csv",
        "layers.csv",
        "surface.csv",
    }


def test_a_scene_for_the_model_alone_has_a_report_without_photographs_and_force(model_only):
    result = run("process", model_only, "--json")
    assert result.exit_code == 0, result.output
    results = model_only / "results"
    assert (results / "report.html").is_file()
    assert (results / "model" / "force.csv").is_file()
    for name in ("force.csv", "tracks.nc", "surface.csv", "bands.csv", "layers.csv"):
        assert not (results / name).exists()


def test_one_refused_folder_among_several_does_not_stop_the_others(model_only, tmp_path):
    empty = tmp_path / "empty-folder"
    empty.mkdir()
    result = run("process", empty, model_only, "--out", tmp_path / "o", "--workers", 1, "--json")
    assert result.exit_code == 2
    tests = json.loads(result.stdout)["tests"]
    assert [t["exit_code"] for t in tests] == [2, 0]


def test_reporting_what_was_not_processed_says_so(tmp_path):
    result = run("report", tmp_path)
    assert result.exit_code == 2
    assert "process it first" in result.stderr


def test_an_unknown_bench_lists_the_known_ones(tmp_path):
    result = run("bench", "nonsense", "--out", tmp_path)
    assert result.exit_code == 2
    assert "model" in result.stderr
    assert "whole" in result.stderr


def test_init_writes_a_draft_once(tmp_path):
    assert run("init", tmp_path).exit_code == 0
    text = (tmp_path / "test.toml").read_text()
    assert "[blade]" in text
    assert run("init", tmp_path).exit_code == 2
    assert (tmp_path / "test.toml").read_text() == text


def test_synth_makes_the_prediction_of_a_scene(model_only):
    """P0 of 16 kN/m3, 30 mm, 50 degrees over 1 m is 54.350 N: the first force of the made record."""
    out = model_only / "predicted"
    result = run("synth", out, "--like", model_only, "--frames", 2, "--displacement", 2, "--no-photos")
    assert result.exit_code == 0, result.output
    assert "test.toml, logs, and the truth in" in " ".join(
        result.output.split()
    )  # no photographs, none told of
    force = pd.read_csv(out / "truth" / "force.csv")
    assert force["force_N"].max() == pytest.approx(54.350, rel=0.05)  # rows at 50 Hz: softening has begun
    made = tomllib.loads((out / "test.toml").read_text())
    assert made["blade"]["width_mm"] == 1000.0
    assert made["soil"]["peak_friction_deg"] == 50.0
    assert made["tracers"]["layers_mm"] == [10.0, 20.0]


def test_a_doubtful_calibration_is_told_once_and_kept_with_the_results(tmp_path):
    made = replace(EXAMPLE, seed=4, frames=3, displacement_mm=1.0, loadcells=False, layers_mm=(), dyed=False)
    make_folder(tmp_path / "t", made)
    toml = tmp_path / "t" / "test.toml"
    before, rest = re.split(r"mm_per_px.*\ntip_px = .*\n", toml.read_text())
    x, y = map(float, re.search(r"tip_px = \[(.*), (.*)\]", toml.read_text()).groups())
    places = np.array([[-10.0, -2.0], [20.0, 4.0], [60.0, -2.0], [45.0, -4.0]])  # nearly on a line
    points = np.column_stack([x + places[:, 0] / 0.3, y - places[:, 1] / 0.3, places]).tolist()
    toml.write_text(f"{before}control_points = {points}\n{rest}")
    result = run("process", tmp_path / "t")
    assert result.exit_code == 0, result.output
    told = "the scale at the tip is known to"
    assert result.output.count(told) == 1
    record = json.loads((tmp_path / "t" / "results" / "run.json").read_text())
    assert sum(told in text for text in record["warnings"]) == 1
