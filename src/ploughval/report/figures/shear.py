"""Maximum shear strain of an increment above, since the start below, with band, blade and surface."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from ploughval.report.figures.field import COLOURS
from ploughval.report.figures.layers import Extent, draw_blade
from ploughval.report.figures.look import small_pt
from ploughval.report.figures.style import INK, MODEL, MUTED, STAGE_WIDTH_IN, new_figure, styled
from ploughval.report.text import number

_TOP_SHARE = 0.99  # of the nodes: the colours end there


@dataclass(frozen=True, slots=True, eq=False)
class ShearMap:
    """Maximum shear strain on a grid.

    ``values`` (rows, columns), 1, row 0 lowest, NaN where it is not known; ``extent`` x0, x1, y0, y1, mm;
    ``floor`` typical noise floor, 1; ``gauge_mm`` diameter of the circle over which strain is taken.
    """

    values: NDArray[np.float64]
    extent: Extent
    floor: float
    gauge_mm: float

    @property
    def top(self) -> float:
        """Where colours end, when the map stands alone; NaN without a known value."""
        return highest([self])


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
    tops: tuple[float, float] | None = None,
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
    tops : (float, float), 1, or None
        Strains at which the colours of either map end, so that stages compare; None: each map's own.
    surface : DataFrame (x_mm, y_mm) or None
        Free surface at the end.
    band : Band or None
        Measured in the increment.
    thickness_mm : float, mm
        Thickness of the blade.
    """
    x0, x1, y0, y1 = extent
    panel = min(4.7 * (y1 - y0) / (x1 - x0), 4.0)
    figure = new_figure(text_in=0.7 + 2 * 0.95, picture_in=2 * panel, width_in=STAGE_WIDTH_IN)
    for axes, shown, top, text in zip(
        figure.subplots(2, 1),
        maps,
        (maps[0].top, maps[1].top) if tops is None else tops,
        (f"u from {u_mm[0]:.1f} to {u_mm[1]:.1f} mm", f"u from 0 to {u_mm[1]:.1f} mm"),
        strict=True,
    ):
        _panel(figure, axes, shown, top)
        _gauge(axes, shown.gauge_mm, extent)
        if surface is not None:
            axes.plot(surface["x_mm"], surface["y_mm"], color=INK, lw=1)
        if band is not None:
            _line(axes, band)
        draw_blade(axes, u_mm[1], extent, thickness_mm)
        axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xlabel="x, mm", ylabel="y, mm")
        axes.grid(visible=False)
        axes.set_title(f"{text}; noise floor {number(shown.floor, 2)}", loc="left")
    return figure


def highest(maps: Sequence[ShearMap]) -> float:
    """Strain below which 99 % of the nodes of some maps lie; NaN without a known value."""
    known = np.concatenate([shown.values[np.isfinite(shown.values)] for shown in maps] or [np.empty(0)])
    return float(np.quantile(known, _TOP_SHARE)) if known.size else np.nan


def _panel(figure: Figure, axes: Axes, shown: ShearMap, top: float) -> None:
    image = axes.imshow(
        shown.values, extent=shown.extent, origin="lower", cmap=COLOURS, vmin=0.0,
        vmax=top if np.isfinite(top) and top > 0 else 1.0, interpolation="nearest",
    )  # fmt: skip
    bar = figure.colorbar(image, ax=axes, orientation="horizontal", aspect=45, pad=0.02, extend="max")
    bar.set_label(f"maximum shear strain over {number(shown.gauge_mm, 3)} mm")


def _gauge(axes: Axes, gauge_mm: float, extent: Extent) -> None:
    """The circle over which strain is taken, to scale, in the air at the upper right."""
    x, y = extent[1] - gauge_mm, extent[3] - gauge_mm
    axes.add_patch(Circle((x, y), gauge_mm / 2, facecolor="none", edgecolor=MUTED, lw=0.9, zorder=7))
    axes.annotate(
        "gauge", (x - gauge_mm / 2, y), xytext=(-3, 0), textcoords="offset points",
        ha="right", va="center", fontsize=small_pt(), zorder=7,
    )  # fmt: skip


def _line(axes: Axes, band: Band) -> None:
    x = np.array([band.tip_mm, band.outcrop_x_mm])
    y = (x - band.tip_mm) * np.tan(np.radians(band.beta_deg))
    axes.plot(x, y, color=MODEL, lw=1.3, ls=(0, (5, 2)), zorder=5)
    axes.plot(x[1:], y[1:], "o", color=MODEL, ms=4, zorder=6)
