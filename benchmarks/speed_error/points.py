"""What speed against error is drawn and told from: points, panels, subjects."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ploughval.report.blocks import Table

ERROR, TIME = "error", "time"
SAME = 0.03
"""Relative differences below this are none: what repeated rounds of one machine leave."""


@dataclass(frozen=True, slots=True)
class Point:
    """One setting: what it costs and how far it is from the truth.

    Attributes
    ----------
    family : str
        Settings of one family are joined by a line, in their order.
    setting : str
    time, error : float
        In the units of the panel; NaN: not measured, and not drawn.
    default : bool
        Whether it is what happens when nothing is set.
    """

    family: str
    setting: str
    time: float
    error: float
    default: bool = False

    @property
    def known(self) -> bool:
        """Whether it can stand on logarithmic axes."""
        return math.isfinite(self.time) and math.isfinite(self.error) and self.time > 0 and self.error > 0


@dataclass(frozen=True, slots=True)
class Level:
    """A thin line: an error or a time that is known without a setting.

    Attributes
    ----------
    axis : "error" or "time"
    value : float
    label : str
    kind : "target", "bound" or "mark"
        A figure to reach (dashed), a limit of nature (whole), or what others take (dotted).
    """

    axis: str
    value: float
    label: str
    kind: str = "target"


@dataclass(frozen=True, slots=True)
class Panel:
    """Error against time of one quantity.

    Attributes
    ----------
    key, title : str
    error_label, time_label : str
        Axis labels with units.
    points, peers : tuple of Point
        Settings of ours; other programs.
    levels : tuple of Level
    default : str
        What the default is, in words.
    apart : frozenset of str
        Families that do less, or something else, than the default: they are drawn and not compared with it.
    """

    key: str
    title: str
    error_label: str
    time_label: str
    points: tuple[Point, ...]
    peers: tuple[Point, ...] = ()
    levels: tuple[Level, ...] = ()
    default: str = ""
    apart: frozenset[str] = frozenset()

    @property
    def standard(self) -> Point:
        """The default."""
        return next(point for point in self.points if point.default)

    @property
    def measured(self) -> tuple[Point, ...]:
        """Settings that can be compared, each once."""
        alike = [p for p in self.points if p.known and p.family not in self.apart]
        first = {(p.time, p.error): p for p in reversed(alike)}
        return tuple(first[key] for key in sorted(first))

    def of(self, family: str) -> dict[str, Point]:
        """Settings of a family."""
        return {point.setting: point for point in self.points if point.family == family}

    def better(self) -> tuple[Point, ...]:
        """Settings that are both faster and more exact than the default, by more than rounds differ."""
        mine, less = self.standard, 1.0 - SAME
        return tuple(p for p in self.measured if p.time < less * mine.time and p.error < less * mine.error)

    def targets(self, axis: str) -> tuple[float, ...]:
        """Figures to reach on an axis."""
        return tuple(level.value for level in self.levels if level.axis == axis and level.kind == "target")


@dataclass(frozen=True, slots=True)
class Subject:
    """A chapter: what was measured, panels, what to choose when, tables.

    Attributes
    ----------
    key, title, lead : str
    panels : tuple of Panel
    choice : tuple of str
        Sentences made from the tables.
    tables : tuple of Table
    files : tuple of str
        The tables' names.
    """

    key: str
    title: str
    lead: str
    panels: tuple[Panel, ...]
    choice: tuple[str, ...]
    tables: tuple[Table, ...]
    files: tuple[str, ...]


def read(folder: Path, name: str) -> pd.DataFrame | None:
    """A table of the folder; None where it has not been measured. Settings stay as they are written."""
    path = folder / name
    return pd.read_csv(path, dtype={"setting": str}, keep_default_na=True) if path.is_file() else None


def family_points(
    table: pd.DataFrame, time: str, error: str, *, families: Iterable[str] | None = None
) -> tuple[Point, ...]:
    """Points of a table with columns family, setting and default."""
    wanted = None if families is None else set(families)
    return tuple(
        Point(
            str(row.family),
            str(row.setting),
            float(getattr(row, time)),
            float(getattr(row, error)),
            bool(row.default),
        )
        for row in table.itertuples()
        if wanted is None or row.family in wanted
    )
