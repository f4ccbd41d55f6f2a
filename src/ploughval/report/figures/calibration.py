"""Where the control points stand, how far the camera misses them, and the scale across the photograph."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import ArrayLike, NDArray

from ploughval.report.figures.look import legend_outside, narrow, small_pt
from ploughval.report.figures.style import INK, MEASURED, MODEL, MUTED, WIDTH_IN, new_figure, styled

_LONGEST = 0.09  # arrow of the largest residual, as a share of the photograph's width
_ENLARGED = (1, 2, 5)
_LEVELS = 5
_BORDER = 0.08  # of the photograph, without numbers


@dataclass(frozen=True, slots=True)
class PictureMap:
    """A quantity on a grid of pixels.

    Attributes
    ----------
    x_px, y_px : (M,) and (N,) float64, px
        Columns and rows of the grid.
    values : (N, M) float64, unit of the quantity
        Of the quantity that is drawn.
    """

    x_px: NDArray[np.float64]
    y_px: NDArray[np.float64]
    values: NDArray[np.float64]


@styled
def residual_figure(
    points_px: ArrayLike, residual_px: ArrayLike, shape: tuple[int, int], tip_px: ArrayLike
) -> Figure:
    """The points in the photograph, with arrows from where each was read to where the camera puts it.

    Parameters
    ----------
    points_px : (N, 2) float, px
        As they were read.
    residual_px : (N, 2) float, px
        Projected minus read.
    shape : (H, W), px
        Size of the photographs.
    tip_px : (2,) float, px
        Where the world begins.
    """
    at, off = np.asarray(points_px, float), np.asarray(residual_px, float)
    figure = new_figure(picture_in=_height_in(shape, WIDTH_IN), text_in=0.6)
    axes = figure.subplots()
    _photograph(axes, shape)
    length = np.hypot(*off.T)
    factor = _factor(float(length.max(initial=0.0)), shape[1])
    axes.quiver(
        *at.T, *(factor * off).T, angles="xy", scale_units="xy", scale=1, color=MODEL, width=0.004, zorder=3,
        clip_on=False,
    )  # fmt: skip
    axes.plot(*at.T, "o", ms=3.5, color=MEASURED, label=f"{len(at)} points")
    axes.plot(*np.asarray(tip_px, float), "P", ms=8, color=INK, label="origin")
    rms = float(np.sqrt(np.mean(length**2)))
    axes.plot([], [], color=MODEL, label=f"residual, {factor:,g} times enlarged; rms {rms:.2g} px")
    legend_outside(figure, *axes.get_legend_handles_labels())
    return figure


@styled
def scale_figure(
    scale: PictureMap, std: PictureMap, points_px: ArrayLike, shape: tuple[int, int], tip_px: ArrayLike
) -> Figure:
    """Two maps of the photograph: its scale beside that at the tip, and the standard uncertainty of a place.

    Parameters
    ----------
    scale : PictureMap, per mille
        Local mm per px over that at the tip, less one.
    std : PictureMap, mm
        Standard uncertainty of a place, both components together.
    points_px : (N, 2) float, px
        The control points.
    shape : (H, W), px
        Size of the photographs.
    tip_px : (2,) float, px
        Where the world begins.
    """
    rows = 2 if narrow() else 1
    height = rows * _height_in(shape, rows * WIDTH_IN / 2)
    figure = new_figure(picture_in=height, text_in=0.15 + 0.8 * rows)
    for axes, found, title, digits in zip(
        figure.subplots(rows, 2 // rows, sharey=True),
        (scale, std),
        ("scale against the tip's, ‰", "standard uncertainty of a place, mm"),
        ("%+.2g", "%.2g"),
        strict=True,
    ):
        _photograph(axes, shape)
        axes.set_title(title, loc="left")
        lines = _contours(axes, found)
        if lines is not None:
            labels = axes.clabel(lines, fmt=lambda v, digits=digits: _label(v, digits), fontsize=small_pt())
            _within(labels, shape)
        axes.plot(*np.asarray(points_px, float).T, ".", ms=3, color=MUTED)
        axes.plot(*np.asarray(tip_px, float), "P", ms=7, color=INK)
    if not narrow():
        figure.axes[1].set_ylabel("")
    return figure


def _contours(axes: Axes, found: PictureMap) -> QuadContourSet | None:
    """Contour lines; None where the quantity is the same everywhere."""
    known = found.values[np.isfinite(found.values)]
    if not len(known) or np.ptp(known) < 1e-9 * max(1e-12, float(np.abs(known).max())):
        axes.annotate("the same everywhere", (0.5, 0.5), xycoords="axes fraction", ha="center", color=MUTED)
        return None
    return axes.contour(
        found.x_px, found.y_px, found.values, levels=_LEVELS, colors=[MEASURED], linewidths=1.1
    )


def _within(labels: Sequence[Text], shape: tuple[int, int]) -> None:
    """Hide numbers so near the border that they would be cut; the next lines tell where it goes."""
    height, width = shape
    for label in labels:
        x, y = label.get_position()
        inside = min(x / width, 1 - x / width, y / height, 1 - y / height)
        label.set_visible(bool(inside > _BORDER))


def _label(value: float, digits: str) -> str:
    return "0" if abs(value) < 1e-12 else (digits % value).replace("-", "−")


def _photograph(axes: Axes, shape: tuple[int, int]) -> None:
    """Axes that show the whole photograph, y down."""
    height, width = shape
    axes.set(
        xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="x, px", ylabel="y, px", aspect="equal"
    )
    axes.locator_params(nbins=5)


def _height_in(shape: tuple[int, int], width_in: float) -> float:
    return float(min(7.0, max(1.5, (width_in - 0.8) * shape[0] / shape[1])))


def _factor(longest_px: float, width_px: int) -> float:
    """A round number of times by which the largest residual becomes a visible arrow."""
    wanted = _LONGEST * width_px / max(longest_px, 1e-9)
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(step for step in _ENLARGED if step * power <= wanted))
