"""`ploughval init` and `ploughval check` from the command line: from draft to results, exit codes."""

import json
import re
import shutil
from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner

from ploughval.axes import Direction
from ploughval.cli import app
from ploughval.synth import SynthOptions, make_folder

EXAMPLE = Path(__file__).parents[1] / "data" / "example"


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture
def folder(tmp_path):
    out = tmp_path / "test"
    shutil.copytree(EXAMPLE, out, ignore=shutil.ignore_patterns("truth"))
    return out


def test_a_sound_folder_ends_with_0_and_a_picture_where_it_was_asked_for(folder, tmp_path):
    result = run("check", folder, "--picture", tmp_path / "p.png")
    assert result.exit_code == 0, result.output
    assert "calibration: scale and tip" in result.stdout
    assert all(line.startswith("check: ") for line in result.stderr.splitlines())  # progress alone
    with Image.open(tmp_path / "p.png") as picture:
        assert picture.width == 1350


def test_faults_end_with_1_and_go_to_the_error_stream(folder, tmp_path):
    (folder / "photos" / "0003.png").write_bytes(b"")
    result = run("check", folder, "--picture", tmp_path / "p.png")
    assert result.exit_code == 1
    assert "fault: 0003.png" in result.stderr
    assert (tmp_path / "p.png").is_file()


def test_refused_settings_end_with_2_and_the_picture_is_still_made(folder, tmp_path):
    path = folder / "test.toml"
    path.write_text(path.read_text().replace("depth_mm", "depht_mm"))
    result = run("check", folder, "--picture", tmp_path / "p.png")
    assert result.exit_code == 2
    assert "refused: test.toml: blade.depht_mm" in result.stderr
    assert "Traceback" not in result.output
    assert (tmp_path / "p.png").is_file()


def test_a_log_that_cannot_be_read_is_refused_once(folder, tmp_path):
    path = folder / "loadcells.csv"
    path.write_text(path.read_text().replace("moment_upper_Nm", "Kraft", 1))
    result = run("check", folder, "--picture", tmp_path / "p.png")
    assert result.exit_code == 2
    assert result.stderr.count("no column 'moment_upper_Nm'") == 1


def test_a_calibration_that_contradicts_itself_is_refused_once(folder, tmp_path):
    settings = folder / "test.toml"
    table = '[loadcells.calibration]\nfiles = ["cells.csv"]\n\n[tracers]'
    settings.write_text(settings.read_text().replace("[tracers]", table))
    loads = [0, 10, 20, 30, 40, 50, 40, 30, 20, 10, 0]  # N at the tip: moments of 0.41 and 0.26 N m per N
    stated = [20 if row == 3 else 50 if row == 7 else load for row, load in enumerate(loads)]
    rows = [f"{said},0,{0.41 * load},{0.26 * load}" for said, load in zip(stated, loads, strict=True)]
    (folder / "cells.csv").write_text("\n".join(["load_N,arm_mm,upper,lower", *rows]))
    result = run("check", folder, "--picture", tmp_path / "p.png")
    assert result.exit_code == 2
    assert result.stderr.count("2 calibration points contradict the others") == 1


def test_json_holds_every_finding_in_parts(folder, tmp_path):
    (folder / "photos" / "0003.png").write_bytes(b"")
    result = run("check", folder, "--json", "--picture", tmp_path / "p.png")
    summary = json.loads(result.stdout)
    assert summary["exit_code"] == result.exit_code == 1
    assert summary["picture"] == str(tmp_path / "p.png")
    (row,) = summary["findings"]
    assert row["level"] == "fault"
    assert row["file"] == "0003.png"
    assert row["place"] == "camera.photos, frame 3"
    assert "empty" in row["value"]


def test_a_picture_that_cannot_be_written_is_refused(folder, tmp_path):
    result = run("check", folder, "--picture", tmp_path / "p.gif")
    assert result.exit_code == 2
    assert ".png, .svg, .pdf" in result.stderr


ANSWERS = {
    "width_mm": "218.0",
    "unit_weight_kN_m3": "15.7",
    "peak_friction_deg": "50.0",
    "residual_friction_deg": "32.0",
    "spacing_mm": "150.0",
    "lower_to_tip_mm": "260.0",
}


def test_a_made_folder_goes_from_draft_to_results_with_the_guesses_as_they_are(tmp_path):
    folder = tmp_path / "left"
    options = SynthOptions(seed=40, frames=6, direction=Direction.LEFT, mm_per_px=0.4, displacement_mm=20.0)
    make_folder(folder, options)
    shutil.rmtree(folder / "truth")
    (folder / "test.toml").unlink()
    assert run("init", folder).exit_code == 0
    path = folder / "test.toml"
    text = path.read_text(encoding="utf-8")
    assert 'direction = "left"' in text

    def answer(match):
        return f"{match[1]} = {(match[2] or '').strip() or ANSWERS[match[1]]}"

    path.write_text(re.sub(r"^# (\w+) = (.* )?\?$", answer, text, flags=re.MULTILINE), encoding="utf-8")
    checked = run("check", folder, "--picture", tmp_path / "p.png")
    assert checked.exit_code == 0, checked.output
    processed = run("process", folder, "--json")
    assert processed.exit_code == 0, processed.output
    assert (folder / "results" / "report.html").is_file()
