"""Signals, and a reader that goes away: a quiet end, no scrap, no process left, and a run that goes on."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import pytest

from broken.base import make_sound, result_bytes
from ploughval.run import process_folder

PATIENCE_S = 120
KEPT = "what is finished is kept; the same command goes on from there"
HEARING = """
import signal
for name in ("SIGINT", "SIGTERM", "SIGHUP"):
    signal.signal(getattr(signal, name), signal.SIG_DFL)
"""
"""Whoever runs the tests may have signals ignored, as a shell has of what it runs in the background."""
APP = """
import sys, time, typer
from ploughval.stopping import listen
from ploughval.talk import command
app = typer.Typer()
@app.command()
def work(as_json: bool = False):
    with command(as_json) as talk:
        {work}
{before}
listen()
app()
"""
WORK = """
        print("at work", flush=True)
        time.sleep(600)
"""
TIDYING = """
        try:
            print("at work", flush=True)
            time.sleep(600)
        finally:
            print("tidying", flush=True)
            time.sleep(600)
"""
HIDING = """
import time
try:
    print("at work", flush=True)
    time.sleep(0.3)
except BaseException as error:
    print("hidden", flush=True)
"""
"""A module that hides what is raised while it is imported, as compiled ones may."""
STANDING = """
import os, sys, tempfile, time
import ploughval.cli
make, sync, seen = tempfile.mkstemp, os.fsync, []
def mkstemp(**options):
    seen[:] = [options["prefix"]]
    return make(**options)
def fsync(handle):
    if seen == [".tracks.part-"]:
        print("at the file", flush=True)
        time.sleep(600)
    sync(handle)
tempfile.mkstemp, os.fsync = mkstemp, fsync
ploughval.cli.main()
"""
"""Stands still with tracks.nc written aside and not yet renamed."""


def app_that(work, before=""):
    """A script of one command that works like this."""
    return HEARING + APP.format(work=work, before=before)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("signals") / "test"
    make_sound(folder)
    return folder


@pytest.fixture
def begun():
    """A function that starts a script in a session of its own; what is left of it is ended with the test."""
    started = []

    def begin(script, *arguments, stream="stdout", until):
        line = [sys.executable, *script, *map(str, arguments)]
        process = subprocess.Popen(
            line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
        )
        started.append(process)
        wait_for(process, getattr(process, stream), until)
        return process

    yield begin
    for process in started:
        if alive(process):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def wait_for(process, stream, text):
    patience = threading.Timer(PATIENCE_S, process.kill)
    patience.start()
    try:
        if not any(text in line for line in stream):
            pytest.fail(f"never heard {text!r}: {process.communicate()}")
    finally:
        patience.cancel()


def wait_until(process, is_so):
    until = time.monotonic() + PATIENCE_S
    while not is_so():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.05)


def alive(process):
    """Whether any process of the session is left."""
    try:
        os.killpg(process.pid, 0)
    except (ProcessLookupError, PermissionError):
        return False
    return True


def scraps(place):
    return [path.name for path in place.rglob(".*") if ".part-" in path.name]


@pytest.mark.parametrize(
    ("name", "code", "by"),
    [("SIGINT", 130, ""), ("SIGTERM", 143, " by SIGTERM"), ("SIGHUP", 129, " by SIGHUP")],
)
def test_a_signal_ends_a_command_with_one_line_and_its_exit_code(name, code, by, begun):
    process = begun(["-c", app_that(WORK)], until="at work")
    process.send_signal(getattr(signal, name))
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, errors) == (code, f"interrupted{by}: {KEPT}\n")


def test_a_signal_leaves_one_json_value(begun):
    process = begun(["-c", app_that(WORK), "--as-json"], until="at work")
    process.send_signal(signal.SIGTERM)
    output, errors = process.communicate(timeout=PATIENCE_S)
    assert '"exit_code": 143' in output
    assert f"interrupted by SIGTERM: {KEPT}" in errors
    assert "Traceback" not in errors


def test_a_second_signal_ends_a_command_that_is_still_tidying_at_once(begun):
    process = begun(["-c", app_that(TIDYING)], until="at work")
    process.send_signal(signal.SIGINT)
    wait_for(process, process.stdout, "tidying")
    time.sleep(0.3)  # sooner, it is the first again
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, errors) == (130, "")


def test_a_signal_in_the_middle_of_an_import_is_neither_lost_in_it_nor_raised_in_it(tmp_path, begun):
    (tmp_path / "hiding.py").write_text(HIDING)
    importing = app_that(f"sys.path.insert(0, {str(tmp_path)!r}); import hiding; time.sleep(600)")
    process = begun(["-c", importing], until="at work")
    process.send_signal(signal.SIGTERM)
    output, errors = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, output, errors) == (143, "", f"interrupted by SIGTERM: {KEPT}\n")


def test_a_signal_that_is_sent_twice_at_a_time_as_timeout_does_is_one(begun):
    process = begun(["-c", app_that("0.3".join(TIDYING.rsplit("600", 1)))], until="at work")
    process.send_signal(signal.SIGTERM)
    wait_for(process, process.stdout, "tidying")
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, errors) == (143, f"interrupted by SIGTERM: {KEPT}\n")


def test_a_hangup_that_was_ignored_stays_ignored(begun):
    ignoring = app_that(WORK, before="signal.signal(signal.SIGHUP, signal.SIG_IGN)")
    process = begun(["-c", ignoring], until="at work")
    process.send_signal(signal.SIGHUP)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 143


def test_a_reader_that_has_gone_ends_a_command_without_a_word():
    call = app_that("talk.say('x' * 100_000)")
    process = subprocess.Popen(
        [sys.executable, "-c", call], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdout.close()
    errors = process.stderr.read()
    process.stderr.close()
    assert (process.wait(), errors) == (1, "")


def test_a_signal_in_the_middle_of_a_file_takes_it_back_and_the_run_goes_on(folder, tmp_path, begun):
    out = tmp_path / "out"
    process = begun(["-c", HEARING + STANDING], "process", folder, "--out", out, until="at the file")
    assert len(scraps(out)) == 1
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == f"interrupted: {KEPT}"
    assert "Traceback" not in errors
    assert scraps(out) == []
    assert not (out / "run.json").exists()
    again = process_folder(folder, out=out)
    assert "photographs" in again.reused
    whole = process_folder(folder, out=tmp_path / "whole").results
    assert result_bytes(out, "run.json", "report.html") == result_bytes(whole, "run.json", "report.html")


def test_a_signal_ends_the_processes_of_several_tests_too(folder, tmp_path, begun):
    other = shutil.copytree(folder, tmp_path / "other")
    line = ["-m", "ploughval.cli"], "process", folder, other, "--out", tmp_path / "out", "--workers", 2
    process = begun(*line, stream="stderr", until="tests: begun")
    wait_until(
        process, lambda: all((tmp_path / "out" / name / ".store").is_dir() for name in ("test", "other"))
    )
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 143
    assert errors.splitlines()[-1] == f"interrupted by SIGTERM: {KEPT}"
    assert "Traceback" not in errors
    assert not alive(process)
    assert scraps(tmp_path) == []
