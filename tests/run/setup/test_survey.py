"""The files of a folder are told apart: test, empty runs, parts of one log, calibrations, tables of times."""

import json

import numpy as np
import pytest
from PIL import Image

from ploughval.run.setup.draft import draft_settings
from ploughval.run.setup.survey import survey

NAMES = "time_s,displacement_mm,moment_upper_Nm,moment_lower_Nm"


def write_log(path, *, load, start_s=0.0, rows=slice(None), names=NAMES):
    """A blade that moves from 5 s on at 1 mm/s; the cells' difference rises to `load` N m."""
    time = np.arange(0, 40, 0.1)
    u = np.clip(time - 5, 0, None)
    noise = np.random.default_rng(3).normal(0, 1e-3, (3, time.size))
    moment = load * np.minimum(u / 10, 1)
    table = np.column_stack([time + start_s, u + noise[0], 2 * moment + noise[1], moment + noise[2]])
    path.parent.mkdir(exist_ok=True, parents=True)
    np.savetxt(path, table[rows], fmt="%.5f", delimiter=",", header=names, comments="")


def take_photos(folder, count=3):
    (folder / "photos").mkdir()
    for k in range(count):
        Image.new("L", (64, 48)).save(folder / "photos" / f"{k}.png")


def test_the_test_is_the_run_with_the_largest_load(tmp_path):
    for name, load in (("a", 0.2), ("b", 5.0), ("c", 0.25)):
        write_log(tmp_path / f"{name}.csv", load=load)
    logs = survey(tmp_path).logs
    assert logs.log.names == ("b.csv",)
    assert dict(logs.empty_by_load) == pytest.approx({"a.csv": 0.04, "c.csv": 0.05}, abs=0.005)
    assert '# empty = ["a.csv", "c.csv"]' in draft_settings(tmp_path), "an offer, not a setting"


def test_a_second_run_as_heavy_as_the_test_is_not_taken_for_an_empty_box(tmp_path):
    write_log(tmp_path / "a.csv", load=5.0)
    write_log(tmp_path / "b.csv", load=4.0)
    logs = survey(tmp_path).logs
    assert logs.empty_by_load == ()
    assert logs.left == ("b.csv",)


@pytest.mark.parametrize(
    "name", ["empty/1.csv", "run_empty_2.csv", "leerfahrt.csv", "vide/a.csv", "Friction-1.csv"]
)
def test_empty_runs_are_told_by_their_names(tmp_path, name):
    write_log(tmp_path / "test.csv", load=5.0)
    write_log(tmp_path / name, load=4.0)
    found = survey(tmp_path)
    assert found.logs.log.names == ("test.csv",)
    assert len(found.empty) == 1


def test_files_whose_clocks_start_anew_are_one_log_where_the_travel_goes_on(tmp_path):
    parts = {1: slice(0, 200), 2: slice(200, 300), 10: slice(300, 400)}  # the second begins at 15 mm
    for number, rows in parts.items():
        write_log(tmp_path / f"log_{number}.csv", load=5.0, rows=rows, start_s=-rows.start * 0.1)
    assert survey(tmp_path).logs.log.names == ("log_1.csv", "log_2.csv", "log_10.csv")


def test_runs_that_all_start_at_rest_are_not_one_log(tmp_path):
    for name, load in (("a", 5.0), ("b", 0.2)):
        write_log(tmp_path / f"{name}.csv", load=load, rows=slice(0, 45))  # none of them moves
    assert len(survey(tmp_path).logs.log.names) == 1


def test_files_that_follow_on_are_one_log(tmp_path):
    for k, rows in enumerate((slice(0, 150), slice(150, 290), slice(290, 400)), start=9):
        write_log(tmp_path / f"log_{k}.csv", load=5.0, rows=rows)
    logs = survey(tmp_path).logs
    assert logs.log.names == ("log_9.csv", "log_10.csv", "log_11.csv")
    assert logs.log.travel_mm == pytest.approx(34.9, abs=0.1)
    assert 'log = ["log_9.csv", "log_10.csv", "log_11.csv"]' in draft_settings(tmp_path)


def test_tables_of_known_loads_are_offered(tmp_path):
    write_log(tmp_path / "test.csv", load=5.0)
    (tmp_path / "loads.csv").write_text("load_N,arm_mm,upper,lower\n0,0,1,2\n10,0,3,4\n", encoding="utf-8")
    found = survey(tmp_path)
    assert found.cell_tables == ("loads.csv",)
    assert found.logs.log.names == ("test.csv",)
    assert '# files = ["loads.csv"]' in draft_settings(tmp_path)


def test_a_table_of_times_that_misses_photographs_says_which(tmp_path):
    take_photos(tmp_path)
    (tmp_path / "photos.csv").write_text("file,time_s\n0.png,10\n2.png,14\n9.png,20\n", encoding="utf-8")
    photos = survey(tmp_path).photos
    assert photos.times == "photos.csv"
    assert photos.remarks == (
        "photos.csv misses 1 of 3 photographs: photos/1.png",
        "photos.csv names 1 that are not there: 9.png",
    )


def test_results_and_truth_are_no_part_of_a_test(tmp_path):
    for room in ("results", "truth"):
        write_log(tmp_path / room / "force.csv", load=5.0)
    found = survey(tmp_path)
    assert found.logs.log is None
    assert found.photos is None


def test_a_table_of_unknown_columns_is_asked_about(tmp_path):
    (tmp_path / "rec.txt").write_text("a;b;c\n" + "1,5;2;3\n" * 9, encoding="utf-8")
    text = draft_settings(tmp_path)
    assert '# log = "rec.txt" ?' in text
    assert "'a', 'b', 'c'" in text


def test_a_licence_is_no_log(tmp_path):
    (tmp_path / "LICENSE.txt").write_text("Permission, hereby, granted\n" * 5, encoding="utf-8")
    assert survey(tmp_path).logs.log is None


def test_the_larger_series_is_taken_and_the_other_is_named(tmp_path):
    take_photos(tmp_path, 4)
    Image.new("L", (64, 48)).save(tmp_path / "overview.jpg")
    photos = survey(tmp_path).photos
    assert photos.pattern == "photos/*.png"
    assert photos.left == ("1 more in . (.jpg)",)


def test_an_earlier_calibration_beside_the_folder_is_offered_if_it_fits(tmp_path):
    from ploughval.photos import calibrate, open_frames
    from ploughval.photos.calibration.file import calibration_record
    from ploughval.scene import load_scene

    earlier = tmp_path / "earlier"
    (earlier / "results").mkdir(parents=True)
    take_photos(earlier)
    (earlier / "test.toml").write_text(
        '[test]\nname = "e"\n[blade]\ndepth_mm = 3.0\nwidth_mm = 9.0\n[camera]\nphotos = "photos/*.png"\n'
        "mm_per_px = 0.1\ntip_px = [20.0, 30.0]\n",
        encoding="utf-8",
    )
    scene = load_scene(earlier)
    record = calibration_record(calibrate(scene, open_frames(scene)))
    (earlier / "results" / "calibration.json").write_text(json.dumps(record), encoding="utf-8")
    new = tmp_path / "new"
    new.mkdir()
    take_photos(new)
    assert survey(new).calibrations == ("../earlier/results/calibration.json",)
    assert '# calibration = "calibration.json"' in draft_settings(new)
    Image.new("L", (80, 48)).save(new / "photos" / "0.png")
    assert survey(new).calibrations == (), "photographs of another size"
