"""What `ploughval check` shows: the first photograph with what was understood of it."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ploughval.axes import Region
from ploughval.report.figures.look import legend_outside
from ploughval.report.figures.style import SERIES, new_figure, styled
from ploughval.report.grey import ToPixels, eight_bit

Floats = NDArray[np.float64]

_HALO = [Stroke(linewidth=3.2, foreground="#ffffff", alpha=0.8), Normal()]
_ARROWS = "#39d353"
_SURFACE, _POINTS, _TIP, _AXES, _GONE = "#e69f00", "#f0e442", "#d55d00", "#cc79a7", "#c00000"
_TINTS = {  # region: name, colour, opacity
    Region.AIR: ("air", "#56b4e9", 0.22),
    Region.BLADE: ("blade", "#d55e00", 0.45),
    Region.TRENCH: ("behind the blade", "#cc79a7", 0.28),
    Region.OUTSIDE: ("outside", "#1b1f23", 0.6),
}
_SHOWN_PX = 1600  # columns of the photograph that are drawn
_ARROW_SHARE = 0.04  # of the picture's width, for the longest arrow
_MOST_ARROWS = 250
_LEAST_RESIDUAL_PX = 0.005  # smaller ones are not drawn
_TICKS = 6
_TICKED = 0.97  # of an axis, for a number beyond would be cut


def _none() -> Floats:
    return np.empty((0, 2))


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """What is drawn over the first photograph; what is not there is left out.

    Attributes
    ----------
    image : (H, W) uint8 or uint16
    calibration : ToPixels or None
        Only ``to_px`` is used.
    regions : (H, W) uint8 or None
        Codes of :class:`ploughval.axes.Region`.
    points_px : (N, 2) float, px
        Points that will be tracked.
    tracked_px, moved_px : (K, 2) float, px
        Those that were correlated, and their displacement, NaN where it is not valid.
    layers_mm : sequence of float
        Heights above the tip.
    surface_mm : (M, 2) float, mm, or None
    tip_px : (2,) float, px, or None
        None: where the calibration puts the origin.
    fitted_px, residual_px : (K, 2) float, px
        Control points, or points of a board, and projected minus given.
    given_px : (K, 2) float, px
        Control points as they were given, where no calibration came of them.
    markers_px, missing_px : (K, 2) float, px
        Painted markers that were found; places at which none was.
    extent_x_mm : float
        How far ahead of the blade layers and axes are drawn.
    """

    image: NDArray[np.generic]
    calibration: ToPixels | None = None
    regions: NDArray[np.uint8] | None = None
    points_px: Floats = field(default_factory=_none)
    tracked_px: Floats = field(default_factory=_none)
    moved_px: Floats = field(default_factory=_none)
    layers_mm: Sequence[float] = ()
    surface_mm: Floats | None = None
    tip_px: Floats | None = None
    fitted_px: Floats = field(default_factory=_none)
    residual_px: Floats = field(default_factory=_none)
    given_px: Floats = field(default_factory=_none)
    markers_px: Floats = field(default_factory=_none)
    missing_px: Floats = field(default_factory=_none)
    extent_x_mm: float = 100.0


@styled
def preview_figure(shown: Shown) -> Figure:
    """The first photograph with regions, points, layers, surface, tip, axes and calibration over it.

    Parameters
    ----------
    shown : Shown
        The photograph and what was found in it.
    """
    grey = np.asarray(shown.image)
    height, width = grey.shape[:2]
    figure = new_figure(max(2.5, 9.0 * height / width + 1.4), width_in=9.0)
    axes = figure.subplots()
    step = max(1, width // _SHOWN_PX)
    extent = (-0.5, width - 0.5, height - 0.5, -0.5)
    axes.imshow(eight_bit(grey)[::step, ::step], cmap="gray", vmin=0, vmax=255, extent=extent)
    if shown.regions is not None:
        _tint(axes, shown.regions[::step, ::step], extent)
    _tracked(axes, shown, width)
    if shown.calibration is not None:
        _material_lines(axes, shown.calibration, shown)
        _world(axes, shown.calibration, shown, (height, width))
    _tip(axes, shown)
    _calibrated(axes, shown, width)
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="x, px", ylabel="y, px")
    axes.grid(visible=False)
    legend_outside(figure, *axes.get_legend_handles_labels(), columns=4)
    return figure


def _tint(axes: Axes, regions: NDArray[np.uint8], extent: tuple[float, float, float, float]) -> None:
    """Everything that is not sand, tinted; the border of the sand."""
    tint = np.zeros((*regions.shape, 4))
    for region, (name, colour, opacity) in _TINTS.items():
        there = regions == region
        if there.any():
            rgb = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
            tint[there] = [*rgb, opacity]
            axes.plot([], [], "s", ms=8, color=rgb, alpha=min(1.0, 2 * opacity), label=name)
    axes.imshow(tint, extent=extent, interpolation="nearest")
    sand = (regions == Region.SAND).astype(float)
    if 0 < sand.mean() < 1:
        rows, columns = regions.shape
        x = extent[0] + (np.arange(columns) + 0.5) * (extent[1] - extent[0]) / columns
        y = extent[3] + (np.arange(rows) + 0.5) * (extent[2] - extent[3]) / rows
        axes.contour(x, y, sand, levels=[0.5], colors=[SERIES[2]], linewidths=1.4)
        axes.plot([], [], color=SERIES[2], label="border of the sand")


def _tracked(axes: Axes, shown: Shown, width: int) -> None:
    """Points, those of them that were lost between the first photographs, and how far the others went."""
    points = shown.points_px
    if not len(points):
        return
    label = f"{len(points)} points to track"
    axes.plot(points[:, 0], points[:, 1], "+", ms=4, mew=1.1, color=_POINTS, ls="none", label=label)
    valid = np.asarray(np.isfinite(shown.moved_px).all(axis=1), bool)
    kept, lost, moved = shown.tracked_px[valid], shown.tracked_px[~valid], shown.moved_px[valid]
    if len(lost):
        label = f"{len(lost)} of {len(valid)} lost at once"
        axes.plot(lost[:, 0], lost[:, 1], "x", ms=4, mew=1.1, color=_GONE, ls="none", label=label)
    longest = float(np.hypot(*moved.T).max(initial=0.0))
    if longest > 0:
        times = _nice(_ARROW_SHARE * width / longest)
        few = slice(None, None, -(-len(kept) // _MOST_ARROWS))
        axes.quiver(
            *kept[few].T, *(times * moved[few]).T, angles="xy", scale_units="xy", scale=1.0, width=0.0012,
            color=_ARROWS, label=f"first displacement, times {times:g}",
        )  # fmt: skip


def _nice(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above a value; at least 1."""
    if value <= 1:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step * power for step in (1, 2, 5) if step * power <= value))


