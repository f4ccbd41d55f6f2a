"""Several files as one log: order, overlaps, clocks that start anew, gaps; each named with file and row."""

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import ConfigError, DataError
from ploughval.loadcells import measure_force, read_log
from ploughval.loadcells.logs.files import log_paths
from ploughval.run.provenance import input_digests
from ploughval.scene import LogColumns, load_scene

NAMES = ["time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm"]
KEYS = ["time_s", "displacement_mm", "moment_upper", "moment_lower"]


def whole(rows=3000, seed=1):
    """10 s of rest, then 1 mm/s for 20 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(rows) / 100
    u = np.clip(t - 10, 0, None)
    loads = np.stack([1 + 0.2 * u, 0.5 + 0.1 * u]) + rng.normal(0, 0.002, (2, rows))
    return pd.DataFrame(np.column_stack([t, u, *loads]).round(5), columns=NAMES)


def write(folder, **parts):
    """Files of these names; each a part of the log."""
    paths = []
    for name, part in parts.items():
        paths.append(folder / f"{name}.csv")
        part.to_csv(paths[-1], index=False)
    return paths


def read(paths, **options):
    return read_log(paths, LogColumns(), **options)


def test_files_that_follow_one_another_are_one_log(tmp_path):
    log = whole()
    found = read(write(tmp_path, a=log[:1000], b=log[1000:2500], c=log[2500:]))
    np.testing.assert_array_equal(found.data[KEYS], log)
    assert found.faults == ()


def test_times_tell_the_order_of_files(tmp_path):
    log = whole()
    found = read(write(tmp_path, a=log[2000:], b=log[:2000]))
    np.testing.assert_array_equal(found.data[KEYS], log)
    assert found.faults == ("files put in order of time: b.csv, a.csv",)


def test_rows_that_a_file_repeats_are_dropped(tmp_path):
    log = whole()
    found = read(write(tmp_path, a=log[:1500], b=log[1400:]))
    np.testing.assert_array_equal(found.data[KEYS], log)
    assert len(found.faults) == 1
    expected = (
        "b.csv rows 0, 1, 2, 3, 4 (lines 2, 3, 4, 5, 6) and 95 more from before the end of the file before"
    )
    assert expected in found.faults[0]


def test_a_clock_that_starts_anew_in_each_file_goes_on(tmp_path):
    log = whole()
    second, third = log[1000:2000].copy(), log[2000:].copy()
    second["time_s"] -= 10.0
    third["time_s"] -= 20.0
    found = read(write(tmp_path, a=log[:1000], b=second, c=third))
    np.testing.assert_allclose(found.data["time_s"], log["time_s"], atol=1e-9)
    np.testing.assert_array_equal(found.data[KEYS[1:]], log[NAMES[1:]])
    assert len(found.faults) == 2
    assert "the clock starts anew in b.csv: its times moved on by 10 s" in found.faults[0]
    assert "how long the pause was is not known" in found.faults[0]
    assert "c.csv: its times moved on by 20 s" in found.faults[1]


def test_a_gap_between_files_is_named_by_file_and_row(tmp_path):
    log = whole()
    found = read(write(tmp_path, a=log[:1500], b=log[1700:]))
    assert len(found.faults) == 1
    assert "1 gap in time before b.csv row 0 (line 2), the longest 2.01 s" in found.faults[0]
    assert (found.data["status"] == "gap").sum() == 1


def test_faults_within_files_name_their_file(tmp_path):
    log = whole()
    log.loc[[5, 1600], "moment_upper_Nm"] = np.nan
    late = log[1500:].copy()
    late.iloc[[10, 11]] = late.iloc[[11, 10]].to_numpy()
    found = read(write(tmp_path, a=log[:1500], b=late))
    assert found.faults == (
        "b.csv: row 11 (line 13) out of order: sorted by time",
        "moment_upper is not finite in a.csv row 5 (line 7); b.csv row 100 (line 102): left empty",
    )


def test_a_time_that_leaps_in_one_file_does_not_move_the_next(tmp_path):
    log = whole()
    first = log[:1500].copy()
    first.loc[700, "time_s"] = 1e6
    found = read(write(tmp_path, a=first, b=log[1500:]))
    assert len(found.data) == len(log) - 1
    assert found.faults == ("a.csv: time leaps away and back in row 700 (line 702): dropped",)


def test_date_times_put_files_in_order_across_midnight(tmp_path):
    log = whole()
    stamps = (pd.Timestamp("2026-11-27 23:59:50") + pd.to_timedelta(log["time_s"], unit="s")).dt
    dated = log.assign(time_s=stamps.strftime("%d.%m.%Y %H:%M:%S.%f"))
    found = read(write(tmp_path, late=dated[1200:], early=dated[:1200]))
    np.testing.assert_allclose(found.data["time_s"], log["time_s"], atol=1e-6)
    of_day = log.assign(time_s=stamps.strftime("%H:%M:%S.%f"))
    found = read(write(tmp_path, early=of_day[:1200], late=of_day[1200:]))
    np.testing.assert_allclose(found.data["time_s"], log["time_s"], atol=1e-6)


def test_rows_without_times_are_counted_through_all_files(tmp_path):
    log = whole().drop(columns="time_s")
    found = read(write(tmp_path, a=log[:1000], b=log[1000:]), rate_hz=100.0)
    np.testing.assert_allclose(found.data["time_s"], np.arange(3000) / 100, atol=1e-12)
    assert found.faults == ()


def test_files_with_different_kinds_of_times_are_refused(tmp_path):
    log = whole()
    dated = log[1000:].assign(time_s="2026-11-27 10:00:00")
    with pytest.raises(DataError, match=r"b\.csv: holds date-times, a\.csv holds numbers"):
        read(write(tmp_path, a=log[:1000], b=dated))


def test_a_file_without_any_time_is_left_out_by_name(tmp_path):
    log = whole()
    found = read(write(tmp_path, a=log, b=log[:3].assign(time_s=np.nan)))
    np.testing.assert_array_equal(found.data[KEYS], log)
    assert "b.csv holds no row with a time: left out" in found.faults


def scene(folder, log):
    (folder / "test.toml").write_text(
        f'[test]\nname = "t"\n[blade]\ndepth_mm = 30.0\nwidth_mm = 218.0\nthickness_mm = 5.0\n'
        f"[loadcells]\nlog = {log}\nspacing_mm = 150.0\nlower_to_tip_mm = 260.0\n"
    )
    return load_scene(folder)


@pytest.mark.parametrize(
    "log", ['["part_*.csv"]', '"part_*.csv"', '["part_1.csv", "part_2.csv", "part_10.csv"]']
)
def test_a_scene_names_several_files_in_the_natural_order_of_their_names(tmp_path, log):
    record = whole()
    parts = record[:1000], record[1000:2000], record[2000:]
    write(tmp_path, **dict(zip(("part_1", "part_2", "part_10"), parts, strict=True)))
    made = scene(tmp_path, log)
    assert [p.name for p in log_paths(made, made.loadcells)] == ["part_1.csv", "part_2.csv", "part_10.csv"]
    assert {"part_1.csv", "part_2.csv", "part_10.csv"} <= set(input_digests(made))
    result = measure_force(made)
    np.testing.assert_array_equal(result.record["time_s"], record["time_s"])


def test_a_list_with_a_file_that_is_missing_is_refused_by_its_place(tmp_path):
    write(tmp_path, a=whole())
    with pytest.raises(ConfigError, match=r"loadcells\.log\.1: got 'b\.csv'"):
        scene(tmp_path, '["a.csv", "b.csv"]')
    with pytest.raises(ConfigError, match=r"loadcells\.log"):
        scene(tmp_path, "[]")
