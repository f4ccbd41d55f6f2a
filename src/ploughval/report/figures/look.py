"""The size that figures are drawn for: the report page, or a column or a page of a paper."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.textpath import text_to_path

from ploughval.errors import ConfigError, Fault

_MM_PER_IN = 25.4
_HOUSE_PT = 10.0
_HOUSE_SMALL_PT = 9.0
_NARROW_MM = 120.0
_LIMITS_MM = (60.0, 400.0)
_LIMITS_PT = (5.0, 14.0)
_DOTS_PER_IN = 300
_LEAST_LINE_PT = 0.5  # what printers hold
_PAPER = {
    "figure.facecolor": "#ffffff",
    "axes.facecolor": "#ffffff",
    "savefig.facecolor": "#ffffff",
    "savefig.dpi": _DOTS_PER_IN,
    "axes.linewidth": 0.6,
    "grid.linewidth": _LEAST_LINE_PT,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "svg.fonttype": "path",
}


@dataclass(frozen=True, slots=True)
class PaperLook:
    """Figures for a paper.

    Attributes
    ----------
    width_mm : float, mm
        Their width in print.
    type_pt : float, points
        Size of their type at that width.
    """

    width_mm: float
    type_pt: float = 8.0

    @property
    def small_pt(self) -> float:
        """Size of numbers at axes, of legends and of remarks."""
        return self.type_pt - 1.0

    @property
    def width_in(self) -> float:
        """Width in inches."""
        return self.width_mm / _MM_PER_IN

    @property
    def narrow(self) -> bool:
        """Whether it is a column, where panels stand below each other."""
        return self.width_mm < _NARROW_MM

    def settings(self) -> dict[str, Any]:
        """Settings of matplotlib that differ from those of the page."""
        large = dict.fromkeys(("font.size", "axes.titlesize", "axes.labelsize"), self.type_pt)
        small = dict.fromkeys(("legend.fontsize", "xtick.labelsize", "ytick.labelsize"), self.small_pt)
        return {**_PAPER, **large, **small}


_LOOK: ContextVar[PaperLook | None] = ContextVar("look", default=None)


@contextmanager
def paper_look(width_mm: float, *, type_pt: float = 8.0) -> Iterator[PaperLook]:
    """Plot functions called within draw for a paper; outside, and in other threads, nothing changes.

    Parameters
    ----------
    width_mm : float, mm
        Width of the figure in print, 60 to 400; below 120 panels stand below each other.
    type_pt : float, points
        Size of titles and labels at that width, 5 to 14; numbers and legends are one point smaller.

    Yields
    ------
    PaperLook

    Raises
    ------
    ConfigError
        A width or a size beyond these.

    Examples
    --------
    >>> from ploughval.report.figures import noise_figure, paper_look
    >>> with paper_look(84.0):
    ...     figure = noise_figure([50, 100], [1.0, 1.4], [0.1, 0.1], gain=None, floor=None)
    >>> round(float(figure.get_figwidth()) * 25.4, 6)
    84.0
    """
    named = (("width_mm", width_mm, _LIMITS_MM, "mm"), ("type_pt", type_pt, _LIMITS_PT, "points"))
    faults = [
        Fault(key, str(value), f"a number from {low:g} to {high:g} {measure}")
        for key, value, (low, high), measure in named
        if not low <= value <= high
    ]
    if faults:
        raise ConfigError("figures", faults)
    look = PaperLook(float(width_mm), float(type_pt))
    token = _LOOK.set(look)
    try:
        yield look
    finally:
        _LOOK.reset(token)


def settings(house: Any) -> Any:
    """Settings of matplotlib: those of the page with what the look in force changes."""
    look = _LOOK.get()
    return house if look is None else house | look.settings()


def narrow() -> bool:
    """Whether figures are drawn for a column of a paper."""
    look = _LOOK.get()
    return look is not None and look.narrow


def pixels_across(widest: int) -> int:
    """Pixels of a photograph across a figure: so many on the page, 300 to the inch on paper."""
    look = _LOOK.get()
    return widest if look is None else round(_DOTS_PER_IN * look.width_in)


def small_pt() -> float:
    """Size of remarks within a figure, points."""
    look = _LOOK.get()
    return _HOUSE_SMALL_PT if look is None else look.small_pt


def figure_size(
    chart_in: float, *, width_in: float, picture_in: float = 0.0, text_in: float = 0.0
) -> tuple[float, float]:
    """Width and height, inches, from those of the page.

    Parameters
    ----------
    chart_in : float, inches
        Height of curves: on paper it follows the width and the type alike, so that they keep their room.
    width_in : float, inches
        Width on the page.
    picture_in : float, inches
        Height of pictures with equal axes: it follows the width.
    text_in : float, inches
        Height of lines of text: it follows the type.
    """
    look = _LOOK.get()
    if look is None:
        return width_in, chart_in + picture_in + text_in
    wide, tall = look.width_in / width_in, look.type_pt / _HOUSE_PT
    return look.width_in, chart_in * (wide * tall) ** 0.5 + picture_in * wide + text_in * tall


def legend_outside(
    figure: Figure, handles: Sequence[Any], labels: Sequence[str], *, columns: int = 3
) -> None:
    """A legend above all panels, in as many columns as the figure is wide, each label once."""
    unique = dict(zip(labels, handles, strict=True))
    if unique:
        fitting = fitting_columns(list(unique), columns, float(figure.get_figwidth()))
        figure.legend(list(unique.values()), list(unique), loc="outside upper center", ncols=fitting)


def fitting_columns(labels: Sequence[str], most: int, width_in: float) -> int:
    """The largest number of columns, ``most`` at most, in which a legend is no wider than the figure."""
    font = FontProperties(family=mpl.rcParams["font.family"], size=mpl.rcParams["legend.fontsize"])
    size = font.get_size_in_points()
    beside = size * (mpl.rcParams["legend.handlelength"] + mpl.rcParams["legend.handletextpad"])
    gap = size * mpl.rcParams["legend.columnspacing"]
    wide = [
        beside + text_to_path.get_text_width_height_descent(text, font, ismath=False)[0] for text in labels
    ]
    for columns in range(min(most, len(labels)), 1, -1):
        rows, more = divmod(len(wide), columns)
        ends = [rows * k + min(k, more) for k in range(columns + 1)]
        total = sum(max(wide[a:b]) for a, b in pairwise(ends)) + gap * (columns - 1)
        if total + 2 * size <= 72 * width_in:
            return columns
    return 1


def width_of(axes: Axes) -> float:
    """Width of the figure that axes are in, inches."""
    figure = axes.figure
    return float(figure.get_figwidth()) if isinstance(figure, Figure) else 0.0


def finish(figure: Figure) -> None:
    """Make a figure independent of the settings under which it will be drawn; on paper, of one type size."""
    look = _LOOK.get()
    for axes in _all_axes(figure):
        axes.tick_params(
            which="both",
            labelsize=mpl.rcParams["xtick.labelsize"],
            color=mpl.rcParams["xtick.color"],
            labelcolor=mpl.rcParams["xtick.labelcolor"],
            grid_color=mpl.rcParams["grid.color"],
            grid_linewidth=mpl.rcParams["grid.linewidth"],
        )
        if look is not None:
            _fine(axes, look.type_pt / _HOUSE_PT)
    if look is None:
        return
    for legend in figure.legends:
        _finer(legend.legend_handles, look.type_pt / _HOUSE_PT)
    if figure.get_suptitle():
        figure.suptitle("")  # the caption says it
    for text in figure.findobj(Text):
        text.set_fontsize(min(max(float(text.get_fontsize()), look.small_pt), look.type_pt))


def _all_axes(figure: Figure) -> list[Axes]:
    """Axes of a figure, secondary ones too."""
    found: list[Any] = []
    for axes in figure.axes:
        found += [axes, *axes.child_axes]
    return found


def _fine(axes: Axes, factor: float) -> None:
    """Lines and marks as much finer as the type is smaller, none finer than printers hold."""
    legend = axes.get_legend()
    _finer([*axes.lines, *([] if legend is None else legend.legend_handles)], factor)
    for group in axes.collections:
        if isinstance(group, LineCollection):
            group.set_linewidth([max(_LEAST_LINE_PT, factor * width) for width in _widths(group)])
        elif isinstance(group, PathCollection):
            group.set_sizes(factor**2 * group.get_sizes())


def _widths(group: LineCollection) -> list[float]:
    return [float(width) for width in np.atleast_1d(np.asarray(group.get_linewidth(), dtype=float))]


def _finer(artists: Sequence[Any], factor: float) -> None:
    for line in artists:
        if isinstance(line, Line2D):
            line.set_linewidth(max(_LEAST_LINE_PT, factor * float(line.get_linewidth())))
            line.set_markersize(factor * float(line.get_markersize()))
            line.set_markeredgewidth(max(_LEAST_LINE_PT, factor * float(line.get_markeredgewidth())))
