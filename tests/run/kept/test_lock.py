"""One run at a time in a result folder; the lock ends with its holder, however that dies."""

import errno
import json
import os
import signal
import subprocess
import sys
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from ploughval.cli import app
from ploughval.errors import DataError
from ploughval.report import page
from ploughval.run import process_folder
from ploughval.run.kept import lock
from ploughval.run.kept.lock import HeldError, locked, wait_for
from ploughval.synth import EXAMPLE, make_folder

HOLD = """
import sys
from pathlib import Path
from ploughval.run.kept.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that holds tmp_path / "results"."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path / "results")], **pipes) as other:
        assert other.stdout.readline().strip() == b"held"
        yield other
        other.kill()


def test_a_second_process_is_refused_with_the_holders_name_until_the_first_ends(tmp_path, holder):
    results = tmp_path / "results"
    told = rf"results: another run .*process {holder.pid} on .* since 2.*--out"
    with pytest.raises(DataError, match=told), locked(results):
        pytest.fail("held by two")
    holder.communicate(b"")
    with locked(results):
        assert json.loads((results / ".store" / "lock").read_text())["pid"] == os.getpid()


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
def test_a_holder_that_is_killed_leaves_no_lock_behind(tmp_path, holder):
    results = tmp_path / "results"
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert (results / ".store" / "lock").is_file()
    with locked(results):
        pass
    assert list(results.iterdir()) == []


def test_a_second_run_of_the_same_process_is_refused_too(tmp_path):
    with locked(tmp_path), pytest.raises(DataError, match="another run"), locked(tmp_path):
        pytest.fail("held twice")


def test_a_folder_that_is_held_is_waited_for_as_long_as_there_is_patience(tmp_path, holder, monkeypatch):
    results = tmp_path / "results"
    with pytest.raises(HeldError, match=f"process {holder.pid}"):
        wait_for(results, 0.0)
    monkeypatch.setattr(lock.time, "sleep", lambda _: holder.communicate(b""))  # it ends meanwhile
    wait_for(results, 30.0)
    with locked(results):
        pass


def test_two_result_folders_do_not_meet(tmp_path):
    with locked(tmp_path / "a"), locked(tmp_path / "b"):
        assert len(list(tmp_path.glob("*/.store/lock"))) == 2


def test_nothing_of_the_lock_is_left_and_nothing_else_is_taken(tmp_path):
    (tmp_path / "kept.csv").write_text("mine")
    with locked(tmp_path):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["kept.csv"]
    (tmp_path / "empty").mkdir()
    for name in ("empty", "new"):
        with locked(tmp_path / name):
            pass
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty", "kept.csv"]


def test_a_lock_whose_file_was_removed_by_the_last_holder_is_taken_anew(tmp_path, monkeypatch):
    """The file is opened just before its holder removes it: a lock on it would keep nobody out."""
    path, taken = tmp_path / ".store" / "lock", []
    take = lock._take

    def removed_meanwhile(where, file):
        if not taken:
            path.unlink()
        taken.append(file)
        return take(where, file)

    monkeypatch.setattr(lock, "_take", removed_meanwhile)
    with locked(tmp_path):
        assert path.is_file()
        with pytest.raises(DataError, match="another run"), locked(tmp_path):
            pytest.fail("held twice")


def test_folders_that_other_holders_take_back_meanwhile_are_made_again(tmp_path, monkeypatch):
    """A third may have made them by the time that one looks whether they are there."""
    make, open_file = lock.Path.mkdir, os.open
    refusals = [
        FileExistsError(errno.EEXIST, "not a folder a moment ago"),
        FileNotFoundError(errno.ENOENT, "gone"),
    ]

    def made(path, **options):
        if len(refusals) == 2:
            raise refusals.pop()
        return make(path, **options)

    def opened(path, *options):
        if refusals:
            raise refusals.pop()
        return open_file(path, *options)

    (tmp_path / ".store").mkdir()
    monkeypatch.setattr(lock.Path, "mkdir", made)
    monkeypatch.setattr(lock.os, "open", opened)
    with locked(tmp_path):
        assert (tmp_path / ".store" / "lock").is_file()


def test_a_file_system_without_locks_lets_the_run_go_on_and_says_so(tmp_path, monkeypatch, caplog):
    def none(file):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(lock, "_lock", none)
    with locked(tmp_path):
        pass
    assert "no locks" in caplog.text


def test_a_folder_that_cannot_be_made_is_refused_by_name(tmp_path):
    (tmp_path / "results").write_text("a file")
    with pytest.raises(DataError, match=r"lock: cannot be written"), locked(tmp_path / "results"):
        pytest.fail("no folder")


def test_a_lock_file_of_other_content_is_read_as_a_holder_unknown(tmp_path, holder):
    path = tmp_path / "results" / ".store" / "lock"
    path.write_text("[1]")
    with pytest.raises(DataError, match="it does not say which"), locked(tmp_path / "results"):
        pytest.fail("held by two")


MODEL_AND_FORCE = {"photographs": False, "displacement_mm": 8.0, "rate_hz": 10.0, "rest_s": 3.0}


@pytest.fixture(scope="module")
def processed(tmp_path_factory):
    """A test without photographs, and its results."""
    folder = tmp_path_factory.mktemp("locked") / "test"
    make_folder(folder, replace(EXAMPLE, seed=2, **MODEL_AND_FORCE))
    process_folder(folder)
    return folder


def bytes_of(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.mark.parametrize("line", [["process"], ["process", "--fresh"], ["report"], ["fit"]], ids=" ".join)
def test_a_command_is_refused_where_a_run_is_at_work_and_changes_nothing(processed, line):
    results = processed / "results"
    with locked(results):
        before = bytes_of(results)
        answer = CliRunner().invoke(app, [line[0], str(processed), *line[1:]])
        assert bytes_of(results) == before
    assert answer.exit_code == 2
    assert f"another run is at work in it (process {os.getpid()} on " in answer.output
    assert "Traceback" not in answer.output


def test_a_page_elsewhere_and_a_run_elsewhere_do_not_ask_for_the_folder(processed, tmp_path, monkeypatch):
    monkeypatch.setattr(page, "single_page", lambda results, progress: "a page")
    with locked(processed / "results"):
        page.write_report(processed / "results", out=tmp_path / "page.html")
        process_folder(processed, out=tmp_path / "other")
    assert (tmp_path / "page.html").read_text() == "a page"
    assert (tmp_path / "other" / "run.json").is_file()
