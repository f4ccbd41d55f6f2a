"""Folders with one thing wrong: no internal error, what is lost is named, the rest is kept.

With `process` where the page has less to show, else without the page, which takes longer than the rest.
"""

import json
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from PIL import Image

from ploughval import process
from ploughval.axes import Status
from ploughval.errors import ConfigError
from ploughval.run import process_folder
from ploughval.synth import EXAMPLE, make_folder


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    path = tmp_path_factory.mktemp("damaged") / "sound"
    make_folder(path, replace(EXAMPLE, seed=2, frames=4, displacement_mm=6.0))
    return path


@pytest.fixture
def folder(sound, tmp_path):
    return shutil.copytree(sound, tmp_path / "test")


def photographs(folder):
    return sorted((folder / "photos").iterdir())


def change(folder, old, new):
    path = folder / "test.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def record(outcome):
    return json.loads((outcome.results / "run.json").read_text())


def test_one_photograph_gives_no_bands_and_the_force_all_the_same(folder):
    for path in photographs(folder)[1:]:
        path.unlink()
    times = (folder / "photos.csv").read_text().splitlines()
    (folder / "photos.csv").write_text("\n".join(times[:2]) + "\n")
    outcome = process(folder)
    assert len(pd.read_csv(outcome.results / "bands.csv")) == 0
    assert pd.read_csv(outcome.results / "force.csv")["force_N"].notna().any()


def test_photographs_outside_the_log_have_no_displacement_and_it_is_said(folder):
    change(folder, "clock_offset_s = 0.0", "clock_offset_s = 500.0")
    outcome = process(folder)
    assert any("outside the log" in warning for warning in outcome.warnings)
    assert pd.read_csv(outcome.results / "blade.csv")["u_mm"].isna().all()


def test_a_first_photograph_that_cannot_be_read_costs_the_photographs_alone(folder):
    first = photographs(folder)[0]
    first.write_bytes(first.read_bytes()[:300])
    outcome = process(folder)
    assert not outcome.complete
    assert any(first.name in fault for fault in outcome.faults)
    assert (outcome.results / "force.csv").is_file()
    assert (outcome.results / "model" / "force.csv").is_file()
    assert {row["status"] for row in record(outcome)["frames"]} == {"lost"}


def test_a_second_photograph_at_rest_stands_for_a_first_one_that_cannot_be_read(folder):
    first = photographs(folder)[0]
    (folder / "photos" / "early.png").write_bytes(first.read_bytes()[:300])
    times = (folder / "photos.csv").read_text().splitlines()
    early = float(times[1].split(",")[1]) - 2.0
    (folder / "photos.csv").write_text("\n".join([*times, f"early.png,{early}"]) + "\n")
    outcome = process_folder(folder)
    assert not outcome.complete
    assert [row["status"] for row in record(outcome)["frames"]] == ["lost", "ok", "ok", "ok", "ok"]
    assert any("frame 1 shows the sand at rest" in warning for warning in outcome.warnings)
    with xr.open_dataset(outcome.results / "tracks.nc", engine="h5netcdf") as tracks:
        assert set(np.unique(tracks["status"][0])) == {Status.FRAME_MISSING}
        assert np.isfinite(tracks["x_mm"][1]).all()
        assert np.isfinite(tracks["x_mm"][4]).mean() > 0.7
    blade = pd.read_csv(outcome.results / "blade.csv")
    assert np.abs(blade["blade_x_mm"] - blade["u_mm"])[1:].max() < 0.1  # a third of a pixel


def test_a_photograph_with_a_time_that_is_not_there_makes_the_test_incomplete(folder):
    gone = photographs(folder)[2]
    gone.unlink()
    outcome = process_folder(folder)
    assert not outcome.complete
    assert any(gone.name in fault and "not there" in fault for fault in outcome.faults)
    assert {row["status"] for row in record(outcome)["frames"]} == {"ok"}


def test_a_blank_photograph_is_a_lost_frame(folder):
    path = photographs(folder)[2]
    with Image.open(path) as image:
        size = image.size
    Image.new("L", size, 255).save(path)
    outcome = process(folder)
    assert not outcome.complete
    assert [row["status"] for row in record(outcome)["frames"]] == ["ok", "ok", "lost", "ok"]


def test_photographs_that_stand_still_while_the_log_moves_are_doubted(folder):
    first, *others = photographs(folder)
    for path in others:
        shutil.copy(first, path)
    outcome = process_folder(folder)
    assert any("differ by" in warning for warning in outcome.warnings)


def test_a_tip_outside_the_picture_is_refused(folder):
    text = (folder / "test.toml").read_text()
    line = next(row for row in text.splitlines() if row.startswith("tip_px"))
    change(folder, line, "tip_px = [56.7, 1e6]")
    with pytest.raises(ConfigError, match="tip_px"):
        process_folder(folder)


def test_the_wrong_direction_is_named_not_passed_over(folder):
    change(folder, 'direction = "right"', 'direction = "left"')
    outcome = process(folder)
    assert not outcome.complete
    assert any("direction" in fault for fault in outcome.faults)


def test_results_never_take_the_place_of_the_tests_own_files(folder):
    (folder / "loadcells.csv").rename(folder / "force.csv")
    change(folder, 'log = "loadcells.csv"', 'log = "force.csv"')
    before = (folder / "force.csv").read_bytes()
    with pytest.raises(ConfigError, match=r"force\.csv"):
        process_folder(folder, out=folder)
    assert (folder / "force.csv").read_bytes() == before


def test_a_refused_run_leaves_earlier_results_and_a_started_one_does_not_claim_them(folder):
    outcome = process_folder(folder)
    change(folder, "depth_mm = 30.0", "depth_mm = -30.0")
    with pytest.raises(ConfigError):
        process_folder(folder)
    assert (outcome.results / "run.json").is_file()
    change(folder, "depth_mm = -30.0", "depth_mm = 29.0")
    again = process_folder(folder)
    assert record(again)["settings"]["blade"]["depth_mm"] == 29.0


def test_another_log_does_not_redo_the_photographs(folder):
    first = process_folder(folder)
    before = record(first)["inputs"]
    (kept,) = (first.results / ".store").glob("window-*.npz")
    log = folder / "loadcells.csv"
    log.write_text("\n".join(log.read_text().splitlines()[:-3]) + "\n")
    again = process_folder(folder)
    assert list((again.results / ".store").glob("window-*.npz")) == [kept]
    after = record(again)["inputs"]
    assert [name for name in before if after[name] != before[name]] == ["loadcells.csv"]
    photograph = photographs(folder)[-1]
    shutil.copy(photographs(folder)[1], photograph)
    changed = process_folder(folder)
    assert list((changed.results / ".store").glob("window-*.npz")) != [kept]


def test_synth_does_not_write_over_a_real_test(folder):
    shutil.rmtree(folder / "truth")
    before = (folder / "test.toml").read_bytes()
    with pytest.raises(ConfigError, match="not made by synth"):
        make_folder(folder, EXAMPLE, overwrite=True)
    assert (folder / "test.toml").read_bytes() == before


def test_a_travel_shorter_than_a_photograph_interval_still_has_its_files(folder):
    change(folder, "[tracers]", "[model]\ndisplacement_mm = 1e-6\n\n[tracers]")
    outcome = process_folder(folder)
    assert np.isfinite(pd.read_csv(outcome.results / "model" / "force.csv")["force_N"]).all()
