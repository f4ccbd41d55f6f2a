"""The one look of speed against error: a line a family, a ring about the default, names beside the points."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from drawing.png import save_light
from ploughval.report.figures.style import INK, MUTED, SERIES, new_figure, styled
from ploughval.report.text import brief
from speed_error.points import ERROR, TIME, Level, Panel, Point

MARKS = ("o", "s", "^", "D", "v", "P", "X", "h")
DASHES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)), (0, (7, 2)))
COLOURS = 128  # of a picture with a palette
PANEL_IN = (5.4, 4.4)
SMALL = 8.0
LEAST_DECADES = 0.9
LEVELS = {"target": (0, (4, 3)), "bound": "-", "mark": (0, (1, 2))}
RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
SIDES = ((1, 0), (-1, 0), (0, 1), (0, -1), (0.8, 0.8), (-0.8, 0.8), (0.8, -0.8), (-0.8, -0.8))
PEERS, DEFAULT = "other programs", "default"
Box = tuple[float, float, float, float]
Look = tuple[str, str, Any]


@styled
def panel_figure(panel: Panel, panels: Sequence[Panel] = ()) -> Figure:
    """One panel as a figure of its own; a family looks as in all ``panels`` of the subject."""
    figure = new_figure(PANEL_IN[1], width_in=PANEL_IN[0])
    ax, looks = figure.subplots(), looks_of(panels or [panel])
    draw_panel(ax, panel, looks)
    _legend(figure, [ax])
    _name_points(figure, [(ax, panel)], looks)
    return figure


@styled
def subject_figure(panels: Sequence[Panel]) -> Figure:
    """All panels of a subject side by side, two in a row."""
    rows = -(-len(panels) // 2)
    columns = min(2, len(panels))
    figure = new_figure(3.9 * rows + 0.6, width_in=5.2 * columns)
    axes = list(np.atleast_1d(figure.subplots(rows, columns)).ravel())
    looks = looks_of(panels)
    for ax, panel in zip(axes, panels, strict=False):
        draw_panel(ax, panel, looks)
    for ax in axes[len(panels) :]:
        ax.set_axis_off()
    _legend(figure, axes[: len(panels)], axes[len(panels) :])
    _name_points(figure, list(zip(axes, panels, strict=False)), looks)
    return figure


@styled
def save_png(figure: Figure, path: Path) -> Path:
    """A picture with a palette: the same to the eye in a third of the bytes."""
    return save_light(figure, path, colours=COLOURS)


def draw_panel(ax: Axes, panel: Panel, looks: dict[str, Look]) -> None:
    """Lines, points, the default's ring, other programs and levels of one panel."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_title(panel.title, loc="left")
    ax.set_xlabel(panel.time_label)
    ax.set_ylabel(panel.error_label)
    for family in dict.fromkeys(point.family for point in panel.points):
        colour, mark, dash = looks[family]
        line = [p for p in panel.points if p.family == family and p.known]
        ax.plot(
            [p.time for p in line], [p.error for p in line], color=colour, marker=mark, linestyle=dash,
            markersize=5, linewidth=1.3, label=family, zorder=3,
        )  # fmt: skip
    peers = [p for p in panel.peers if p.known]
    if peers:
        ax.plot(
            [p.time for p in peers], [p.error for p in peers], "*", color=MUTED, markersize=9,
            label=PEERS, zorder=2,
        )  # fmt: skip
    ring = panel.standard
    if ring.known:
        ax.plot(
            [ring.time], [ring.error], "o", color=INK, markersize=13, fillstyle="none", markeredgewidth=1.8,
            label=DEFAULT, zorder=5,
        )  # fmt: skip
    _levels(ax, panel)
    _limits(ax, panel)


def looks_of(panels: Sequence[Panel]) -> dict[str, Look]:
    """Colour, mark and dash of each family: no two alike even without colour."""
    families = dict.fromkeys(point.family for panel in panels for point in panel.points)
    return {
        family: (SERIES[k % len(SERIES)], MARKS[k % len(MARKS)], DASHES[k % len(DASHES)])
        for k, family in enumerate(families)
    }


