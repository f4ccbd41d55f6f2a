"""Deformed layers of several stages on one sheet, as in Hambleton et al., Figure 8."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

from ploughval.report.figures.layers import Extent, Side, draw_side
from ploughval.report.figures.look import narrow
from ploughval.report.figures.style import WIDTH_IN, new_figure, styled

_MOST_COLUMNS = 2
_MARGIN_IN = 0.45  # of a column, for numbers and label at its left


@dataclass(frozen=True, slots=True)
class Stage:
    """Both sides of a test at a displacement of the blade.

    Attributes
    ----------
    u_mm : float, mm
        The displacement.
    predicted, measured : Side
        What either side shows then.
    """

    u_mm: float
    predicted: Side
    measured: Side


@styled
def stages_figure(
    stages: Sequence[Stage], *, depth_mm: float, extent: Extent, thickness_mm: float = 5.0
) -> Figure:
    """Predicted above measured at every stage, all on the same axes; stages follow each other like text.

    Parameters
    ----------
    stages : sequence of Stage
        In the order of travel, one at least.
    depth_mm, thickness_mm : float, mm
        Depth and thickness of the blade.
    extent : tuple of float, mm
        x0, x1, y0, y1: part of the world that is shown.
    """
    x0, x1, y0, y1 = extent
    columns = 1 if narrow() else min(_MOST_COLUMNS, len(stages))
    lines = -(-len(stages) // columns)
    panel = (WIDTH_IN / columns - _MARGIN_IN) * (y1 - y0) / (x1 - x0)
    figure = new_figure(picture_in=2 * lines * panel, text_in=2 * lines * 0.33 + 0.4)
    grid = figure.subplots(2 * lines, columns, sharex=True, sharey=True, squeeze=False)
    for place, one in enumerate(stages):
        row, column = 2 * (place // columns), place % columns
        for axes, side, name in (
            (grid[row, column], one.predicted, "predicted"),
            (grid[row + 1, column], one.measured, "measured"),
        ):
            draw_side(axes, side, name, u_mm=one.u_mm, extent=extent, thickness_mm=thickness_mm)
        grid[row, column].set_title(f"u = {one.u_mm:.1f} mm = {one.u_mm / depth_mm:.2f} d", loc="left", pad=3)
    for place in range(len(stages), lines * columns):
        for row in (0, 1):
            grid[2 * (place // columns) + row, place % columns].set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("x, mm")
    for axes in grid[:, 0]:
        axes.set_ylabel("y, mm")
    return figure
