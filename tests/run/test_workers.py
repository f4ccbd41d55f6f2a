"""Several tests: how they share the machine; one that fails does not stop the others."""

from types import SimpleNamespace

import pytest

from ploughval.errors import ConfigError, Fault
from ploughval.run import workers as workers_module
from ploughval.run.many.pool import Hearers
from ploughval.run.workers import Share, run_all, share_of


def here(folder, *, out, workers, **_):
    if folder == "bad":
        raise ConfigError(folder, [Fault("a", "b", "c")])
    return folder, out, workers


@pytest.fixture
def memory(monkeypatch):
    """How much a test needs and how much is free, GB."""

    def set_to(needed, free):
        sizes = needed if isinstance(needed, dict) else {}
        monkeypatch.setattr(workers_module, "needed_bytes", lambda folder: int(1e9 * sizes.get(folder, 1.0)))
        monkeypatch.setattr(workers_module, "free_bytes", lambda: None if free is None else int(1e9 * free))

    return set_to


def test_a_failing_test_does_not_stop_the_others():
    results = {}
    run_all(here, ["a", "bad", "c"], Hearers(results.__setitem__), out="o", share=Share(1, 3))
    assert results[0] == ("a", "o/a", 3)
    assert isinstance(results[1], ConfigError)
    assert results[2] == ("c", "o/c", 3)


def test_a_test_given_twice_is_refused_before_any_runs():
    ran = []
    with pytest.raises(ConfigError, match="again"):
        run_all(here, ["a", "b", "a"], Hearers(lambda index, _: ran.append(index)))
    assert ran == []


def test_processes_get_options_and_places_and_are_heard(job):
    named = SimpleNamespace(__module__=job.partition(":")[0], __qualname__=job.partition(":")[2])
    results, heard = {}, []

    def watched(index):
        return lambda *told: heard.append((index, *told))

    hearers = Hearers(results.__setitem__, watched)
    run_all(named, ["x/a", "y/a"], hearers, out="o", share=Share(2, 3), fresh=True)
    assert [str(results[index].results) for index in (0, 1)] == ["o/a", "o/a-2"]
    assert results[0].steps[1] == "{'fresh': True, 'workers': 3}"
    assert sorted(heard) == [(index, "work", done, 1) for index in (0, 1) for done in (0, 1)]


@pytest.mark.parametrize(
    ("tests", "workers", "expected"),
    [(1, 8, (1, 8)), (2, 1, (1, 1)), (2, 2, (2, 1)), (2, 8, (2, 4)), (300, 8, (8, 1)), (3, 8, (3, 2))],
)
def test_each_test_has_a_process_and_threads_that_are_left_are_shared(memory, tests, workers, expected):
    memory(1.0, None)
    assert share_of([f"t{n}" for n in range(tests)], workers) == Share(*expected)


def test_no_more_tests_stand_side_by_side_than_memory_holds_of_the_largest(memory):
    memory({"large": 3.0}, 7.0)
    share = share_of(["small", "large", "other", "last"], 4)
    assert (share.processes, share.threads) == (2, 2)
    assert share.remark == "2 of 4 tests side by side: one may take 3 GB, and 7 GB of memory are free"
    assert share_of(["small", "other"], 4) == Share(2, 2)


def test_one_test_is_worked_on_even_where_memory_is_too_small(memory):
    memory(1.0, 0.1)
    assert share_of(["a", "b"], 2).processes == 1
    assert share_of(["a"], 2) == Share(1, 2)
