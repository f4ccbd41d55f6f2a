"""Real logs, beside what their sources say of them."""

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError
from ploughval.loadcells import read_log
from ploughval.loadcells.logs.names import Wanted
from ploughval.loadcells.logs.raw import RawLog
from ploughval.scene import LogColumns

VALUES = ("displacement_mm", "moment_upper", "moment_lower")


def real(name):
    root = os.environ.get("PLOUGHVAL_SHARED")
    shared = Path(root) if root else Path(__file__).resolve().parents[4] / "shared"
    path = shared / "realdata" / name
    if not path.is_file():
        pytest.skip("the real log is not here")
    return path


def bridges(upper, lower):
    """The series log as it is written: no header, milliseconds, 16 columns; a blade's travel it has not."""
    return LogColumns(
        time_s="1 [ms]", displacement_mm="13", moment_upper_Nm=str(upper), moment_lower_Nm=str(lower)
    )


@pytest.mark.parametrize(
    ("upper", "lower", "known"),
    [
        (11, 12, {"moment_upper": [73, 440, 731, 1052], "moment_lower": [8, 94, 338, 1041]}),
        (14, 15, {"moment_upper": [472, 614], "moment_lower": [481, 514]}),
        (13, 16, {}),
    ],
)
def test_the_dropouts_of_two_cells_in_series_are_found_and_nothing_else(upper, lower, known):
    log = read_log(
        real("loadcells_series_hx711/LoadCellCalibrationData.txt"), bridges(upper, lower), rate_hz=None
    )
    data = log.data
    assert len(data) == 1324
    for name in VALUES:
        assert np.flatnonzero(data[name].isna()).tolist() == known.get(name, [])
    assert set(data["status"]) == {"ok", *(["dropout"] if known else [])}
    assert len(log.faults) == len(known)
    for name, rows in known.items():
        lines = ", ".join(str(k + 1) for k in rows)
        expected = f"{name} drops out in rows {', '.join(map(str, rows))} (lines {lines}): left empty"
        assert expected in log.faults


def test_the_plateaus_of_two_cells_in_series_are_those_that_are_published():
    data = read_log(real("loadcells_series_hx711/LoadCellCalibrationData.txt"), bridges(11, 12)).data
    time = data["time_s"] - data["time_s"].iloc[0]
    assert data["time_s"].iloc[0] == 23.682
    published = {(17.2, 30.2): (9970, 10031), (65.9, 74.0): (39891, 40165), (113.5, 132.3): (28, 15)}
    for (start, end), levels in published.items():
        inside = (time >= start) & (time <= end)
        for name, zero, level in zip(VALUES[1:], (5794, 12458), levels, strict=True):
            # Noise of 80 counts in 80 rows or more: 9 counts; the published levels are of a median filter.
            assert data[name][inside].mean() - zero == pytest.approx(level, abs=25)


def test_irregular_sampling_is_kept_and_is_no_gap(tmp_path):
    for name, rows in (("finalRecording", 10_783), ("nylonSling1", 2_018)):
        path = real(f"loadcell_gym_hx711/{name}.csv")
        written = pd.read_csv(path)
        columns = LogColumns(
            time_s="time", displacement_mm="1", moment_upper_Nm="raw reading", moment_lower_Nm="raw reading"
        )
        log = read_log(path, columns)
        assert log.faults == ()
        assert len(log.data) == rows
        np.testing.assert_array_equal(log.data["time_s"], written["time"])
        np.testing.assert_array_equal(log.data["moment_upper"], written["raw reading"])


def test_the_ten_plateaus_of_a_calibration_keep_their_levels_and_number_of_samples():
    path = real("loadcell_gym_hx711/finalRecording.csv")
    levels = pd.read_csv(real("loadcell_gym_hx711/finalCalibration.csv"))["measured"]
    columns = LogColumns(
        time_s="time", displacement_mm="1", moment_upper_Nm="raw reading", moment_lower_Nm="raw reading"
    )
    readings = read_log(path, columns).data["moment_upper"].to_numpy()
    near = [int((np.abs(readings - level) < 2000).sum()) for level in levels]
    assert near == [70, 753, 423, 345, 546, 756, 1448, 763, 759, 690]
    for level in levels:
        assert np.median(readings[np.abs(readings - level) < 2000]) == pytest.approx(level, abs=1000)


def tdms(name, **columns):
    pytest.importorskip("nptdms")
    from ploughval.loadcells.logs.tdms import read_tdms

    return read_tdms(real(f"tdms_samples/{name}.tdms"), Wanted(columns, frozenset()))


def test_scaled_channels_of_a_daq_are_read_to_the_published_values():
    log = read_log_of_three("raw1", "First  Channel", time_s="Second Channel")
    known = [-0.18402661, 0.14801477, -0.24506363, -0.29725028, -0.20020142, 0.18158513, 0.02380444]
    np.testing.assert_allclose(log.values["moment_upper"][:7], known, atol=5e-9)
    assert log.values["moment_upper"].size == 2000


def read_log_of_three(file, channel, *, time_s):
    return tdms(file, time_s=time_s, displacement_mm=channel, moment_upper=channel, moment_lower=channel)


def test_a_waveform_whose_start_was_never_set_counts_from_zero():
    log = read_log_of_three("big_endian", "Phase sweep", time_s="time_s")
    known = [0.0, 0.0634176, 0.1265799, 0.1892325, 0.2511234, 0.3120033, 0.3716271, 0.4297548]
    np.testing.assert_allclose(log.values["moment_upper"][:8], known, atol=5e-8)
    assert log.time.dtype.kind == "f"
    np.testing.assert_allclose(log.time, 0.001 * np.arange(3500), rtol=1e-12)


def test_groups_with_blanks_and_slashes_in_their_names_are_read():
    pytest.importorskip("nptdms")
    from nptdms import TdmsFile

    path = real("tdms_samples/Digital_Input.tdms")
    group = next(g.name for g in TdmsFile.read(path).groups() if g.name.endswith("Decimated Data_Level1"))
    channel = f"{group}/Dev1_port3_line7 - line 0"
    log = read_log_of_three("Digital_Input", channel, time_s=channel)
    assert log.values["moment_lower"][:10].tolist() == [0, 1, 0, 1, 0, 1, 0, 1, 0, 1]


def test_absolute_times_of_a_waveform_count_from_the_first_row_and_name_it():
    pytest.importorskip("nptdms")
    from nptdms import TdmsFile

    path = real("tdms_samples/raw_timestamps.tdms")
    name = TdmsFile.read(path).groups()[0].channels()[0].name
    log = read_log(path, LogColumns(displacement_mm=name, moment_upper_Nm=name, moment_lower_Nm=name))
    np.testing.assert_allclose(log.data["time_s"], 0.001 * np.arange(128), atol=1e-9)
    assert any("2024-01-24 01:48:43.068614" in note for note in log.notes)


def test_a_channel_that_is_not_there_names_those_that_are():
    with pytest.raises(DataError, match="Phase sweep"):
        read_log_of_three("big_endian", "force", time_s="time_s")


def test_raw_logs_are_values():
    log = read_log_of_three("big_endian", "Phase sweep", time_s="time_s")
    assert isinstance(log, RawLog)
    assert log.rows.count == 3500
