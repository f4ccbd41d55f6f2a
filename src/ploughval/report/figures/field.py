"""Displacement field between two photographs, as coloured points with a few arrows."""

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ploughval.report.figures.layers import Extent, draw_blade
from ploughval.report.figures.style import INK, STAGE_WIDTH_IN, new_figure, styled

Points = NDArray[np.float64]
MOST_VECTOR_POINTS = 300
MOST_ARROWS = 140
# Without the darkest part, which would vanish on a dark page.
COLOURS = LinearSegmentedColormap.from_list("sand", colormaps["cividis"](np.linspace(0.25, 1.0, 64)))


def increment(tracks: xr.Dataset, before: int, after: int) -> tuple[Points, Points]:
    """Positions and displacements of the points measured in both of two rows of the tracks.

    Returns
    -------
    position : (N, 2) float, mm
        At the later row.
    displacement : (N, 2) float, mm
    """
    position = np.stack([tracks["x_mm"].to_numpy(), tracks["y_mm"].to_numpy()], axis=-1)
    moved = position[after] - position[before]
    good = np.isfinite(moved).all(axis=1)
    return position[after][good], moved[good]


@styled
def field_figure(
    tracks: xr.Dataset,
    before: int,
    after: int,
    *,
    extent: Extent,
    surface: pd.DataFrame | None = None,
    thickness_mm: float = 5.0,
) -> Figure:
    """How far the sand moved for a millimetre of the blade, between two rows of the tracks.

    Parameters
    ----------
    tracks : Dataset
        As in tracks.nc.
    before, after : int
        Rows along ``frame``.
    extent : tuple of float, mm
        Part of the world that is shown: x0, x1, y0, y1.
    surface : DataFrame (x_mm, y_mm) or None
        Free surface at the later frame.
    thickness_mm : float, mm
        Thickness of the blade.
    """
    position, moved = increment(tracks, before, after)
    u = tracks["u_mm"].to_numpy()
    du = float(u[after] - u[before])
    rate = moved / du
    x0, x1, y0, y1 = extent
    panel = min(4.5 * (y1 - y0) / (x1 - x0), 4.0)
    figure = new_figure(text_in=1.15, picture_in=panel, width_in=STAGE_WIDTH_IN)
    axes = figure.subplots()
    size = np.hypot(rate[:, 0], rate[:, 1])
    points = axes.scatter(
        position[:, 0], position[:, 1], c=size, s=9, cmap=COLOURS, vmin=0, vmax=1.25, lw=0,
        rasterized=len(size) > MOST_VECTOR_POINTS,
    )  # fmt: skip
    _arrows(axes, position, rate, size)
    if surface is not None:
        axes.plot(surface["x_mm"], surface["y_mm"], color=INK, lw=1)
    draw_blade(axes, float(u[after]), extent, thickness_mm)
    axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xlabel="x, mm", ylabel="y, mm")
    axes.grid(visible=False)
    bar = figure.colorbar(points, ax=axes, orientation="horizontal", aspect=45, pad=0.02, extend="max")
    bar.set_label("displacement of the sand / displacement of the blade")
    figure.suptitle(f"from u = {u[before]:.1f} mm to {u[after]:.1f} mm", fontsize=11, x=0.02, ha="left")
    return figure


def _arrows(axes: Axes, position: Points, rate: Points, size: NDArray[np.float64]) -> None:
    moving = np.flatnonzero(size > 0.2)
    chosen = moving[:: max(1, -(-len(moving) // MOST_ARROWS))]
    if len(chosen):
        axes.quiver(
            position[chosen, 0], position[chosen, 1], rate[chosen, 0], rate[chosen, 1],
            color=INK, angles="xy", scale_units="xy", scale=0.28, width=0.0022,
        )  # fmt: skip
