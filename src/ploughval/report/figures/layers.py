"""Deformed tracer layers of one stage: predicted above, measured below (as the paper's Figure 8)."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import Normal, Stroke
from numpy.typing import NDArray

from ploughval.report.figures.differences import (
    ON_COLOUR,
    Differences,
    coarsened,
    difference_bar,
    draw_differences,
)
from ploughval.report.figures.style import (
    INK,
    MEASURED,
    MODEL,
    MUTED,
    ON_PHOTO_HALO,
    ON_PHOTO_MEASURED,
    ON_PHOTO_MODEL,
    SAND,
    STAGE_WIDTH_IN,
    STEEL,
    new_figure,
    styled,
)

Extent = tuple[float, float, float, float]
Points = NDArray[np.float64]
_BAND_DASH = (0, (6, 1.5, 1, 1.5))


@dataclass(frozen=True, slots=True)
class Picture:
    """A photograph in world millimetres.

    Attributes
    ----------
    grey : (H, W) uint8
        Row 0 on top.
    extent : tuple of float, mm
        x0, x1, y0, y1.
    """

    grey: NDArray[np.uint8]
    extent: Extent


@dataclass(frozen=True, slots=True)
class Side:
    """What one panel shows at one stage, None where there is none.

    Attributes
    ----------
    layers : DataFrame of LAYER_COLUMNS or None
        Cut to the stage.
    surface : DataFrame of SURFACE_COLUMNS or None
        Cut to the stage.
    outcrops_mm : (K, 2) float or None, mm
        Where the bands that slip then meet the surface.
    picture : Picture or None
        The photograph behind them.
    """

    layers: pd.DataFrame | None = None
    surface: pd.DataFrame | None = None
    outcrops_mm: Points | None = None
    picture: Picture | None = None

    @property
    def empty(self) -> bool:
        """Whether there is nothing to draw."""
        return all(part is None or not len(part) for part in (self.layers, self.surface)) and not self.picture


@styled
def layers_figure(
    predicted: Side,
    measured: Side,
    *,
    u_mm: float,
    depth_mm: float,
    extent: Extent,
    thickness_mm: float = 5.0,
    differences: Differences | None = None,
) -> Figure:
    """One stage: the panels that have something to show, on the same axes.

    Parameters
    ----------
    predicted, measured : Side
        What either panel shows; an empty side has no panel.
    u_mm : float, mm
        Displacement of the blade at this stage.
    depth_mm, thickness_mm : float, mm
        Depth and thickness of the blade.
    extent : tuple of float, mm
        x0, x1, y0, y1: part of the world that is shown.
    differences : Differences or None
        Colours of the measured lines by their distance from the predicted ones.
    """
    sides = [(s, t) for s, t in ((predicted, "predicted"), (measured, "measured")) if not s.empty]
    x0, x1, y0, y1 = extent
    panel = 4.6 * (y1 - y0) / (x1 - x0)
    bar = 0.55 if differences is not None else 0.0
    count = max(len(sides), 1)
    figure = new_figure(
        text_in=0.75 + bar + 0.3 * count, picture_in=count * min(panel, 4.0), width_in=STAGE_WIDTH_IN
    )
    grid = figure.subplots(max(len(sides), 1), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (side, title) in zip(grid, sides, strict=False):
        measured_side = title == "measured"
        other, colours = (predicted, differences) if measured_side else (None, None)
        draw_side(
            axes, side, title, u_mm=u_mm, extent=extent, thickness_mm=thickness_mm, other=other,
            differences=colours,
        )  # fmt: skip
        axes.set_ylabel("y, mm")
    figure.suptitle(f"u = {u_mm:.1f} mm = {u_mm / depth_mm:.2f} d", fontsize=11, x=0.02, ha="left")
    grid[-1].set_xlabel("x, mm")
    if differences is not None:
        difference_bar(figure, list(grid), differences)
    return figure


def draw_side(
    axes: Axes,
    side: Side,
    title: str,
    *,
    u_mm: float,
    extent: Extent,
    thickness_mm: float,
    other: Side | None = None,
    differences: Differences | None = None,
) -> None:
    """One panel of a stage: sand or photograph, layers, surface, bands and blade.

    Parameters
    ----------
    axes : Axes
        Drawn on.
    side : Side
        What the panel shows.
    title : str
        "predicted" or "measured".
    u_mm, thickness_mm : float, mm
        Displacement and thickness of the blade.
    extent : tuple of float, mm
        x0, x1, y0, y1: part of the world that is shown.
    other : Side or None
        The other side, whose layers are dashed over this one's.
    differences : Differences or None
        Colours of the lines by their distance from the other side's.
    """
    on_photo = side.picture is not None
    _panel(axes, side, title, other, differences)
    draw_blade(axes, u_mm, extent, thickness_mm, outline=on_photo)
    plain = ON_COLOUR if on_photo else INK
    ink = MODEL if title == "predicted" else MEASURED if differences is None else plain
    for outcrop in () if side.outcrops_mm is None else side.outcrops_mm:
        _band(axes, outcrop, u_mm, ink, on_photo)
    axes.set(xlim=extent[:2], ylim=extent[2:], aspect="equal")
    axes.grid(visible=False)


def stage(table: pd.DataFrame | None, frame: int) -> pd.DataFrame | None:
    """Rows of one frame, or None without any."""
    if table is None:
        return None
    rows = table[table["frame"] == frame]
    return rows if len(rows) else None


def _panel(axes: Axes, side: Side, title: str, other: Side | None, differences: Differences | None) -> None:
    on_photo = side.picture is not None
    if side.picture is not None:
        axes.imshow(side.picture.grey, extent=side.picture.extent, cmap="gray", vmin=0, vmax=255, zorder=0)
    elif side.surface is not None:
        axes.fill_between(side.surface["x_mm"], side.surface["y_mm"], -1e4, color=SAND, lw=0, zorder=0)
    colour, over = (MODEL, ON_PHOTO_MODEL) if title == "predicted" else (MEASURED, ON_PHOTO_MEASURED)
    if side.surface is not None:
        ink = ON_PHOTO_HALO if on_photo else INK
        axes.plot(side.surface["x_mm"], side.surface["y_mm"], color=ink, lw=1.1, zorder=3)
    if differences is not None:
        draw_differences(axes, differences, on_photo=on_photo)
    if other is not None and other.layers is not None:
        plain = (ON_PHOTO_MODEL, MODEL) if differences is None else (ON_COLOUR, INK)
        _lines(axes, other.layers, plain[0 if on_photo else 1], 1.0, "--", halo=on_photo)
    if side.layers is not None and differences is None:
        _lines(axes, side.layers, over if on_photo else colour, 1.6, "-", halo=on_photo)
    text = title if other is None or other.layers is None else "measured (dashed: predicted)"
    axes.set_title(text, loc="right", pad=3)  # beside the heap, which would be hidden within the panel


def _lines(axes: Axes, layers: pd.DataFrame, colour: str, width: float, dash: str, *, halo: bool) -> None:
    effects = (
        [Stroke(linewidth=width + 1.6, foreground=ON_PHOTO_HALO, alpha=0.85), Normal()] if halo else None
    )
    for (source, _height), line in layers.groupby(["source", "layer"], sort=True):
        style = (0, (1, 1)) if source == "dye" else dash
        x, y = coarsened(line[["x_mm", "y_mm"]].to_numpy(float)).T
        axes.plot(x, y, color=colour, lw=width, ls=style, path_effects=effects, zorder=4)


def draw_blade(
    axes: Axes, u_mm: float, extent: Extent, thickness_mm: float, *, outline: bool = False
) -> None:
    """The blade as a plate: its face at u, its tip at y = 0; over a photograph its outline alone."""
    height = extent[3] - min(0.0, extent[2])
    axes.add_patch(
        Rectangle(
            (u_mm - thickness_mm, 0),
            thickness_mm,
            height,
            facecolor="none" if outline else STEEL,
            edgecolor=ON_PHOTO_HALO if outline else INK,
            lw=1.2 if outline else 0.8,
            zorder=6,
        )
    )


def _band(axes: Axes, outcrop_mm: Points, u_mm: float, colour: str, on_photo: bool) -> None:
    """From the tip to the outcrop."""
    effects = [Stroke(linewidth=4.5, foreground=ON_PHOTO_HALO, alpha=0.6), Normal()] if on_photo else None
    x, y = outcrop_mm
    axes.plot([u_mm, x], [0, y], color=colour, lw=2.4, ls=_BAND_DASH, path_effects=effects, zorder=5)
    axes.plot([x], [y], "o", color=colour, ms=5, mec=MUTED, zorder=6)
