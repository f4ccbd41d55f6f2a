"""The error tree: every error that a user can cause is a PloughvalError with a full message.

Who catches one catches those below it::

    PloughvalError
    +-- ConfigError        test.toml or the command line (gathers all faults)
    +-- DataError          a photograph, log or result file (path, and frame where it has one)
    +-- CalibrationError   pixels cannot be turned into millimetres
    +-- CorrelationError   images or points that cannot be correlated at all
    +-- ConvergenceError   a model or a fit that found no solution
    +-- MissingExtraError  an optional dependency is not installed
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing that is wrong: where it stands, its value, what was expected, what to do."""

    place: str
    value: str
    expected: str
    remedy: str = ""

    def __str__(self) -> str:
        text = f"{self.place}: got {self.value}; expected {self.expected}"
        return f"{text}. {self.remedy}" if self.remedy else text


class PloughvalError(Exception):
    """Base of every error that ploughval raises on purpose."""


class ConfigError(PloughvalError):
    """Settings that cannot be used; names the file and every fault in it at once."""

    def __init__(self, source: Path | str, faults: Sequence[Fault]) -> None:
        self.source = str(source)
        self.faults = tuple(faults)
        count = len(self.faults)
        head = f"{self.source}: {count} fault{'s' if count != 1 else ''}"
        super().__init__("\n".join([head, *(f"  - {fault}" for fault in self.faults)]))

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel between processes with the same parts."""
        return type(self), (self.source, self.faults)


class DataError(PloughvalError):
    """A file with measurements that cannot be used."""

    def __init__(self, message: str, *, path: Path | str | None = None, frame: int | None = None) -> None:
        self.path = None if path is None else str(path)
        self.frame = frame
        where = [] if self.path is None else [self.path]
        if frame is not None:
            where.append(f"frame {frame}")
        self._message = message
        super().__init__(f"{', '.join(where)}: {message}" if where else message)

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel between processes with the same parts."""
        return partial(type(self), path=self.path, frame=self.frame), (self._message,)


class CalibrationError(PloughvalError):
    """Pixels cannot be turned into millimetres with what was given."""


class CorrelationError(PloughvalError):
    """Images or points that cannot be correlated at all (shapes, types, no points)."""


class ConvergenceError(PloughvalError):
    """A model or a fit that found no solution."""


class MissingExtraError(PloughvalError):
    """An optional dependency is missing; the message holds the line that installs it."""

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        self.package, self.extra = package, extra
        super().__init__(
            f"{purpose} needs the package {package!r}, which is not installed. "
            f"Install it with: pip install 'ploughval[{extra}]'"
        )
        self._purpose = purpose

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel between processes with the same parts."""
        return type(self), (self.package, self.extra, self._purpose)
