"""Memory that runs out: one message that says what to lower, no frame lost for it, and a run that goes on."""

import errno
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from broken.base import make_sound, result_bytes, setting
from ploughval.cli import app
from ploughval.errors import DataError
from ploughval.memory import is_short_of_memory, raise_shortage, shortage
from ploughval.photos.reading.decode import decode
from ploughval.run import process_folder

FEW_MB = (40, 160)
LIMITED = """
import re, resource, sys
from pathlib import Path
from typer.testing import CliRunner
from ploughval.cli import app
from ploughval.run import process_folder
small, large, out, *levels = sys.argv[1:]
process_folder(small, out=out + "/small")  # libraries loaded, kernels compiled
held = int(re.search(r"VmSize:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]) * 1024
for level in levels:
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (held + int(level) * 2**20, hard))
    result = CliRunner().invoke(app, ["process", large, "--out", out + "/large", "--workers", "1"])
    resource.setrlimit(resource.RLIMIT_AS, (hard, hard))
    refused = [line for line in result.stderr.splitlines() if "refused" in line]
    print(result.exit_code, *refused, flush=True)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("memory") / "test"
    make_sound(folder)
    return folder


@pytest.fixture(scope="module")
def whole(folder, tmp_path_factory):
    return result_bytes(
        process_folder(folder, out=tmp_path_factory.mktemp("whole") / "out").results, "run.json"
    )


@pytest.fixture
def no_room(monkeypatch):
    """A machine without room for a picture that is decoded."""
    monkeypatch.setattr("ploughval.memory._has_room", lambda size_bytes: False)


def opencv_without_memory():
    """What OpenCV raises where it gets none, from itself: a picture of a terabyte."""
    with pytest.raises(cv2.error) as told:
        cv2.copyMakeBorder(np.zeros((1, 1), np.uint8), 0, 1 << 20, 0, 1 << 20, cv2.BORDER_CONSTANT)
    return told.value


def numpy_without_memory():
    with pytest.raises(MemoryError) as told:
        np.ones(1 << 46)
    return told.value


@pytest.mark.parametrize(
    "make",
    [
        opencv_without_memory,
        numpy_without_memory,
        lambda: OSError(errno.ENOMEM, "Cannot allocate memory"),
        lambda: RuntimeError("can't start new thread"),
        lambda: ImportError("x.so: failed to map segment: Cannot allocate memory"),
    ],
    ids=["opencv", "numpy", "system", "thread", "library"],
)
def test_whoever_lacks_memory_is_understood(make):
    error = make()
    assert is_short_of_memory(error)
    text = shortage(error)
    assert text.startswith("out of memory")
    assert "\n" not in text
    assert "alloc.cpp" not in text
    for lowered in ("--workers", "crop the photographs", "spacing_px"):
        assert lowered in text


@pytest.mark.parametrize(
    "error", [ValueError("memory"), OSError(errno.ENOSPC, "No space"), RuntimeError("x")]
)
def test_other_errors_are_not_taken_for_it(error):
    assert not is_short_of_memory(error)
    raise_shortage(error, 1)


def test_a_file_that_asks_for_more_than_a_sound_one_may_need_is_at_fault_itself(folder, monkeypatch):
    monkeypatch.setattr("ploughval.photos.reading.decode.to_grey", _fail)
    with pytest.raises(DataError, match="cannot be decoded: Unable to allocate"):
        decode(folder / "photos" / "0001.png")


@pytest.mark.usefixtures("no_room")
def test_no_photograph_is_lost_for_want_of_memory(folder, whole, tmp_path, monkeypatch):
    """A lost frame would be kept, and taken for lost by the next run, which has the memory."""
    with monkeypatch.context() as patch:
        patch.setattr("ploughval.photos.reading.decode.to_grey", _fail)
        result = CliRunner().invoke(app, ["process", str(folder), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    told = [line for line in result.stderr.splitlines() if "refused" in line]
    assert len(told) == 1
    assert "out of memory (Unable to allocate 9 GiB)" in told[0]
    assert "Traceback" not in result.output
    assert not (tmp_path / "out" / "run.json").exists()
    assert result_bytes(process_folder(folder, out=tmp_path / "out").results, "run.json") == whole


def _fail(*_):
    raise MemoryError("Unable to allocate 9 GiB")


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no limit on memory is to be had here")
def test_a_limit_on_memory_ends_process_with_a_message(folder, tmp_path):
    """Photographs of 12 million px, with room for a part of one."""
    large = tmp_path / "large"
    make_sound(large)
    for path in (large / "photos").iterdir():
        picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        cv2.imwrite(str(path), cv2.resize(picture, (4000, 3000), interpolation=cv2.INTER_NEAREST))
    setting("camera.mm_per_px", "0.05")(large)
    setting("camera.tip_px", "[450.0, 2400.0]")(large)
    line = [sys.executable, "-c", LIMITED, *map(str, (folder, large, tmp_path, *FEW_MB))]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    answers = done.stdout.splitlines()
    assert len(answers) == len(FEW_MB), done.stderr
    for answer in answers:
        assert answer.startswith("2 refused: out of memory"), answer
    assert not (tmp_path / "large" / "run.json").exists()
    assert [path for path in (tmp_path / "large").rglob(".*") if ".part-" in path.name] == []
