"""What a page is made of: chapters with figures, tables and notes; only figures are markup."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import count

import pandas as pd
from markupsafe import Markup
from matplotlib.figure import Figure

from ploughval.axes import BAND_COLUMNS, unit_of
from ploughval.report.figures.style import to_svg
from ploughval.report.text import MISSING, brief, label, slug, unit, with_std


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure on the page; its name is that of the file it can be saved as.

    ``data`` are the files of the result folder that hold what is drawn.
    """

    svg: Markup
    caption: str
    name: str = ""
    data: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell: what is printed, the number behind it with its uncertainty, and the kind of mark it carries.

    ``ratio`` draws a dot where an error lies in units of its validation uncertainty.
    """

    text: str
    value: float | None = None
    mark: str = ""
    std: float | None = None
    ratio: float | None = None

    @property
    def numeric(self) -> bool:
        """Whether it holds a number."""
        return self.value is not None or self.text == MISSING


@dataclass(frozen=True, slots=True)
class Table:
    """A table on the page; folded tables open at a click, kinds other than "" become cards on a phone."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    folded: bool = False
    kind: str = ""
    footnotes: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Chapter:
    """A chapter; without figures and tables it still says what could not be had.

    ``player`` is markup of the package's own templates, shown before the figures.
    """

    key: str
    title: str
    lead: str = ""
    drawings: Sequence[Drawing] = ()
    grid: Sequence[Drawing] = ()
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()
    faults: Sequence[str] = ()
    player: Markup | None = None


@dataclass(frozen=True, slots=True)
class Tile:
    """A figure of the summary: a large value and what it is."""

    label: str
    value: str
    detail: str = ""


@dataclass(slots=True)
class Pen:
    """Draws figures for a page, numbers them and sees that no two have one name."""

    prefix: str = "f"
    count: int = field(default=0)
    names: set[str] = field(default_factory=set)

    def draw(self, figure: Figure, alt: str, caption: str, *, name: str, data: Sequence[str] = ()) -> Drawing:
        """A figure as an inline drawing; the alternative text is for those who do not see it.

        Parameters
        ----------
        figure : Figure
            What is drawn.
        alt, caption : str
            Alternative text, and what stands below.
        name : str
            What the figure is called as a file: becomes lower-case letters, digits and dashes, and gets a
            number where another figure of the page has it already.
        data : sequence of str
            Files of the result folder that hold what is drawn.
        """
        self.count += 1
        # to_svg escapes the alternative text, matplotlib every text in the figure.
        svg = Markup(to_svg(figure, f"{self.prefix}{self.count}", alt))
        return Drawing(svg, caption, self.own_name(name), tuple(data))

    def own_name(self, name: str) -> str:
        """A name as that of a file, of this figure alone.

        >>> pen = Pen()
        >>> pen.own_name("Force, d = 30 mm"), pen.own_name("force d 30 mm")
        ('force-d-30-mm', 'force-d-30-mm-2')
        """
        stem = slug(name)[:60].strip("-")
        tried = (stem if number == 1 else f"{stem}-{number}" for number in count(1))
        own = next(one for one in tried if one not in self.names)
        self.names.add(own)
        return own


def value_cell(value: object, digits: int = 4) -> Cell:
    """A cell from a number or a text."""
    if value is None:
        return Cell(MISSING)
    if isinstance(value, bool):
        return Cell("yes" if value else "no")
    if isinstance(value, int | float):
        finite = float(value) if value == value else None
        if (isinstance(value, float) and not value.is_integer()) or abs(value) >= 1e9:
            return Cell(brief(finite, digits), finite)
        return Cell(MISSING if finite is None else f"{value:.0f}".replace("-", "−"), finite)
    return Cell(str(value))


def table_of(
    frame: pd.DataFrame, caption: str, columns: Iterable[str] | None = None, *, folded: bool = False
) -> Table:
    """A table of a DataFrame's columns, units in the head."""
    names = [name for name in (columns or frame.columns) if name in frame]
    rows = [[value_cell(value) for value in row] for row in frame[names].itertuples(index=False, name=None)]
    return Table(caption, [_head(name) for name in names], rows, folded=folded)


def pair_cell(value: float | None, std: float | None) -> Cell:
    """A cell with a value and its standard uncertainty."""
    if value is None or not math.isfinite(value):
        return Cell(with_std(value, std))
    return Cell(with_std(value, std), value, std=std if std is not None and math.isfinite(std) else None)


def travel_cell(value: float) -> Cell:
    """A displacement to the hundredth of a millimetre, which is finer than any band is known to."""
    if not math.isfinite(value):
        return Cell(MISSING)
    return Cell(f"{value:z.2f}".replace("-", "−"), value)


BAND_HEAD = (
    "Source",
    "Band",
    "From u, mm",
    "To u, mm",
    "Inclination β ± std, °",
    "Outcrop x ± std, mm",
    "Slip, mm",
)


def band_rows(bands: pd.DataFrame | None, source: str) -> list[list[Cell]]:
    """Rows of :data:`BAND_HEAD`, one a band in the order of their starts."""
    if bands is None:
        return []
    rows = []
    for _, band in bands.sort_values("u_start_mm").iterrows():
        value = {column: float(band[column]) for column in BAND_COLUMNS}
        rows.append(
            [
                Cell(source, mark=source),
                value_cell(value["band"]),
                travel_cell(value["u_start_mm"]),
                travel_cell(value["u_end_mm"]),
                pair_cell(value["beta_deg"], value["beta_std_deg"]),
                pair_cell(value["outcrop_x_mm"], value["outcrop_std_mm"]),
                value_cell(value["slip_mm"]),
            ]
        )
    return rows


def _head(name: str) -> str:
    measure = unit(unit_of(name))
    return f"{label(name)}, {measure}" if measure else label(name)
