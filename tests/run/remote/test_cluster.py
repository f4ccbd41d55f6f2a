"""Tests on a dask cluster: the same bytes as here; a killed worker costs its range of frames alone."""

import signal
import subprocess
import sys
import threading
import weakref
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from broken.base import result_bytes
from ploughval.errors import DataError, MissingExtraError
from ploughval.run.kept.lock import locked, wait_for
from ploughval.run.many.child import Task
from ploughval.run.many.pool import Hearers
from ploughval.run.process import process_folder
from ploughval.run.remote import cluster_work
from ploughval.run.remote.cluster import ClusterRun, run_on_cluster
from ploughval.run.remote.cluster_work import refuse_unseen, settings_digest
from ploughval.run.remote.ranges import Pace
from ploughval.synth import EXAMPLE, make_folder

distributed = pytest.importorskip("distributed")

JOB = "ploughval.run.process:process_folder"
RECIPE = replace(EXAMPLE, seed=3, frames=8, mm_per_px=0.8, displacement_mm=8.0)
RANGES = Pace(first_frames=3, piece_s=0.0)
KILLED_AT = 5  # in the middle of the second range
WATCH = """
import os, signal
from pathlib import Path
from ploughval.piv import Tracker

def dask_setup(worker):
    folder, advance = Path({folder!r}), Tracker.advance
    mark = folder / "killed"

    def told(self, image, sand, camera=None):
        with (folder / "tracked").open("a") as file:
            file.write(f"{{os.getpid()}}\\n")
        lines = (folder / "tracked").read_text().splitlines()
        if len(lines) == {at} and not mark.exists():
            mark.write_text(str(os.getpid()))
            os.kill(os.getpid(), signal.SIGKILL)
        return advance(self, image, sand, camera)

    Tracker.advance = told
"""


@pytest.fixture(scope="module")
def tests(tmp_path_factory):
    """A test with photographs, one without, one that is refused, and the first two processed here."""
    root = tmp_path_factory.mktemp("tests")
    for name, photographs in (("seen", True), ("bare", False)):
        make_folder(root / name, replace(RECIPE, name=name, photographs=photographs))
        process_folder(root / name, out=root / "here" / name)
    (root / "bad").mkdir()
    (root / "bad" / "test.toml").write_text("[test]\nname = 3\n")
    return root