def _levels(ax: Axes, panel: Panel) -> None:
    for level in panel.levels:
        look = {"color": MUTED, "linewidth": 1.0, "linestyle": LEVELS[level.kind], "zorder": 1}
        if level.axis == ERROR:
            ax.axhline(level.value, **look)
        else:
            ax.axvline(level.value, **look)


def _limits(ax: Axes, panel: Panel) -> None:
    known = [p for p in (*panel.points, *panel.peers) if p.known]
    times = [p.time for p in known] + [v.value for v in panel.levels if v.axis == TIME]
    errors = [p.error for p in known] + [v.value for v in panel.levels if v.axis == ERROR]
    for values, limit, axis in ((times, ax.set_xlim, ax.xaxis), (errors, ax.set_ylim, ax.yaxis)):
        low, high = np.log10(min(values)), np.log10(max(values))
        decades = max(1.24 * (high - low), high - low + 0.24, LEAST_DECADES)  # rounds differ by some per cent
        middle = 0.5 * (low + high)
        limit(10 ** (middle - 0.5 * decades), 10 ** (middle + 0.5 * decades))
        if decades < 2.5:
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(lambda value, _: _tick(value))
        axis.set_minor_formatter(NullFormatter())


def _tick(value: float) -> str:
    power = round(float(np.log10(value)))
    return f"10{str(power).translate(RAISED)}" if power >= 5 else brief(value, 3)


def _legend(figure: Figure, axes: Sequence[Axes], empty: Sequence[Axes] = ()) -> None:
    """Every family once, below the panels or where a panel is free; other programs and the default last."""
    found = {
        label: handle for ax in axes for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
    }
    last = [name for name in (PEERS, DEFAULT) if name in found]
    names = [name for name in found if name not in last] + last
    handles = [found[name] for name in names]
    if empty:
        empty[0].legend(handles, names, loc="upper left", labelspacing=0.9)
        return
    columns = 2 if figure.get_size_inches()[0] < 7 else 4
    figure.legend(handles, names, loc="outside lower left", ncols=columns)


def _name_points(figure: Figure, pairs: Sequence[tuple[Axes, Panel]], looks: dict[str, Look]) -> None:
    """Names beside points and on levels, each where it hides least, once the axes have their places."""
    figure.draw_without_rendering()
    for ax, panel in pairs:
        taken = _marks(ax, panel)
        for level in panel.levels:
            others = [other for other in panel.levels if other is not level]
            _name_level(ax, level, taken, [_line_of(ax, other) for other in others])
        seen: set[tuple[float, float]] = set()
        known = [p for p in (*panel.points, *panel.peers) if p.known]
        for point in (panel.standard, *panel.points):
            _name(ax, point, looks[point.family][0], taken, seen, known)
        for point in panel.peers:
            _name(ax, point, MUTED, taken, seen, known)


def _marks(ax: Axes, panel: Panel) -> list[Box]:
    """What names must not hide: marks, and the lines between them."""
    taken: list[Box] = []
    spots = _pixels(ax, [p for p in (*panel.points, *panel.peers) if p.known])
    taken += [(x - 4, y - 4, x + 4, y + 4) for x, y in spots]
    for family in dict.fromkeys(point.family for point in panel.points):
        line = _pixels(ax, [p for p in panel.points if p.family == family and p.known])
        for one, other in pairwise(line):
            for share in np.linspace(0.0, 1.0, 9)[1:-1]:
                x, y = one + share * (other - one)
                taken.append((x - 1.5, y - 1.5, x + 1.5, y + 1.5))
    return taken


def _pixels(ax: Axes, points: Sequence[Point]) -> NDArray[np.float64]:
    """Places on the canvas, in points of type."""
    places = np.array([(p.time, p.error) for p in points], float).reshape(-1, 2)
    return np.asarray(ax.transData.transform(places)) * 72.0 / ax.figure.dpi


def _frame(ax: Axes) -> Box:
    """The panel on the canvas, in points of type."""
    found, scale = ax.get_window_extent(), 72.0 / ax.figure.dpi
    return found.x0 * scale, found.y0 * scale, found.x1 * scale, found.y1 * scale


