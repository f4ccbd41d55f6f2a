"""A folder as camera and logger leave it: what is read from it is what was made, and notes tell the rest."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import ConfigError
from ploughval.loadcells import measure_force
from ploughval.photos import calibrate, open_frames
from ploughval.scene import load_scene
from ploughval.synth import RECORDED, SynthOptions, load_truth, make_recorded

SMALL = replace(RECORDED, seed=5, name="d30", frames=4, displacement_mm=6.0, empty_runs=2)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded") / "d30"
    make_recorded(folder, SMALL)
    return folder


def dots(folder):
    rows = re.findall(r"^\| \d+ \| (\S+) \| (\S+) \|$", (folder / "notes.md").read_text(), re.MULTILINE)
    return np.array(rows, float)


def scene_of(folder, tmp_path, *, tables=""):
    """Settings that a user would write, in the folder of the test."""
    text = (
        '[test]\nname = "d30"\n[blade]\ndepth_mm = 30.0\nwidth_mm = 218.0\n'
        '[camera]\nphotos = "DCIM/100BLADE/*.JPG"\ntimes = "exif"\n'
        f"{tables}"
        '[loadcells]\nlog = "logger/test.csv"\nempty = ["empty/*.csv"]\nspacing_mm = 150.0\n'
        'lower_to_tip_mm = 260.0\nrest_s = [0.0, 9.5]\ncalibration.files = ["calibration/cells.csv"]\n'
        '[loadcells.columns]\ntime_s = "Time"\ndisplacement_mm = "Displacement"\n'
        'moment_upper_Nm = "Upper cell"\nmoment_lower_Nm = "Lower cell"\n'
    )
    source = folder / "test.toml"
    source.write_text(text)
    try:
        return load_scene(folder)
    finally:
        source.unlink()


def test_exif_holds_the_times_of_the_photographs(recorded, tmp_path):
    scene = scene_of(recorded, tmp_path, tables="mm_per_px = 0.3\ntip_px = [56.7, 263.5]\n")
    truth = load_truth(recorded)
    frames = open_frames(scene)
    since_first = truth.blade["time_s"] - truth.blade["time_s"].iloc[0]
    assert np.allclose(frames.time_s, since_first, rtol=0, atol=0.006)  # stamped to a hundredth of a second
    assert not frames.faults
    assert frames.shots[0].exposure_s == pytest.approx(0.008)


def test_dots_of_the_notes_calibrate_the_photographs(recorded, tmp_path):
    truth, places_mm = load_truth(recorded), dots(recorded)
    places_px = truth.tip_px + places_mm * [1, -1] / SMALL.mm_per_px
    points = np.column_stack([places_px.round() + 1.0, places_mm]).tolist()
    scene = scene_of(
        recorded, tmp_path, tables=f"control_points = {points}\n[camera.markers]\nradius_px = 6.0\n"
    )
    found = calibrate(scene, open_frames(scene))
    assert len(places_mm) == SMALL.markers
    assert found.mm_per_px == pytest.approx(SMALL.mm_per_px, rel=1e-3)
    assert np.abs(found.to_mm(np.array(truth.tip_px))).max() < 0.02


def test_known_loads_and_the_log_in_mV_per_V_give_the_force(recorded, tmp_path):
    scene = scene_of(recorded, tmp_path, tables="mm_per_px = 0.3\ntip_px = [56.7, 263.5]\n")
    truth = load_truth(recorded)
    force = measure_force(scene)
    assert force.faults == ("no load_std_N: the weights are taken as exact",)
    moving = force.record["time_s"].to_numpy() > 10.5
    true = np.interp(force.record["time_s"], truth.force["time_s"], truth.force["force_N"])
    error = (force.record["force_N"].to_numpy() - true)[moving]
    assert np.abs(error.mean()) < 2 * force.record["force_std_N"].to_numpy()[moving].max()
    assert np.abs(error.mean()) < 0.02 * true[moving].mean()


def test_settings_of_the_truth_are_those_of_a_made_folder(recorded):
    told = (recorded / "truth" / "test.toml").read_text()
    assert "mm_per_px = 0.3" in told
    assert not (recorded / "test.toml").exists()
    assert not (recorded / "photos").exists()


def test_what_was_left_half_made_is_made_anew_and_what_is_whole_stays(tmp_path):
    options = replace(SMALL, photographs=False)
    make_recorded(tmp_path / "d30", options)
    with pytest.raises(ConfigError, match="not empty"):
        make_recorded(tmp_path / "d30", options)
    (tmp_path / "d30" / "truth" / "test.toml").unlink()
    make_recorded(tmp_path / "d30", options)
    assert (tmp_path / "d30" / "truth" / "test.toml").is_file()


def test_the_log_reads_with_decimal_commas_and_no_photographs_leave_no_card(tmp_path):
    make_recorded(tmp_path / "d30", replace(SMALL, photographs=False))
    table = pd.read_csv(tmp_path / "d30" / "logger" / "test.csv", sep=";", decimal=",", skiprows=2)
    assert "Time [s]" in table
    assert np.allclose(np.diff(table["Time [s]"]), 0.02)
    assert not (tmp_path / "d30" / "DCIM").exists()
    assert "Dots" not in (tmp_path / "d30" / "notes.md").read_text()


def test_other_photographs_than_jpeg_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="image_format"):
        make_recorded(tmp_path / "d30", SynthOptions())
    assert not (tmp_path / "d30").exists()
