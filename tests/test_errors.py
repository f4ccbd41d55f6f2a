"""Every error says what, where, and what to do."""

import copy
from pathlib import Path

import pytest

from ploughval import errors
from ploughval.errors import (
    CalibrationError,
    ConfigError,
    DataError,
    Fault,
    MissingExtraError,
    PloughvalError,
)


def test_every_error_has_the_one_base():
    named = [e for e in vars(errors).values() if isinstance(e, type) and issubclass(e, Exception)]
    assert len(named) == 7
    assert all(issubclass(e, PloughvalError) for e in named)


def test_a_fault_reads_as_a_sentence():
    assert str(Fault("blade.depth_mm", "-1", "more than 0")) == "blade.depth_mm: got -1; expected more than 0"
    assert str(Fault("a", "1", "2", "Write 2.")).endswith("expected 2. Write 2.")


def test_a_config_error_lists_all_faults_under_the_file():
    faults = [Fault("a", "1", "2"), Fault("b", "3", "4")]
    text = str(ConfigError(Path("t/test.toml"), faults))
    assert text.splitlines() == [
        f"{Path('t/test.toml')}: 2 faults",
        "  - a: got 1; expected 2",
        "  - b: got 3; expected 4",
    ]
    assert "1 fault\n" in str(ConfigError("x", faults[:1]))


@pytest.mark.parametrize(
    ("where", "text"),
    [
        ({"path": Path("a.png"), "frame": 0}, "a.png, frame 0: is empty"),
        ({"path": "a.png"}, "a.png: is empty"),
        ({"frame": 3}, "frame 3: is empty"),
        ({}, "is empty"),
    ],
)
def test_a_data_error_starts_with_its_place(where, text):
    error = DataError("is empty", **where)
    assert str(error) == text
    assert error.frame == where.get("frame")


def test_a_missing_extra_holds_the_line_that_installs_it():
    text = str(MissingExtraError("nptdms", "tdms", "Reading log.tdms"))
    assert text.startswith("Reading log.tdms needs")
    assert "pip install 'ploughval[tdms]'" in text


@pytest.mark.parametrize(
    "error",
    [
        ConfigError("test.toml", [Fault("a", "1", "2", "Do this.")]),
        DataError("is empty", path="photos/a.png", frame=3),
        DataError("is empty"),
        MissingExtraError("distributed", "cluster", "--scheduler"),
        CalibrationError("points in line"),
    ],
)
def test_errors_travel_between_processes_unharmed(error):
    again = copy.copy(error)  # by way of __reduce__, as a process boundary does
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert {k: v for k, v in vars(again).items() if k[0] != "_"} == {
        k: v for k, v in vars(error).items() if k[0] != "_"
    }