def _material_lines(axes: Axes, calibration: ToPixels, shown: Shown) -> None:
    label: str | None = "layers, mm above the tip"
    for height in shown.layers_mm:
        x_mm = np.linspace(0, shown.extent_x_mm, 80)
        line = calibration.to_px(np.column_stack([x_mm, np.full(80, height)]))
        axes.plot(line[:, 0], line[:, 1], color=SERIES[0], lw=1.2, path_effects=_HALO, label=label)
        beside = line[4]
        axes.annotate(
            f"{height:g}", beside, fontsize=8, color=SERIES[0], path_effects=_HALO, va="center", clip_on=True
        )
        label = None
    if shown.surface_mm is not None and len(shown.surface_mm):
        line = calibration.to_px(np.asarray(shown.surface_mm, float).reshape(-1, 2))
        axes.plot(line[:, 0], line[:, 1], color=_SURFACE, lw=1.6, label="free surface")


def _world(axes: Axes, calibration: ToPixels, shown: Shown, shape: tuple[int, int]) -> None:
    """World axes through the tip, with ticks in mm as far as the photograph goes."""
    height, width = shape
    reach = shown.extent_x_mm
    for unit, name in ((np.array([1.0, 0.0]), "x"), (np.array([0.0, 1.0]), "y")):
        along = np.linspace(0.0, reach, 400)
        line = calibration.to_px(along[:, None] * unit)
        inside = np.all((line >= -0.5) & (line <= [width - 0.5, height - 0.5]), axis=1)
        if inside.sum() < 2:
            continue
        far = float(along[inside].max())
        shown_line = line[inside]
        axes.plot(shown_line[:, 0], shown_line[:, 1], color=_AXES, lw=1.8)
        ticks = [
            t
            for t in MaxNLocator(_TICKS, steps=[1, 2, 5, 10]).tick_values(0.0, far)
            if 0 < t <= _TICKED * far
        ]
        across = np.array([0.0, -1.0]) if name == "x" else np.array([-1.0, 0.0])
        size = 0.006 * reach
        for tick in ticks:
            ends = calibration.to_px(np.stack([tick * unit - size * across, tick * unit + size * across]))
            axes.plot(ends[:, 0], ends[:, 1], color=_AXES, lw=1.4)
            x, y = calibration.to_px(tick * unit + 2.2 * size * across)
            axes.annotate(
                f"{tick:g}", (x, y), fontsize=8, color=_AXES,
                path_effects=_HALO, ha="center", va="center", clip_on=True,
            )  # fmt: skip
    axes.plot([], [], color=_AXES, label="world axes, mm")


