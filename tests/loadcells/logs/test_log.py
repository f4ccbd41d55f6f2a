"""Logs of many dialects read to the same numbers."""

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError, MissingExtraError
from ploughval.loadcells import read_log
from ploughval.scene import LogColumns

NAMES = ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
N = 300


def numbers():
    t = np.arange(N) * 0.5
    u = np.clip(t - 20, 0, None)
    noise = np.random.default_rng(3).normal(0, 0.01, (2, N))
    return np.stack([t, u, 1.5 + 0.1 * u + noise[0], -0.5 + 0.05 * u + noise[1]], axis=1).round(4)


def text(separator=",", decimal=".", head=(), tail=""):
    rows = [separator.join(f"{value:.4f}".replace(".", decimal) for value in row) + tail for row in numbers()]
    return "\n".join([*head, *rows]) + "\n"


def check(log, faults=()):
    values = log.data[["time_s", "displacement_mm", "moment_upper", "moment_lower"]].to_numpy()
    np.testing.assert_array_equal(values, numbers())
    assert log.faults == faults


@pytest.mark.parametrize("separator", [",", ";", "\t", "|", " "])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_separators_and_byte_order_marks_are_found(tmp_path, separator, encoding):
    path = tmp_path / "log.csv"
    path.write_text(text(separator, head=[separator.join(NAMES)]), encoding=encoding)
    check(read_log(path, LogColumns()))


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_are_found(tmp_path, separator):
    path = tmp_path / "log.txt"
    path.write_text(text(separator, ",", head=[separator.join(NAMES)]))
    check(read_log(path, LogColumns()))


def test_preamble_and_units_are_skipped(tmp_path):
    path = tmp_path / "log.csv"
    head = ["Rig 7, written by DAQ", "", ",".join(NAMES), "s,mm,N m,N m", "", "-,-,-,-"]
    path.write_text(text(head=head), encoding="latin-1")
    check(read_log(path, LogColumns()))


def test_trailing_separators_and_columns_of_text_do_no_harm(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(text(head=[",".join(NAMES) + ",note"], tail=",a note"))
    check(read_log(path, LogColumns()))
    path.write_text(text(head=[",".join(NAMES) + ","], tail=","))
    check(read_log(path, LogColumns()))


def test_a_table_without_names_is_read_by_number(tmp_path):
    path = tmp_path / "log.txt"
    path.write_text(text(head=[]))
    check(
        read_log(path, LogColumns(time_s="1", displacement_mm="2", moment_upper_Nm="3", moment_lower_Nm="4"))
    )


def test_renamed_columns_are_read_in_any_order(tmp_path):
    path = tmp_path / "log.csv"
    table = pd.DataFrame(numbers(), columns=["t", "x", "M2", "M1"])[["M1", "x", "M2", "t"]]
    table.to_csv(path, index=False)
    columns = LogColumns(time_s="t", displacement_mm="x", moment_upper_Nm="M2", moment_lower_Nm="M1")
    check(read_log(path, columns))


def test_a_missing_column_names_those_that_are_there_and_the_setting(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(text(head=["time_s,travel,moment_upper_Nm,moment_lower_Nm"]))
    with pytest.raises(DataError) as caught:
        read_log(path, LogColumns())
    for word in ("displacement_mm", "travel", "moment_lower_Nm", "[loadcells.columns]", str(path)):
        assert word in str(caught.value)


def test_torn_and_overlong_lines_are_named(tmp_path):
    path = tmp_path / "log.csv"
    lines = text(head=[",".join(NAMES)]).splitlines()
    lines[50] += ",1.0,2.0"
    lines[80] = "39.5,19.5,OVL,0.4750"
    path.write_text("\n".join(lines[:-1]) + "\n" + lines[-1][:12])
    log = read_log(path, LogColumns())
    assert log.faults == (
        "too many fields in line 51 (expected 4): dropped",
        "the last line is cut off in row 299 (line 301): dropped",
        "moment_upper holds text where a number was expected ('OVL') in row 79 (line 81)",
        "moment_upper is not finite in row 79 (line 81): left empty",
    )
    assert len(log.data) == N - 2


@pytest.mark.parametrize(
    "content", [b"", b"time_s,displacement_mm,moment_upper_Nm,moment_lower_Nm\n", b"\x89PNG\r\n\x00\xff" * 50]
)
def test_files_without_numbers_are_refused_with_their_name(tmp_path, content):
    path = tmp_path / "log.csv"
    path.write_bytes(content)
    with pytest.raises(DataError, match=r"log\.csv"):
        read_log(path, LogColumns())


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(DataError, match=r"none\.csv"):
        read_log(tmp_path / "none.csv", LogColumns())


def test_tdms_channels_are_read_with_or_without_a_time_channel(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    table = numbers()
    waveform = {"wf_increment": 0.5, "wf_start_offset": 0.0, "wf_samples": N}
    channels = [
        nptdms.ChannelObject("rig", name, table[:, k], properties=waveform) for k, name in enumerate(NAMES)
    ]
    for start, name in ((0, "with.tdms"), (1, "without.tdms")):
        with nptdms.TdmsWriter(tmp_path / name) as writer:
            writer.write_segment(channels[start:])
        check(read_log(tmp_path / name, LogColumns()))
    with pytest.raises(DataError, match="rig/displacement_mm"):
        read_log(tmp_path / "with.tdms", LogColumns(displacement_mm="x"))


def test_tdms_without_its_package_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "nptdms", None)
    with pytest.raises(MissingExtraError, match=r"ploughval\[tdms\]"):
        read_log(tmp_path / "log.tdms", LogColumns())


def shared():
    root = os.environ.get("PLOUGHVAL_SHARED")
    return Path(root) if root else Path(__file__).resolve().parents[4] / "shared"


def test_the_twelve_dropouts_of_a_real_log_are_found(tmp_path):
    source = shared() / "realdata/loadcells_series_hx711/LoadCellCalibrationData.txt"
    if not source.is_file():
        pytest.skip("the real log is not here")
    table = pd.read_csv(source, header=None)
    known = {10: [73, 440, 731, 1052], 11: [8, 94, 338, 1041], 13: [472, 614], 14: [481, 514]}
    found = {}
    for upper, lower in ((10, 11), (12, 13), (14, 15)):
        path = tmp_path / "log.csv"
        part = table[[0, 1, upper, lower]].set_axis(list(NAMES), axis=1)
        part.assign(time_s=part["time_s"] / 1000).to_csv(path, index=False)
        log = read_log(path, LogColumns())
        assert len(log.data) == 1324
        for place, name in ((upper, "moment_upper"), (lower, "moment_lower")):
            rows = np.flatnonzero(log.data[name].isna())
            if rows.size:
                found[place] = rows.tolist()
    assert found == known
