"""One bad photograph, reading or empty run costs only what depends on it, and the ledger says so."""

import json
import shutil

import pandas as pd
import pytest

from broken.base import make_sound
from ploughval.run import process_folder

OF_PHOTOGRAPHS = ("surface.csv", "layers.csv", "increments.csv", "calibration.json")
OF_FORCE = ("force.csv", "budget.csv")


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    folder = tmp_path_factory.mktemp("partial") / "sound"
    make_sound(folder)
    assert process_folder(folder).complete
    return folder


@pytest.fixture
def folder(sound, tmp_path):
    return shutil.copytree(sound, tmp_path / "test", ignore=shutil.ignore_patterns("results"))


def same(sound, outcome, names):
    return [
        name
        for name in names
        if (sound / "results" / name).read_bytes() == (outcome.results / name).read_bytes()
    ]


def ledger(outcome):
    return json.loads((outcome.results / "run.json").read_text())


def test_a_bad_photograph_costs_its_frame_and_no_byte_of_the_force(sound, folder):
    (folder / "photos/0002.png").write_bytes(b"")
    outcome = process_folder(folder)
    assert not outcome.complete
    assert [row["status"] for row in ledger(outcome)["frames"]] == ["ok", "ok", "lost", "ok"]
    assert "empty (0 bytes)" in ledger(outcome)["frames"][2]["reason"]
    assert same(sound, outcome, OF_FORCE) == list(OF_FORCE)
    whole, part = (pd.read_csv(place / "surface.csv") for place in (sound / "results", outcome.results))
    others = whole[whole["frame"] != 2].reset_index(drop=True)
    pd.testing.assert_frame_equal(others, part)


def test_a_bad_reading_costs_its_row_of_the_force_and_no_byte_of_the_photographs(sound, folder):
    lines = (folder / "loadcells.csv").read_text().splitlines()
    row = lines[90].split(",")
    lines[90] = ",".join([*row[:2], "err", row[3]])
    (folder / "loadcells.csv").write_text("\n".join(lines) + "\n")
    outcome = process_folder(folder)
    force = pd.read_csv(outcome.results / "force.csv")
    assert force.loc[89, "status"] == "not_finite"
    assert force["force_N"].isna().sum() == 1
    assert any("'err'" in warning and "line 91" in warning for warning in outcome.warnings)
    assert same(sound, outcome, OF_PHOTOGRAPHS) == list(OF_PHOTOGRAPHS)


def test_a_cell_that_gave_nothing_costs_the_force_and_not_the_photographs(sound, folder):
    table = pd.read_csv(folder / "loadcells.csv")
    table.assign(moment_lower_Nm=float("nan")).to_csv(folder / "loadcells.csv", index=False)
    outcome = process_folder(folder)
    assert not outcome.complete
    assert any("moment_lower_Nm" in fault and "no number" in fault for fault in outcome.faults)
    assert not (outcome.results / "force.csv").exists()
    assert (outcome.results / "surface.csv").exists()
    assert all(row["status"] == "ok" for row in ledger(outcome)["frames"])


def test_a_missing_empty_run_costs_that_run_alone(sound, folder):
    text = (folder / "test.toml").read_text()
    (folder / "test.toml").write_text(text.replace('["empty/*.csv"]', '["empty/run1.csv", "empty/run2.csv"]'))
    (folder / "empty/run1.csv").unlink()
    outcome = process_folder(folder)
    assert not outcome.complete
    (fault,) = outcome.faults
    assert "no file matches 'empty/run1.csv'" in fault
    assert fault in ledger(outcome)["faults"]
    assert pd.read_csv(outcome.results / "force.csv")["friction_N"].abs().max() > 0
    assert same(sound, outcome, OF_PHOTOGRAPHS) == list(OF_PHOTOGRAPHS)


def test_without_any_empty_run_that_is_asked_for_the_force_is_there_and_not_compensated(sound, folder):
    for path in (folder / "empty").iterdir():
        path.unlink()
    outcome = process_folder(folder)
    assert not outcome.complete
    force = pd.read_csv(outcome.results / "force.csv")
    assert force["force_N"].notna().any()
    assert force["friction_N"].isna().all()
    assert any("not compensated for friction" in warning for warning in outcome.warnings)