def _tip(axes: Axes, shown: Shown) -> None:
    if shown.tip_px is not None:
        place = np.asarray(shown.tip_px, float)
    elif shown.calibration is not None:
        place = shown.calibration.to_px(np.zeros(2))
    else:
        return
    axes.plot(
        [place[0]], [place[1]], "P", color=_TIP, ms=9, mec="#ffffff", ls="none", label="tip of the blade"
    )


def _calibrated(axes: Axes, shown: Shown, width: int) -> None:
    """Points of the calibration with their residuals, and painted markers."""
    if len(shown.fitted_px):
        x, y = shown.fitted_px.T
        label = f"{len(x)} points of the calibration"
        axes.plot(x, y, "o", ms=6, mfc="none", mec=SERIES[3], mew=1.3, ls="none", label=label)
        longest = float(np.hypot(*shown.residual_px.T).max(initial=0.0))
        if longest > _LEAST_RESIDUAL_PX:
            times = _nice(_ARROW_SHARE * width / longest)
            axes.quiver(
                x, y, *(times * shown.residual_px).T, angles="xy", scale_units="xy", scale=1.0, width=0.0016,
                color=SERIES[3], label=f"their residuals, times {times:g}",
            )  # fmt: skip
    if len(shown.given_px):
        x, y = shown.given_px.T
        label = f"control points as given: {len(x)}"
        axes.plot(x, y, "D", ms=6, mfc="none", mec=_GONE, mew=1.4, ls="none", label=label)
        for number, place in enumerate(shown.given_px):
            axes.annotate(
                f" {number}", tuple(place), fontsize=8, color=_GONE, path_effects=_HALO, clip_on=True
            )
    if len(shown.markers_px):
        x, y = shown.markers_px.T
        label = f"markers found: {len(x)}"
        axes.plot(x, y, "s", ms=9, mfc="none", mec=SERIES[5], mew=1.4, ls="none", label=label)
    if len(shown.missing_px):
        x, y = shown.missing_px.T
        label = f"markers not found: {len(x)}"
        axes.plot(x, y, "X", ms=9, mfc=_GONE, mec="#ffffff", mew=0.8, ls="none", label=label)
