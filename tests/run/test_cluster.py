"""Several tests on a dask cluster: each with its options; one that fails does not stop the others."""

from pathlib import Path

import pytest

from ploughval.errors import ConfigError, DataError, Fault, MissingExtraError
from ploughval.run.workers import run_all


def job(folder, out, *, workers):
    if folder.name == "bad":
        raise ConfigError(folder, [Fault("a", "b", "c")])
    return folder.name, out, workers


def test_a_scheduler_runs_each_test_with_its_options(tmp_path):
    distributed = pytest.importorskip("distributed")
    results = {}
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        run_all(
            job,
            [tmp_path / "a", tmp_path / "bad"],
            out=tmp_path / "o",
            scheduler=cluster.scheduler_address,
            finished=results.__setitem__,
            workers=2,
        )
    assert results[0] == ("a", tmp_path / "o" / "a", 2)
    assert isinstance(results[1], ConfigError)


def test_a_scheduler_that_is_not_there_is_named_or_the_extra_is():
    with pytest.raises((MissingExtraError, DataError), match=r"cluster|scheduler"):
        run_all(
            job, [Path("a")], out=None, scheduler="tcp://127.0.0.1:9", finished=lambda *_: None, workers=1
        )
