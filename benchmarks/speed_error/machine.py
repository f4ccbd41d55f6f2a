"""machine.json: what the times were taken on; no name of a host, no path."""

import json
import os
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

NAME = "machine.json"
PACKAGES = ("ploughval", "numpy", "scipy", "numba", "opencv-python-headless", "pandas", "scikit-image")
PROTOCOL = (
    "Compiled kernels have run once before anything is timed.",
    "A time is the median of repeated rounds of the same call.",
    "CPU is the time of the process, all its threads together; where nothing else is said it was taken "
    "with one thread.",
    "Clock is elapsed time: that of two threads is told by the clock, and of whole commands.",
    "Other work on the machine inflates the clock, and the CPU less; only ratios travel to other machines.",
)


def machine_facts() -> dict[str, Any]:
    """Processor, cores, memory, system and versions."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "memory_GB": _memory_gb(),
        "system": f"{platform.system()}, {platform.machine()}",
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        **{name: version(name) for name in PACKAGES},
    }


def write_machine(folder: Path) -> Path:
    """Write machine.json into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / NAME
    path.write_text(json.dumps(machine_facts(), indent=2) + "\n", encoding="utf-8")
    return path


def read_machine(folder: Path) -> dict[str, Any]:
    """What machine.json says; nothing where there is none."""
    path = folder / NAME
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())


def _memory_gb() -> int | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9)
    except (AttributeError, OSError, ValueError):
        return None
