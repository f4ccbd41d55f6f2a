"""TDMS files: units, clocks, several groups, and spoiled files."""

import time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ploughval.errors import DataError, PloughvalError
from ploughval.loadcells import read_log
from ploughval.scene import LogColumns

nptdms = pytest.importorskip("nptdms")
N = 200
NAMES = ("displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
WAVE = {"wf_increment": 0.01, "wf_start_offset": 0.0, "wf_samples": N}


def values():
    k = np.arange(N)
    return np.stack([0.01 * (k % 7), 1 + 0.1 * (k % 9), 2 + 0.1 * (k % 5)])


def write(path, groups):
    """Channels by group and name: (samples, properties)."""
    with nptdms.TdmsWriter(path) as writer:
        for group, channels in groups.items():
            writer.write_segment(
                [nptdms.ChannelObject(group, name, v, properties=p) for name, (v, p) in channels.items()]
            )
    return path


def waves(scale=1.0, **properties):
    return {name: (v / scale, WAVE | properties) for name, v in zip(NAMES, values(), strict=True)}


def test_units_of_channels_are_converted(tmp_path):
    channels = {
        "travel": (values()[0] / 10, WAVE | {"unit_string": "cm"}),
        "upper": (values()[1] * 1000, WAVE | {"unit_string": "N mm"}),
        "lower": (values()[2], WAVE | {"unit_string": "mV/V"}),
    }
    path = write(tmp_path / "log.tdms", {"rig": channels})
    columns = LogColumns(displacement_mm="travel", moment_upper_Nm="upper", moment_lower_Nm="lower")
    log = read_log(path, columns)
    read = log.data[["displacement_mm", "moment_upper", "moment_lower"]].to_numpy().T
    np.testing.assert_allclose(read, values(), rtol=1e-12)
    assert len(log.notes) == 3


def test_a_start_that_is_set_counts_from_the_first_row_and_one_that_is_not_from_zero(tmp_path):
    start = np.datetime64("2026-11-27T10:15:03.25", "us")
    log = read_log(write(tmp_path / "set.tdms", {"rig": waves(wf_start_time=start)}), LogColumns())
    np.testing.assert_allclose(log.data["time_s"], 0.01 * np.arange(N), atol=1e-9)
    assert any("2026-11-27 10:15:03.25" in note for note in log.notes)
    unset = np.datetime64("1904-01-01T00:00:00", "us")
    log = read_log(write(tmp_path / "unset.tdms", {"rig": waves(wf_start_time=unset)}), LogColumns())
    np.testing.assert_allclose(log.data["time_s"], 0.01 * np.arange(N), atol=1e-12)
    assert log.notes == ()


def test_starts_put_several_files_in_order(tmp_path):
    paths = []
    for name, start in (("b", "2026-11-27T10:15:03"), ("a", "2026-11-27T10:15:05")):
        channels = waves(wf_start_time=np.datetime64(start, "us"))
        paths.append(write(tmp_path / f"{name}.tdms", {"rig": channels}))
    log = read_log(paths[::-1], LogColumns())
    np.testing.assert_allclose(log.data["time_s"], 0.01 * np.arange(2 * N), atol=1e-9)
    assert log.faults == ("files put in order of time: b.tdms, a.tdms",)


def test_a_name_in_two_groups_needs_its_group(tmp_path):
    path = write(tmp_path / "log.tdms", {"one": waves(), "two": waves(2.0)})
    with pytest.raises(DataError, match=r"one/displacement_mm, .*two/displacement_mm"):
        read_log(path, LogColumns())
    named = {key: f"two/{key}" for key in NAMES}
    log = read_log(path, LogColumns(**named))
    np.testing.assert_allclose(log.data["moment_upper"], values()[1] / 2, rtol=1e-12)


def test_channels_of_different_lengths_or_clocks_are_refused(tmp_path):
    short = waves()
    short[NAMES[2]] = (values()[2][:-5], WAVE)
    with pytest.raises(DataError, match=r"different lengths"):
        read_log(write(tmp_path / "short.tdms", {"rig": short}), LogColumns())
    other = waves()
    other[NAMES[2]] = (values()[2], WAVE | {"wf_increment": 0.02})
    with pytest.raises(DataError, match=r"different increments"):
        read_log(write(tmp_path / "other.tdms", {"rig": other}), LogColumns())


def test_channels_of_text_are_refused_by_name(tmp_path):
    channels = waves()
    channels[NAMES[1]] = (["a"] * N, WAVE)
    with pytest.raises(DataError, match=r"'moment_upper_Nm' holds .*expected numbers"):
        read_log(write(tmp_path / "log.tdms", {"rig": channels}), LogColumns())


def test_channels_without_a_clock_are_counted_at_the_rate(tmp_path):
    plain = {name: (v, {}) for name, v in zip(NAMES, values(), strict=True)}
    path = write(tmp_path / "log.tdms", {"rig": plain})
    with pytest.raises(DataError, match="give rate_hz"):
        read_log(path, LogColumns())
    log = read_log(path, LogColumns(), rate_hz=100.0)
    np.testing.assert_allclose(log.data["time_s"], 0.01 * np.arange(N), atol=1e-12)


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return write(tmp_path_factory.mktemp("tdms") / "log.tdms", {"rig": waves()}).read_bytes()


@settings(max_examples=100, deadline=None, suppress_health_check=(HealthCheck.function_scoped_fixture,))
@given(
    st.lists(st.tuples(st.floats(0, 0.999), st.binary(min_size=1, max_size=8)), min_size=1, max_size=4),
    st.data(),
)
def test_spoiled_files_are_read_or_refused(tmp_path, sound, changes, data):
    content = bytearray(sound)
    head = data.draw(st.integers(40, len(content)))  # what is told about the data stands at the front
    for place, piece in changes:
        at = int(place * head)
        content[at : at + len(piece)] = piece
    path = tmp_path / "log.tdms"
    path.write_bytes(bytes(content[: data.draw(st.integers(0, len(content)))]))
    begun = time.perf_counter()
    refused = path.name
    try:
        read_log(path, LogColumns())
    except PloughvalError as error:
        refused = str(error)
    assert path.name in refused
    assert time.perf_counter() - begun < 20.0  # none may hang


def test_more_samples_than_the_limit_are_refused_before_they_are_turned_into_numbers(tmp_path, monkeypatch):
    path = write(tmp_path / "a.tdms", {"rig": waves()})
    monkeypatch.setattr("ploughval.loadcells.logs.tdms.LOG_ROWS", N - 1)
    monkeypatch.setattr("ploughval.loadcells.logs.tdms._samples", None)
    with pytest.raises(DataError, match=r"million samples a channel; expected at most as many\. Thin it out"):
        read_log(path, LogColumns())