def _name(
    ax: Axes,
    point: Point,
    colour: str,
    taken: list[Box],
    seen: set[tuple[float, float]],
    known: Sequence[Point],
) -> None:
    """The setting beside its point; left out where there is no room: the table has it."""
    text, marks = point.setting, _pixels(ax, known)
    if not point.known or not text or (point.time, point.error) in seen:
        return
    seen.add((point.time, point.error))
    x, y = _pixels(ax, [point])[0]
    wide, high, gap = 0.58 * SMALL * len(text), SMALL, 10.0 if point.default else 6.0
    choices = []
    for far in (1.0, 1.7, 2.6):
        for dx, dy in SIDES:
            cx, cy = x + dx * (gap * far + 0.5 * wide), y + dy * (gap * far + 0.5 * high)
            box = (cx - 0.5 * wide, cy - 0.5 * high, cx + 0.5 * wide, cy + 0.5 * high)
            mine = float(_away(box, np.array([[x, y]])).min())  # a name is read as that of the nearest mark
            strange = 1e3 * bool(_away(box, marks).min() < mine - 0.1)
            choices.append((_cost(box, ax, taken) + strange + 3.0 * far, len(choices), cx, cy, box))
    cost, _, cx, cy, box = min(choices)
    if cost > 0.3 * wide * high + 10.0:
        return
    taken.append(box)
    ax.annotate(
        text, (point.time, point.error), (cx - x, cy - y), textcoords="offset points", ha="center",
        va="center", fontsize=SMALL, color=colour, zorder=6,
    )  # fmt: skip


def _line_of(ax: Axes, level: Level) -> Box:
    """A thin line as a box."""
    left, low, right, top = _frame(ax)
    flat = level.axis == ERROR
    place = Point("", "", *((1.0, level.value) if flat else (level.value, 1.0)))
    x, y = _pixels(ax, [place])[0]
    return (left, y - 1, right, y + 1) if flat else (x - 1, low, x + 1, top)


def _name_level(ax: Axes, level: Level, taken: list[Box], lines: Sequence[Box]) -> None:
    """The name of a thin line, along it, where it hides least."""
    left, low, right, top = _frame(ax)
    long, high = 0.57 * SMALL * len(level.label), SMALL + 1.0
    flat = level.axis == ERROR
    corner = ax.get_xlim()[0], ax.get_ylim()[0]
    place = Point("", "", *((corner[0], level.value) if flat else (level.value, corner[1])))
    x, y = _pixels(ax, [place])[0]
    ends = (right - long - 3, left + 3) if flat else (top - long - 3, low + 3)
    along = np.linspace(*ends, 25)
    boxes = [
        (at, y + aside, at + long, y + aside + high) if flat else (x + aside, at, x + aside + high, at + long)
        for aside in (1.5, -high - 1.5)
        for at in along
    ]
    box = min(boxes, key=lambda b: sum(_overlap(b, other) for other in (*taken, *lines)))
    taken.append(box)
    ax.annotate(
        level.label, (place.time, place.error), (box[0] - x, box[1] - y), textcoords="offset points",
        rotation=0 if flat else 90, va="bottom", fontsize=SMALL, color=MUTED, zorder=4,
    )  # fmt: skip


def _cost(box: Box, ax: Axes, taken: Sequence[Box]) -> float:
    left, low, right, top = _frame(ax)
    outside = box[0] < left or box[2] > right or box[1] < low or box[3] > top
    return sum(_overlap(box, other) for other in taken) + 1e3 * outside


def _away(box: Box, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of places (N, 2) from a box."""
    low, high = np.array(box[:2]), np.array(box[2:])
    return np.linalg.norm(np.maximum(np.maximum(low - places, places - high), 0.0), axis=1)


def _overlap(one: Box, other: Box) -> float:
    """Common area."""
    wide = min(one[2], other[2]) - max(one[0], other[0])
    high = min(one[3], other[3]) - max(one[1], other[1])
    return max(wide, 0.0) * max(high, 0.0)
