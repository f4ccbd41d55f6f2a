"""A killed run leaves nothing half-written, and the next one ends with the bytes of an undisturbed run."""

import subprocess
import sys
from pathlib import Path

import pytest

import kill_runs
from kill_runs import Act, Trial, chosen, files_of


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="needs fork and /proc")
def test_runs_that_are_killed_go_on_and_end_with_the_same_bytes():
    """In a process of its own: this one has threads, which do not outlive a fork."""
    line = [sys.executable, kill_runs.__file__, "--quick"]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.endswith("4 kills, 0 of them with faults\n")


@pytest.fixture
def trial(tmp_path):
    """A judge of a folder with one result file, and of what it and an earlier run left whole."""
    out = tmp_path / "out"
    out.mkdir()
    trial = object.__new__(Trial)
    trial._out = out
    trial._whole = {"a.csv": b"new", "run.json": b'{"test": "new"}'}
    trial._earlier = {"a.csv": b"old", "run.json": b'{"test": "old"}'}
    return trial


@pytest.mark.parametrize("content", [b"new", b"old", None])
def test_the_judge_takes_files_that_are_whole_old_or_absent(trial, content):
    if content is not None:
        (trial._out / "a.csv").write_bytes(content)
    (trial._out / ".a.part-abcdefgh.csv").write_bytes(b"ne")
    assert trial._half_written() == []


def test_the_judge_names_a_file_that_is_half_written(trial):
    (trial._out / "a.csv").write_bytes(b"ne")
    assert trial._half_written() == ["a.csv is half written"]


def test_the_judge_names_a_record_of_other_files_than_those_beside_it(trial):
    (trial._out / "a.csv").write_bytes(b"old")
    (trial._out / "run.json").write_bytes(b'{"test": "new", "timings_s": {"force": 1.0}}')
    assert trial._half_written() == ["run.json stands beside another a.csv"]


def test_what_of_the_record_tells_of_the_run_is_left_out(trial):
    for seconds in (1.0, 2.0):
        (trial._out / "run.json").write_text(f'{{"timings_s": {seconds}, "stages": {seconds}, "test": "t"}}')
        assert files_of(trial._out) == {"run.json": b'{"test": "t"}'}


def test_acts_are_chosen_from_every_kind_and_over_the_whole_run():
    acts = [Act(kind, n, "f") for kind in ("half", "stage") for n in range(10)]
    found = chosen(acts, 18)
    assert [(act.kind, act.number) for act in found if act.kind == "half"] == [("half", n) for n in (0, 4, 9)]
    assert len(found) == 6