@pytest.fixture
def cluster():
    """A scheduler of this process, and one worker in it."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
    ) as running:
        yield running


@contextmanager
def two_workers(folder):
    """The address of a scheduler with two worker processes that note what they track, one of which dies."""
    preload = folder / "watch.py"
    preload.write_text(WATCH.format(folder=str(folder), at=KILLED_AT))
    with distributed.LocalCluster(n_workers=0, protocol="tcp://", dashboard_address="127.0.0.1:0") as running:
        command = [sys.executable, "-m", "distributed.cli.dask_worker", running.scheduler_address]
        options = ["--no-nanny", "--nthreads", "1", "--no-dashboard", "--preload", str(preload)]
        workers = [
            subprocess.Popen(
                [*command, *options, "--local-directory", str(folder / f"scratch{k}")],
                stderr=subprocess.DEVNULL,
            )
            for k in range(2)
        ]
        try:
            yield running.scheduler_address, workers
        finally:
            for worker in workers:
                worker.kill()
            for worker in workers:
                worker.wait(timeout=30)


def run(places, scheduler, **options):
    """What became of tests, by their index, and the stages that were told."""
    results, stages = {}, []
    tasks = [
        Task(k, str(folder), out and str(out), {"fresh": False}) for k, (folder, out) in enumerate(places)
    ]
    hearers = Hearers(results.__setitem__, lambda index: lambda *stage: stages.append((index, *stage)))
    run_on_cluster(JOB, tasks, hearers, scheduler=scheduler, **options)
    return results, stages


def test_a_worker_that_is_killed_costs_the_rest_of_its_range_alone(tests, tmp_path):
    out = tmp_path / "out"
    with two_workers(tmp_path) as (address, workers):
        names = ("seen", "bad", "bare")
        results, stages = run([(tests / n, out / n) for n in names], address, pace=RANGES)
        killed = int((tmp_path / "killed").read_text())
        dead = [worker for worker in workers if worker.poll() == -signal.SIGKILL]
        assert [worker.pid for worker in dead] == [killed]
    assert "bad/test.toml" in str(results.pop(1))
    for index, outcome in results.items():
        assert outcome.complete, outcome.faults
        assert result_bytes(out / names[index], "run.json") == result_bytes(
            tests / "here" / names[index], "run.json"
        )
    assert [stage for stage in stages if stage[0] == 0] == [(0, "photographs", n, 8) for n in (3, 6, 8)]
    tracked = (tmp_path / "tracked").read_text().split()
    tried = KILLED_AT - (RANGES.first_frames - 1)  # frame 0 is no step
    assert tracked.count(str(killed)) >= tried
    assert len(tracked) == RECIPE.frames - 1 + tried
    assert [path.name for path in out.iterdir() if not any(path.iterdir())] == []


def test_urls_give_the_same_bytes_and_leave_no_copy(tests, cluster, tmp_path):
    results, _ = run(
        [(f"file://{tests}/seen", f"file://{tmp_path}/out")], cluster.scheduler_address, pace=RANGES
    )
    assert results[0].results == f"file://{tmp_path}/out"
    assert result_bytes(tmp_path / "out", "run.json") == result_bytes(tests / "here" / "seen", "run.json")
    scratch = Path(cluster.workers[0].local_directory)
    assert not list(scratch.glob("ploughval-*/*"))


def test_a_range_waits_for_a_worker_that_is_cut_off_and_still_at_work_on_it(
    tests, cluster, tmp_path, monkeypatch
):
    with ExitStack() as cut_off:
        cut_off.enter_context(locked(tmp_path / "o"))

        def ends_meanwhile(results, patience_s):
            threading.Timer(0.3, cut_off.close).start()
            wait_for(results, patience_s)

        monkeypatch.setattr("ploughval.run.remote.cluster_work.wait_for", ends_meanwhile)
        results, _ = run([(tests / "bare", tmp_path / "o")], cluster.scheduler_address)
    assert results[0].complete
    assert result_bytes(tmp_path / "o", "run.json") == result_bytes(tests / "here" / "bare", "run.json")


def test_a_copy_is_not_removed_where_a_range_is_worked_on_in_it(tmp_path):
    worker = SimpleNamespace(local_directory=str(tmp_path))
    copy = tmp_path / "ploughval-copy"
    copy.mkdir()
    with cluster_work._using(copy.name):
        cluster_work.forget(copy.name, dask_worker=worker)
        assert copy.is_dir()
    cluster_work.forget(copy.name, dask_worker=worker)
    assert not copy.exists()


def test_a_worker_that_sees_another_result_folder_says_so(tests, cluster, tmp_path, monkeypatch):
    monkeypatch.setattr("ploughval.run.remote.cluster._beacon", lambda *_: tmp_path / "not there")
    results, _ = run([(tests / "bare", tmp_path / "o")], cluster.scheduler_address)
    assert "o: is not the same folder on the worker" in str(results[0])
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(("name", "what"), [("bad", "holds another test.toml"), ("none", "is not seen")])
def test_a_worker_that_sees_another_test_or_none_says_so(tests, name, what):
    told = {"folder": str(tests / name), "settings": settings_digest(str(tests / "bare")), "seen": ""}
    with pytest.raises(DataError, match=f"{name}: {what} on the worker tcp://w; put it on a file system"):
        refuse_unseen(told, "tcp://w")


def test_an_unforeseen_error_comes_back_without_the_password(cluster, monkeypatch):
    def breaks(told, worker):
        raise RuntimeError(f"what now, {told['folder']}: hunter2")

    monkeypatch.setattr("ploughval.run.remote.cluster_work._advance", breaks)
    results, _ = run([("nfs://me:hunter2@host/a", "nfs://me:hunter2@host/o")], cluster.scheduler_address)
    assert str(results[0]) == "RuntimeError: what now, nfs://host/a: ***"


def test_workers_of_other_code_are_refused_before_anything_runs(tests, cluster, tmp_path, monkeypatch):
    own = distributed.Client.run
    monkeypatch.setattr(
        distributed.Client,
        "run",
        lambda self, *args, **options: {
            worker: there | {"numpy": "1.0", "code": "x"}
            for worker, there in own(self, *args, **options).items()
        },
    )
    with pytest.raises(DataError, match=r"numpy 1\.0 there, .* here, ploughval's own code"):
        run([(tests / "bare", tmp_path / "o")], cluster.scheduler_address)
    assert not (tmp_path / "o").exists()


def test_a_worker_that_never_answers_is_not_waited_for_without_end(tests, cluster, tmp_path, monkeypatch):
    monkeypatch.setattr("ploughval.run.remote.cluster.HEARD_S", 0.2)
    ends = threading.Event()
    monkeypatch.setattr(distributed.Client, "run", lambda *_, **__: ends.wait(30))
    try:
        with pytest.raises(DataError, match=r"not all workers answer within 0\.2 s"):
            run([(tests / "bare", tmp_path / "o")], cluster.scheduler_address)
    finally:
        ends.set()
    assert not (tmp_path / "o").exists()


def test_a_scheduler_without_workers_is_named(tests, tmp_path, monkeypatch):
    monkeypatch.setattr("ploughval.run.remote.cluster.WORKERS_S", 0.1)
    with (
        distributed.LocalCluster(n_workers=0, processes=False, dashboard_address="127.0.0.1:0") as empty,
        pytest.raises(DataError, match="has no workers"),
    ):
        run([(tests / "bare", tmp_path / "o")], empty.scheduler_address)


def test_a_scheduler_that_is_not_there_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("ploughval.run.remote.cluster.ANSWER_S", 0.5)
    with pytest.raises(DataError, match="scheduler does not answer"):
        run([(tmp_path, None)], "tcp://127.0.0.1:9")


def test_without_the_extra_its_line_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"ploughval\[cluster\]"):
        run([(tmp_path, None)], "tcp://127.0.0.1:9")


class KilledWorker(Exception):  # noqa: N818 - the name that dask has
    """What dask raises for a task at which its workers died."""


class Ended:
    """A range that ended."""

    def __init__(self, key, status, value=None):
        self.key, self.status, self._value = key, status, value

    def add_done_callback(self, hear):
        hear(self)

    def exception(self):
        return self._value

    def result(self):
        return self._value


class Client:
    """A cluster of two threads in which ranges end as they are told to, by their keys."""

    def __init__(self, ends, threads=2):
        self.ends, self.threads, self.keys = ends, threads, []

    def ncores(self):
        return {"w": self.threads} if self.threads else {}

    def submit(self, _, told, *, key, **__):
        self.keys.append("-".join(key.split("-")[2:]))
        return self.ends(self.keys[-1], key, told)


def ended(client, count, tmp_path):
    results = {}
    tasks = [Task(k, str(tmp_path / f"t{k}"), None, {}) for k in range(count)]
    ClusterRun(client, JOB, Hearers(results.__setitem__), Pace()).all(tasks)
    return results


def test_a_test_that_kills_workers_is_given_up_and_one_beside_it_is_not(tmp_path):
    def ends(name, key, told):
        if name in ("0-10", "1-10", "1-10-alone"):
            return Ended(key, "error", KilledWorker())
        return Ended(key, "finished", {"worker": "w", "refused": "no log"})

    client = Client(ends)
    results = ended(client, 3, tmp_path)
    assert str(results[0]) == str(results[2]) == "no log"
    assert "t1: given up: one worker after the other died at it" in str(results[1])
    assert client.keys == ["0-10", "1-10", "2-10", "0-10-alone", "1-10-alone"]


def test_a_range_that_ended_is_let_go_before_the_next_one_ends(tmp_path):
    """dask works again on what is asked for and lost: with the worker that had answered it."""
    first, held = [], []

    class Later(Ended):
        def add_done_callback(self, hear):
            threading.Timer(0.2, lambda: (held.append(first[0]()), hear(self))).start()

    def ends(name, key, told):
        if name != "0-10":
            return Later(key, "finished", {"worker": "w", "refused": "no log"})
        reached = {"frame": 10, "begun": 0, "seconds": 60.0, "frames": 30}
        range_ = Ended(key, "finished", {"worker": "w", "range": reached})
        first.append(weakref.ref(range_))
        return range_

    client = Client(ends)
    assert str(ended(client, 1, tmp_path)[0]) == "no log"
    assert client.keys == ["0-10", "0-20"]
    assert held == [None]


def test_a_lost_scheduler_ends_every_test_that_is_left(tmp_path):
    results = ended(Client(lambda name, key, told: Ended(key, "cancelled")), 4, tmp_path)
    assert list(results) == [0, 1, 2, 3]
    assert all("connection to the scheduler was lost; what is done stays" in str(r) for r in results.values())


def test_a_cluster_that_lost_all_workers_is_not_waited_for_without_end(tmp_path, monkeypatch):
    monkeypatch.setattr("ploughval.run.remote.cluster.TURN_S", 0.01)
    monkeypatch.setattr("ploughval.run.remote.cluster.WORKERS_S", 0.03)

    class Never(Ended):
        def add_done_callback(self, hear):
            pass

    results = ended(Client(lambda name, key, told: Never(key, "pending"), threads=0), 2, tmp_path)
    assert all("no worker was there for 0.03 s" in str(result) for result in results.values())
