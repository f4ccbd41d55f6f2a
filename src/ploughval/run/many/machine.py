"""What this machine gives: processors and free memory, within what the system allows this process."""

import os
from collections.abc import Iterator
from pathlib import Path

ROOT = Path("/")


def processors(root: Path = ROOT) -> int:
    """Processors that this process may use: those it is bound to, or the quota of its control group if less.

    Parameters
    ----------
    root : Path
        Where ``proc`` and ``sys`` are; where there is neither, as outside Linux, no quota is known.
    """
    bound = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    quotas = [bound]
    for group in _groups(root, "cpu"):
        limit, *period = (
            _words(group / "cpu.max")
            or (_words(group / "cpu.cfs_quota_us") + _words(group / "cpu.cfs_period_us"))
            or [""]
        )
        if limit.isdecimal() and period and period[0].isdecimal() and int(period[0]):
            quotas.append(-(-int(limit) // int(period[0])))
    return max(min(quotas), 1)


def free_bytes(root: Path = ROOT) -> int | None:
    """Memory that is free, or holds only copies of files; None where the system does not tell."""
    found = [free for free in (_available(root), *map(_left, _groups(root, "memory"))) if free is not None]
    return max(min(found), 0) if found else None


def _available(root: Path) -> int | None:
    for line in _lines(root / "proc" / "meminfo"):
        name, _, value = line.partition(":")
        if name == "MemAvailable":
            return int(value.split()[0]) * 1024
    return None


def _left(group: Path) -> int | None:
    """What a control group has left of its memory; None where it has no limit."""
    for limit_name, used_name, copies in (
        ("memory.max", "memory.current", "inactive_file"),
        ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    ):
        limit, used = _words(group / limit_name), _words(group / used_name)
        if limit and used and limit[0].isdecimal() and used[0].isdecimal():
            held = dict(line.split() for line in _lines(group / "memory.stat"))
            return int(limit[0]) - int(used[0]) + int(held.get(copies, 0))
    return None


def _groups(root: Path, kind: str) -> Iterator[Path]:
    """The folders of this process's control group and of those around it, in both forms of control groups."""
    for line in _lines(root / "proc" / "self" / "cgroup"):
        _, kinds, inside = line.split(":", 2)
        if kinds == "":
            top = root / "sys" / "fs" / "cgroup"
        elif kind in kinds.split(","):
            top = root / "sys" / "fs" / "cgroup" / kind
        else:
            continue
        group = top / inside.lstrip("/")
        yield from (place for place in (group, *group.parents) if place == top or top in place.parents)


def _words(path: Path) -> list[str]:
    return " ".join(_lines(path)).split()


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
