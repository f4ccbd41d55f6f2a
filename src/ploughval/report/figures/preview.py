"""What `ploughval check` shows: the first photograph with what was understood of it."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke
from numpy.typing import ArrayLike, NDArray

from ploughval.report.figures.style import SERIES, new_figure, styled
from ploughval.report.photographs import ToPixels, eight_bit

_HALO = [Stroke(linewidth=3.2, foreground="#ffffff", alpha=0.8), Normal()]
_SURFACE, _POINTS, _TIP, _AXES = "#e69f00", "#f0e442", "#d55d00", "#cc79a7"


@styled
def preview_figure(
    image: ArrayLike,
    calibration: ToPixels,
    points_px: ArrayLike,
    layers: Sequence[float] = (),
    surface: ArrayLike | None = None,
    tip: ArrayLike | None = None,
    *,
    sand: ArrayLike | None = None,
    extent_x_mm: float = 100.0,
) -> Figure:
    """The first photograph with sand outline, points, layers, free surface, tip and world axes over it.

    Parameters
    ----------
    image : (H, W) uint8 or uint16
        The first photograph.
    calibration : Calibration
        Only ``to_px`` is used.
    points_px : (N, 2) float, px
        Points that will be tracked.
    layers : sequence of float, mm
        Heights above the tip.
    surface : (M, 2) float, mm, or None
        Free surface in world coordinates.
    tip : (2,) float, px, or None
        Blade face at tip level; None: where the calibration puts the origin.
    sand : (H, W) bool or None
        Its outline is drawn.
    extent_x_mm : float, mm
        How far ahead of the blade layers are drawn.
    """
    grey = np.asarray(image)
    height, width = grey.shape[:2]
    figure = new_figure(max(2.5, 9.0 * height / width + 0.8), width_in=9.0)
    axes = figure.subplots()
    step = max(1, width // 1600)
    axes.imshow(
        eight_bit(grey)[::step, ::step],
        cmap="gray",
        vmin=0,
        vmax=255,
        extent=(-0.5, width - 0.5, height - 0.5, -0.5),
    )
    if sand is not None:
        axes.contour(np.asarray(sand, float), levels=[0.5], colors=[SERIES[2]], linewidths=1.6)
        axes.plot([], [], color=SERIES[2], label="sand, air and blade apart")
    points = np.asarray(points_px, float).reshape(-1, 2)
    axes.plot(
        points[:, 0], points[:, 1], "+", ms=4, mew=1.1, color=_POINTS, label=f"{len(points)} points to track"
    )
    _material_lines(axes, calibration, layers, surface, extent_x_mm)
    _origin(axes, calibration, tip, extent_x_mm)
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="x, px", ylabel="y, px")
    axes.grid(visible=False)
    figure.legend(loc="outside upper center", ncols=5)
    return figure


def _material_lines(
    axes: Axes, calibration: ToPixels, layers: Sequence[float], surface: ArrayLike | None, extent_x_mm: float
) -> None:
    label: str | None = "layers"
    for height in layers:
        line = calibration.to_px(np.column_stack([np.linspace(0, extent_x_mm, 80), np.full(80, height)]))
        axes.plot(line[:, 0], line[:, 1], color=SERIES[0], lw=1.2, path_effects=_HALO, label=label)
        axes.annotate(f"{height:g}", line[-1], fontsize=8, color=SERIES[0], path_effects=_HALO)
        label = None
    if surface is not None:
        line = calibration.to_px(np.asarray(surface, float).reshape(-1, 2))
        axes.plot(line[:, 0], line[:, 1], color=_SURFACE, lw=1.6, label="free surface")


def _origin(axes: Axes, calibration: ToPixels, tip: ArrayLike | None, extent_x_mm: float) -> None:
    """World axes, a quarter of the extent long, and the tip."""
    arm = extent_x_mm / 4
    ends: NDArray[np.float64] = calibration.to_px(np.array([[0.0, 0.0], [arm, 0.0], [0.0, arm]]))
    for end, name in ((ends[1], f"x {arm:g} mm"), (ends[2], f"y {arm:g} mm")):
        axes.annotate("", end, xytext=ends[0], arrowprops={"arrowstyle": "->", "color": _AXES, "lw": 2})
        axes.annotate(name, end, fontsize=9, color=_AXES, path_effects=_HALO)
    place = ends[0] if tip is None else np.asarray(tip, float)
    axes.plot([place[0]], [place[1]], "P", color=_TIP, ms=9, mec="#ffffff", label="tip of the blade")
