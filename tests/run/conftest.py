"""A job that other processes can be told of by name: it does what the name of its folder says."""

import pytest

JOB = """
import logging, os, signal, sys, time
from pathlib import Path
from ploughval.errors import DataError
from ploughval.run import Outcome

def job(folder, *, out, progress, **options):
    name = os.path.basename(folder)
    progress("work", 0, 1)
    faults = []
    if name.startswith("SIG"):
        os.kill(os.getpid(), getattr(signal, name))
    elif name == "exit":
        print("the last words", file=sys.stderr, flush=True)
        os._exit(7)
    elif name == "refused":
        raise DataError("no log", path=folder)
    elif name == "broken":
        raise KeyError("a fault")
    elif name == "large":
        raise MemoryError("3 GiB")
    elif name == "loud":
        print("on the output")
        os.write(1, b"past Python")
        logging.getLogger("ploughval.photos").warning("a warning")
        logging.getLogger("ploughval.photos").info("not told")
    elif name == "environment":
        faults = [os.environ["OMP_NUM_THREADS"], os.environ["OPENBLAS_NUM_THREADS"]]
    elif name in ("long", "deaf"):
        mark = Path(folder).with_suffix(".part")
        mark.write_text(str(os.getpid()))
        try:
            while True:
                try:
                    progress("mark", 0, 1)
                    time.sleep(60)
                except KeyboardInterrupt:
                    if name == "long":
                        raise
        finally:
            mark.unlink()
    elif name in ("left", "right"):
        Path(folder).touch()
        other = Path(folder).with_name("left" if name == "right" else "right")
        until = time.monotonic() + 20.0
        while not other.exists() and time.monotonic() < until:
            time.sleep(0.01)
        faults = [] if other.exists() else ["alone"]
    progress("work", 1, 1)
    metrics = {"peak": {"agrees": True, "error": 0.1 + 0.2}}
    steps = (str(os.getpid()), str(options))
    return Outcome(name, Path(out or folder), not faults, tuple(faults), (), metrics, steps, 0.1)
"""


@pytest.fixture
def job(tmp_path, monkeypatch):
    """The name under which other processes find the job."""
    folder = tmp_path / "importable"
    folder.mkdir()
    (folder / "ploughval_test_jobs.py").write_text(JOB, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(folder))
    return "ploughval_test_jobs:job"
