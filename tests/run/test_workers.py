"""Several tests: each is run, one that fails does not stop the others."""

from pathlib import Path

from ploughval.errors import ConfigError, Fault
from ploughval.run.workers import result_folders, run_all


def job(folder, out, *, workers):
    if folder.name == "bad":
        raise ConfigError(folder, [Fault("a", "b", "c")])
    return folder.name, out, workers


def test_a_failing_test_does_not_stop_the_others():
    results = {}
    run_all(
        job,
        [Path("a"), Path("bad"), Path("c")],
        out=Path("o"),
        scheduler=None,
        finished=results.__setitem__,
        workers=3,
    )
    assert results[0] == ("a", Path("o/a"), 3)
    assert isinstance(results[1], ConfigError)
    assert results[2] == ("c", Path("o/c"), 3)


def test_one_test_writes_straight_into_out():
    assert result_folders([Path("a")], Path("o")) == [Path("o")]
    assert result_folders([Path("a"), Path("b")], None) == [None, None]
