"""Maximum shear strain of an increment above, since the start below, with band, blade and surface."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ploughval.report.figures.field import COLOURS
from ploughval.report.figures.layers import Extent, draw_blade
from ploughval.report.figures.style import INK, MODEL, STAGE_WIDTH_IN, new_figure, styled

_TOP_SHARE = 0.99  # of the nodes: the colours end there


@dataclass(frozen=True, slots=True, eq=False)
class ShearMap:
    """Maximum shear strain on a grid.

    ``values`` (rows, columns), 1, row 0 lowest, NaN where it is not known; ``extent`` x0, x1, y0, y1, mm;
    ``floor`` typical noise floor, 1.
    """

    values: NDArray[np.float64]
    extent: Extent
    floor: float


@dataclass(frozen=True, slots=True)
class Band:
    """A measured band of an increment: x of the tip half-way, inclination and x of the outcrop."""

    tip_mm: float
    beta_deg: float
    outcrop_x_mm: float


@styled
def shear_figure(
    maps: tuple[ShearMap, ShearMap],
    *,
    u_mm: tuple[float, float],
    extent: Extent,
    surface: pd.DataFrame | None = None,
    band: Band | None = None,
    thickness_mm: float = 5.0,
) -> Figure:
    """Both maps of one stage on the same axes.

    Parameters
    ----------
    maps : pair of ShearMap
        Of the increment, and since the start.
    u_mm : (float, float), mm
        Blade displacement at the increment's start and end.
    extent : tuple of float, mm
        Part of the world that is shown: x0, x1, y0, y1.
    surface : DataFrame (x_mm, y_mm) or None
        Free surface at the end.
    band : Band or None
        Measured in the increment.
    thickness_mm : float, mm
        Thickness of the blade.
    """
    x0, x1, y0, y1 = extent
    panel = min(4.5 * (y1 - y0) / (x1 - x0), 4.0)
    figure = new_figure(0.5 + 2 * (panel + 0.85), width_in=STAGE_WIDTH_IN)
    for axes, shown, text in zip(
        figure.subplots(2, 1),
        maps,
        (f"from u = {u_mm[0]:.1f} mm to {u_mm[1]:.1f} mm", f"from the start to u = {u_mm[1]:.1f} mm"),
        strict=True,
    ):
        _panel(figure, axes, shown)
        if surface is not None:
            axes.plot(surface["x_mm"], surface["y_mm"], color=INK, lw=1)
        if band is not None:
            _line(axes, band)
        draw_blade(axes, u_mm[1], extent, thickness_mm)
        axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xlabel="x, mm", ylabel="y, mm")
        axes.grid(visible=False)
        axes.set_title(text, loc="left")
    return figure


def _panel(figure: Figure, axes: Axes, shown: ShearMap) -> None:
    known = shown.values[np.isfinite(shown.values)]
    top = float(np.quantile(known, _TOP_SHARE)) if known.size else 1.0
    image = axes.imshow(
        shown.values, extent=shown.extent, origin="lower", cmap=COLOURS, vmin=0.0, vmax=top,
        interpolation="nearest",
    )  # fmt: skip
    bar = figure.colorbar(image, ax=axes, orientation="horizontal", aspect=45, pad=0.02, extend="max")
    bar.set_label("maximum shear strain, 1")


def _line(axes: Axes, band: Band) -> None:
    x = np.array([band.tip_mm, band.outcrop_x_mm])
    y = (x - band.tip_mm) * np.tan(np.radians(band.beta_deg))
    axes.plot(x, y, color=MODEL, lw=1.3, ls=(0, (5, 2)), zorder=5)
    axes.plot(x[1:], y[1:], "o", color=MODEL, ms=4, zorder=6)
