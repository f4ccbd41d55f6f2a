"""Finds and runs the measurements of speed against error, and makes their page."""

import importlib
import importlib.util
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from ploughval.errors import ConfigError, Fault
from ploughval.watch import Progress, one_step, unheard

PREFIX = "bench_"
PAGE = "speed_error_page"
MACHINE = "speed_error.machine"
KEPT = Path("reports/speed-error")
"""Where tables, figures and the page go."""
QUICK_NAME = "ploughval-bench-quick"
QUICK_OPTION = "--quick"


@dataclass(frozen=True, slots=True)
class Benches:
    """What is to be measured.

    Attributes
    ----------
    names : tuple of str
        Which scripts ("model" for bench_model.py); empty: all, by name.
    out : Path or None
        Folder for the tables and the page; None: :data:`KEPT`, or one of the temporary folder where quick.
    quick : bool
        A smoke run: few cases, one round. Scripts that have no such run are left out.
    """

    names: tuple[str, ...] = ()
    out: Path | None = None
    quick: bool = False

    @property
    def folder(self) -> Path:
        """Where the tables go."""
        if self.out is not None:
            return self.out
        return Path(tempfile.gettempdir()) / QUICK_NAME if self.quick else KEPT


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


def run_benches(benches: Benches, *, progress: Progress = unheard) -> list[Path]:
    """Run benchmark scripts, each of which prints its table and writes it; then make the page of all tables.

    Parameters
    ----------
    benches : Benches
        Which ones, where to, and whether quick.
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
    chosen = _chosen(benches)
    out = benches.folder
    before = _stamps(out)
    options = ["--out", str(out), *([QUICK_OPTION] if benches.quick else [])]
    progress("bench", 0, len(chosen))
    for done, (name, path) in enumerate(chosen.items(), start=1):
        with one_step(progress, f"bench {name}"):
            _load(path).main(options)
        progress("bench", done, len(chosen))
    if (bench_folder() / f"{PAGE}.py").is_file():
        _shared(MACHINE).write_machine(out)
        _shared(PAGE).write_page(out)
    return sorted(path for path, stamp in _stamps(out).items() if before.get(path) != stamp)


def write_bench_page(out: Path) -> list[Path]:
    """Make page, figures and README.md from the tables of a folder; nothing is measured.

    Parameters
    ----------
    out : Path
        Folder that holds the tables.

    Raises
    ------
    ConfigError
        A folder without a table.
    """
    if not any(out.glob("*.csv")):
        raise ConfigError("bench", [Fault("out", str(out), "a folder with tables of ploughval bench")])
    written: list[Path] = _shared(PAGE).write_page(out)
    return written


def _chosen(benches: Benches) -> dict[str, Path]:
    """Scripts by name, in the order asked for."""
    folder = bench_folder()
    known = {path.stem.removeprefix(PREFIX): path for path in sorted(folder.glob(f"{PREFIX}*.py"))}
    unknown = [name for name in benches.names if name not in known]
    if unknown:
        raise ConfigError(
            "bench", [Fault("name", repr(name), f"one of {', '.join(known)}") for name in unknown]
        )
    chosen = {name: known[name] for name in benches.names or known}
    if not benches.quick:
        return chosen
    quick = f'"{QUICK_OPTION}"'
    return {name: path for name, path in chosen.items() if quick in path.read_text(encoding="utf-8")}


def _stamps(out: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in out.rglob("*") if path.is_file()}


def _shared(name: str) -> ModuleType:
    """A module that the scripts share."""
    _see(bench_folder())
    return importlib.import_module(name)


def _see(folder: Path) -> None:
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))


def _load(path: Path) -> ModuleType:
    _see(path.parent)  # the scripts share modules
    spec = importlib.util.spec_from_file_location(f"ploughval_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
