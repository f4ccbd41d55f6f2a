"""Finds and runs the measurements of speed against error."""

import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from ploughval.errors import ConfigError, Fault
from ploughval.watch import Progress, one_step, unheard

PREFIX = "bench_"


def bench_folder() -> Path:
    """Folder of the benchmark scripts: inside an installed package, or beside src in a checkout.

    Raises
    ------
    ConfigError
        When neither is there.
    """
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "benchmarks", package.parents[1] / "benchmarks"):
        if any(folder.glob(f"{PREFIX}*.py")):
            return folder
    raise ConfigError("bench", [Fault("benchmarks", "nothing", "the scripts of a wheel or a checkout")])


def run_benches(names: Sequence[str], out: Path, *, progress: Progress = unheard) -> list[Path]:
    """Run benchmark scripts; each prints its table and writes it.

    Parameters
    ----------
    names : sequence of str
        Which ones ("model" for bench_model.py); empty: all, by name.
    out : Path
        Folder for the tables.
    progress : callable
        Hears of (stage, done, total): the scripts as steps of one stage, and each as a stage.

    Returns
    -------
    list of Path
        Files that are new or were changed.

    Raises
    ------
    ConfigError
        For an unknown name; the message lists the known ones.
    """
    folder = bench_folder()
    known = {path.stem.removeprefix(PREFIX): path for path in sorted(folder.glob(f"{PREFIX}*.py"))}
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ConfigError(
            "bench", [Fault("name", repr(name), f"one of {', '.join(known)}") for name in unknown]
        )
    if str(folder) not in sys.path:  # the scripts share modules
        sys.path.insert(0, str(folder))
    before = _stamps(out)
    wanted = list(names or known)
    progress("bench", 0, len(wanted))
    for done, name in enumerate(wanted, start=1):
        with one_step(progress, f"bench {name}"):
            _load(known[name]).main(["--out", str(out)])
        progress("bench", done, len(wanted))
    return sorted(path for path, stamp in _stamps(out).items() if before.get(path) != stamp)


def _stamps(out: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in out.rglob("*") if path.is_file()}


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"ploughval_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
