"""What became of one test, and how that travels between processes: as JSON."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Self

from ploughval.run.urls import placed


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one test.

    Attributes
    ----------
    name : str
        Of the test.
    results : Path or str
        Result folder; text: a URL.
    complete : bool
        Whether nothing was lost.
    faults, warnings : tuple of str
        What was lost, and what to mind.
    metrics : dict
        The metrics by name, as in metrics.json; empty without a comparison.
    steps : tuple of str
        Steps that the scene called for.
    seconds : float, s
        What it took.
    report : Path, str or None
        The page; None: none was made.
    reused : tuple of str
        Stages that an earlier run's result stands for.
    """

    name: str
    results: Path | str
    complete: bool
    faults: tuple[str, ...]
    warnings: tuple[str, ...]
    metrics: dict[str, Any]
    steps: tuple[str, ...]
    seconds: float
    report: Path | str | None = None
    reused: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """All of it as values that JSON holds."""
        told = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: str(value) if isinstance(value, Path) else value for name, value in told.items()}

    @classmethod
    def from_json(cls, told: Mapping[str, Any]) -> Self:
        """The same again from what :meth:`to_json` gave, after JSON has made lists of its tuples."""
        parts: dict[str, Any] = {n: tuple(v) if isinstance(v, list) else v for n, v in told.items()}
        for name in ("results", "report"):
            parts[name] = None if parts[name] is None else placed(parts[name])
        return cls(**parts)
