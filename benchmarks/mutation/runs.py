"""Tests of a mutant in a process of its own, forked from one that has the libraries loaded."""

import gc
import importlib.machinery
import importlib.util
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Iterator, Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import CodeType, ModuleType
from typing import NamedTuple

from mutation.mutant import Mutant

ROOT = Path(__file__).parents[2]
LIBRARIES = (
    "numpy", "pandas", "scipy.signal", "scipy.optimize", "scipy.stats", "numba", "pytest", "hypothesis",
    "pydantic", "xarray",
)  # fmt: skip
# quick: asserts as they are, no garbage collected between tests, no doctests
OPTIONS = (
    "-x", "-q", "--no-header", "--tb=no", "--assert=plain", "--hypothesis-seed=0",
    "-oaddopts=--import-mode=importlib", "-pno:cacheprovider", "-pno:xdist", "-pno:doctest",
    "-pno:unraisableexception", "-pno:threadexception",
)  # fmt: skip
MEMORY_BYTES = 6 << 30


class Verdict(NamedTuple):
    """What became of a mutant: killed, timed out or survived; and the processor's time, s."""

    fate: str
    seconds: float


class Setting(NamedTuple):
    """How tests are run.

    Attributes
    ----------
    module : str
        Dotted name of the module that is replaced.
    tests : tuple of str
        Test files.
    limit_s : float
        The processor's time after which a mutant is taken to run for ever, s.
    compiled : bool
        Whether kernels are compiled, each time anew; else they run as the Python that they are written in.
    """

    module: str
    tests: tuple[str, ...]
    limit_s: float
    compiled: bool = False


class _Replaced(importlib.machinery.SourceFileLoader):
    """Loads other source under a file's name."""

    def __init__(self, fullname: str, path: str, source: str) -> None:
        super().__init__(fullname, path)
        self._source = source

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self._source.encode(), self.path)


class _Finder:
    """Finds the replaced module before any other finder does."""

    def __init__(self, module: str, source: str) -> None:
        self._module, self._source = module, source

    def find_spec(
        self, fullname: str, path: object = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != self._module:
            return None
        loader = _Replaced(fullname, str(path_of(fullname)), self._source)
        return importlib.util.spec_from_file_location(fullname, path_of(fullname), loader=loader)


def path_of(module: str) -> Path:
    """File of a module of the package."""
    return ROOT.joinpath("src", *module.split(".")).with_suffix(".py")


def load_libraries(scratch: Path) -> None:
    """Import once what every test process needs, and nothing of the package."""
    os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = str(scratch / "hypothesis")
    for name in LIBRARIES:
        importlib.import_module(name)
    gc.freeze()


def verdicts(
    mutants: Sequence[Mutant], setting: Setting, workers: int, scratch: Path
) -> Iterator[tuple[Mutant, Verdict]]:
    """Verdicts in the order in which they are reached; ``workers`` processes at a time."""
    waiting, running = list(reversed(mutants)), {}
    try:
        while waiting or running:
            while waiting and len(running) < workers:
                mutant = waiting.pop()
                running[_started(mutant, setting, scratch)] = (mutant, time.monotonic())
            pid, status, usage = os.wait4(-1, os.WNOHANG)
            if pid in running:
                mutant, _ = running.pop(pid)
                yield (
                    mutant,
                    Verdict(_fate(status, scratch / str(pid) / "log"), usage.ru_utime + usage.ru_stime),
                )
                continue
            for late in [
                key for key, (_, since) in running.items() if time.monotonic() - since > 10 * setting.limit_s
            ]:
                os.kill(late, signal.SIGXCPU)
            time.sleep(0.01)
    finally:
        for pid in running:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


def _fate(status: int, log: Path) -> str:
    if os.WIFSIGNALED(status):
        return "timed out" if os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL) else "killed"
    code = os.WEXITSTATUS(status)
    if code not in (0, 1, 2):  # of pytest: passed, failed, a file that could not be imported
        raise RuntimeError(f"the tests did not run: pytest ended with {code}\n{log.read_text()}")
    return "killed" if code else "survived"


def _started(mutant: Mutant, setting: Setting, scratch: Path) -> int:
    pid = os.fork()
    if pid == 0:
        code = 3
        try:
            code = _tested(mutant, setting, scratch)
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    return pid


def _tested(mutant: Mutant, setting: Setting, scratch: Path) -> int:
    """In the child: pytest's exit code."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(setting.limit_s) + 1, int(setting.limit_s) + 3))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    own = scratch / str(os.getpid())
    own.mkdir()
    os.chdir(ROOT)
    log = os.open(own / "log", os.O_WRONLY | os.O_CREAT)
    os.dup2(log, 1)
    os.dup2(log, 2)
    sys.dont_write_bytecode = True
    # a kernel that calls the mutated one has it compiled in: no cache may be older than the mutant
    os.environ["NUMBA_CACHE_DIR"] = str(own)
    os.environ["NUMBA_DISABLE_JIT"] = "0" if setting.compiled else "1"
    import numba
    import pytest

    numba.config.reload_config()
    sys.meta_path.insert(0, _Finder(setting.module, mutant.source))
    return int(pytest.main([*OPTIONS, "--basetemp", str(own / "tmp"), *setting.tests]))
