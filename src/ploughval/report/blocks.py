"""What a page is made of: chapters with figures, tables and notes; only figures are markup."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import pandas as pd
from markupsafe import Markup
from matplotlib.figure import Figure

from ploughval.report.figures.style import to_svg
from ploughval.report.text import MISSING, label, number, unit


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure on the page."""

    svg: Markup
    caption: str


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell: what is printed, the number behind it, and the kind of mark it carries."""

    text: str
    value: float | None = None
    mark: str = ""

    @property
    def numeric(self) -> bool:
        """Whether it holds a number."""
        return self.value is not None or self.text == MISSING


@dataclass(frozen=True, slots=True)
class Table:
    """A table on the page; folded tables open at a click."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    folded: bool = False
    cards: bool = False


@dataclass(frozen=True, slots=True)
class Chapter:
    """A chapter; without figures and tables it still says what could not be had."""

    key: str
    title: str
    lead: str = ""
    drawings: Sequence[Drawing] = ()
    grid: Sequence[Drawing] = ()
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Tile:
    """A figure of the summary: a large value and what it is."""

    label: str
    value: str
    detail: str = ""


@dataclass(slots=True)
class Pen:
    """Draws figures for a page and numbers them."""

    prefix: str = "f"
    count: int = field(default=0)

    def draw(self, figure: Figure, alt: str, caption: str) -> Drawing:
        """A figure as an inline drawing; the alternative text is for those who do not see it."""
        self.count += 1
        # to_svg escapes the alternative text, matplotlib every text in the figure.
        svg = Markup(to_svg(figure, f"{self.prefix}{self.count}", alt))
        return Drawing(svg, caption)


def value_cell(value: object, digits: int = 4) -> Cell:
    """A cell from a number or a text."""
    if value is None:
        return Cell(MISSING)
    if isinstance(value, bool):
        return Cell("yes" if value else "no")
    if isinstance(value, int | float):
        finite = float(value) if value == value else None
        if (isinstance(value, float) and not value.is_integer()) or abs(value) >= 1e9:
            return Cell(number(finite, digits), finite)
        return Cell(MISSING if finite is None else f"{value:.0f}".replace("-", "−"), finite)
    return Cell(str(value))


def table_of(
    frame: pd.DataFrame, caption: str, columns: Iterable[str] | None = None, *, folded: bool = False
) -> Table:
    """A table of a DataFrame's columns, units in the head."""
    names = [name for name in (columns or frame.columns) if name in frame]
    rows = [[value_cell(value) for value in row] for row in frame[names].itertuples(index=False, name=None)]
    return Table(caption, [_head(name) for name in names], rows, folded=folded)


def _head(name: str) -> str:
    from ploughval.axes import unit_of

    measure = unit(unit_of(name))
    return f"{label(name)}, {measure}" if measure else label(name)
