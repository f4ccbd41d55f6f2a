"""Processes side by side: one that dies costs its test alone, and none outlives the command."""

import logging
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from ploughval.errors import PloughvalError
from ploughval.run.many import pool as pool_module
from ploughval.run.many.answers import ElsewhereError, LostError
from ploughval.run.many.child import Task
from ploughval.run.many.pool import Hearers, Pool

posix = pytest.mark.skipif(os.name != "posix", reason="signals end processes on POSIX alone")


def run(job, folders, *, processes=2, finished=None, **options):
    """What each test became, and who heard of it."""
    results, threads = {}, set()

    def note(index, result):
        threads.add(threading.current_thread())
        results[index] = result
        if finished is not None:
            finished(index, result)

    tasks = [Task(index, str(folder), None, options) for index, folder in enumerate(folders)]
    Pool(job, processes, 1).run(tasks, Hearers(note))
    assert threads == {threading.current_thread()}
    return [results[index] for index in range(len(folders))]


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{pid}/stat")
    return not state.exists() or state.read_text().rpartition(")")[2].split()[0] != "Z"


@posix
@pytest.mark.parametrize("processes", [1, 2])
def test_a_process_that_is_killed_costs_its_test_only(job, processes):
    before, killed, crashed, after = run(job, ["before", "SIGKILL", "SIGSEGV", "after"], processes=processes)
    assert (before.name, after.name) == ("before", "after")
    assert isinstance(killed, LostError)
    assert "SIGKILL" in str(killed)
    assert "memory" in str(killed)
    assert isinstance(crashed, LostError)
    assert "SIGSEGV" in str(crashed)


def test_a_process_that_gives_up_is_lost_with_its_last_words(job):
    lost, after = run(job, ["exit", "after"], processes=1)
    assert str(lost) == "exit code 7 | the last words"
    assert after.name == "after"


def test_a_job_that_is_not_there_loses_every_test_and_ends(job):
    lost = run("ploughval_no_such_module:job", ["a", "b", "c"])
    assert [type(result) for result in lost] == [LostError] * 3
    assert "ploughval_no_such_module" in str(lost[2])


def test_refusals_short_memory_and_internal_errors_come_back_as_text(job):
    refused, broken, large = run(job, ["refused", "broken", "large"])
    assert type(refused) is PloughvalError
    assert str(refused) == "refused: no log"
    assert isinstance(broken, ElsewhereError)
    assert str(broken) == "KeyError: 'a fault'"
    assert type(large) is PloughvalError
    assert "out of memory (3 GiB)" in str(large)


def test_one_process_works_on_many_tests_and_numbers_come_back_exactly(job):
    outcomes = run(job, ["a", "b", "c"], processes=1, fresh=True)
    assert len({outcome.steps[0] for outcome in outcomes}) == 1
    assert outcomes[0].steps[1] == "{'fresh': True}"
    assert outcomes[0].metrics == {"peak": {"agrees": True, "error": 0.1 + 0.2}}
    assert outcomes[2].results == Path("c")


def test_tests_are_worked_on_side_by_side(job, tmp_path):
    outcomes = run(job, [tmp_path / "left", tmp_path / "right"])  # each waits for the other
    assert [outcome.faults for outcome in outcomes] == [(), ()]
    assert len({outcome.steps[0] for outcome in outcomes}) == 2


def test_names_of_any_kind_reach_the_job(job):
    names = ["with 'quotes' \"both\"", "line\nbreak", "raw\udcff", "Übung"]
    assert [outcome.name for outcome in run(job, names, processes=1)] == names


def test_what_a_job_prints_and_logs_is_heard_in_the_log(job, caplog):
    with caplog.at_level(logging.WARNING):
        assert run(job, ["loud"], processes=1)[0].complete
    assert ("ploughval.photos", logging.WARNING, "a warning") in caplog.record_tuples
    texts = [record.getMessage() for record in caplog.records]
    assert "on the output" in "\n".join(texts)
    assert "past Python" in "\n".join(texts)
    assert "not told" not in texts


def test_what_a_process_prints_at_its_start_is_heard_and_is_no_answer(job, tmp_path, monkeypatch, caplog):
    (tmp_path / "sitecustomize.py").write_text("print('welcome'); print(3); print('{')")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    with caplog.at_level(logging.WARNING):
        assert run(job, ["a", "b"], processes=1)[1].complete
    assert [record.getMessage() for record in caplog.records] == ["welcome", "3", "{"]


def test_a_fault_in_a_thread_of_the_pool_is_raised_instead_of_waited_for(job, monkeypatch):
    def breaks(answer):
        raise KeyError("outcome")

    monkeypatch.setattr(pool_module, "result_of", breaks)
    with pytest.raises(KeyError, match="outcome"):
        run(job, ["a"], processes=1)


def test_each_process_keeps_to_its_share_of_threads_unless_the_environment_says_otherwise(job, monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "5")
    results = {}
    Pool(job, 1, 3).run([Task(0, "environment", None, {})], Hearers(results.__setitem__))
    assert results[0].faults == ("3", "5")


def test_nothing_is_imported_from_the_working_folder(job, tmp_path, monkeypatch):
    (tmp_path / "json.py").write_text("raise SystemExit('taken from the working folder')")
    monkeypatch.chdir(tmp_path)
    assert run(job, ["a"], processes=1)[0].complete


def interrupted_at_mark(job, folders):
    def watched(index):
        def hear(stage, done, total):
            if stage == "mark":
                raise KeyboardInterrupt

        return hear

    tasks = [Task(index, str(folder), None, {}) for index, folder in enumerate(folders)]
    with pytest.raises(KeyboardInterrupt):
        Pool(job, 1, 1).run(tasks, Hearers(lambda *_: None, watched))


def test_an_interruption_ends_processes_after_they_have_tidied_up(job, tmp_path):
    interrupted_at_mark(job, [tmp_path / "long", tmp_path / "never"])
    assert not (tmp_path / "long.part").exists()


@posix
def test_a_process_that_does_not_listen_is_ended(job, tmp_path, monkeypatch):
    monkeypatch.setattr(pool_module, "GRACE_S", 0.5)
    interrupted_at_mark(job, [tmp_path / "deaf"])
    pid = int((tmp_path / "deaf.part").read_text())
    assert gone(pid)


def gone(pid, within_s=20.0):
    until = time.monotonic() + within_s
    while alive(pid) and time.monotonic() < until:
        time.sleep(0.05)
    return not alive(pid)


@posix
def test_processes_end_with_the_one_that_started_them(job, tmp_path):
    code = (
        "from ploughval.run.many.child import Task; from ploughval.run.many.pool import Hearers, Pool;"
        f"Pool({job!r}, 1, 1).run([Task(0, {str(tmp_path / 'long')!r}, None, {{}})], Hearers(print))"
    )
    parent = subprocess.Popen([sys.executable, "-c", code])
    mark, until = tmp_path / "long.part", time.monotonic() + 30.0
    while not (mark.exists() and mark.read_text()) and time.monotonic() < until:
        time.sleep(0.05)
    pid = int(mark.read_text())
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    assert gone(pid)
    assert not mark.exists()
