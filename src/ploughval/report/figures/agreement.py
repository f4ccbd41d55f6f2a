"""Errors in units of their validation uncertainty (after ASME V&V 20): what agrees, and what it rests on."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ploughval.report.figures.look import narrow, small_pt
from ploughval.report.figures.style import (
    GRID,
    INK,
    MEASURED,
    MODEL,
    SERIES,
    STEEL,
    new_figure,
    plain,
    styled,
)

FARTHEST = 8.0
_ROW_IN = 0.235
_PARTS = (("experiment", MEASURED), ("inputs", SERIES[4]), ("numerics", STEEL))


@styled
def agreement_figure(
    names: Sequence[str], ratios: Sequence[float], shares: Sequence[Sequence[float]] | None = None
) -> Figure:
    """Each metric's error over its validation uncertainty; within two it agrees.

    Parameters
    ----------
    names : sequence of str
        Labels, one a metric, from the top.
    ratios : sequence of float
        E / u_val, one a metric, finite; beyond 8 an arrow at the edge.
    shares : sequence of (float, float, float), or None
        Parts of u_val^2 that experiment, inputs and numerics have; drawn as bars beside.
    """
    figure = new_figure(text_in=1.0 + _ROW_IN * max(len(names), 2))
    if shares is None:
        axes = figure.subplots()
    else:
        axes, beside = figure.subplots(1, 2, sharey=True, width_ratios=(3, 1))
        _parts(beside, np.asarray(shares, dtype=float))
    _errors(axes, names, np.asarray(ratios, dtype=float))
    return figure


def _errors(axes: Axes, names: Sequence[str], values: NDArray[np.float64]) -> None:
    rows = np.arange(len(names))[::-1]
    axes.axvspan(-2, 2, color=GRID, lw=0, alpha=0.8)
    axes.axvline(0, color=INK, lw=0.8)
    inside = np.abs(values) <= 2
    far = np.abs(values) > FARTHEST
    shown = np.clip(values, -FARTHEST, FARTHEST)
    axes.hlines(rows, 0, shown, color=[MEASURED if good else MODEL for good in inside], lw=1.2)
    outside = ~inside & ~far
    for some, mark, colour in ((inside, "o", MEASURED), (outside, "D", MODEL)):
        if some.any():  # a line without points would count in the layout
            axes.plot(shown[some], rows[some], mark, color=colour, ms=6)
    for side, marker in ((1, ">"), (-1, "<")):
        beyond = far & (np.sign(values) == side)
        if beyond.any():
            axes.plot(shown[beyond], rows[beyond], marker, color=MODEL, ms=7, clip_on=False)
        for row, value in zip(rows[beyond], values[beyond], strict=True):
            axes.annotate(
                f"{value:+.0f}".replace("-", "−"),
                (side * FARTHEST, row),
                xytext=(-9 * side, 1),
                textcoords="offset points",
                ha="right" if side > 0 else "left",
                va="bottom",
                fontsize=small_pt(),
            )
    axes.set_yticks(rows, [plain(name) for name in names])
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.spines["left"].set_visible(False)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set_xlim(-FARTHEST * 1.03, FARTHEST * 1.03)
    axes.set_xticks([-8, -2, 2, 8] if narrow() else [-8, -4, -2, 0, 2, 4, 8])
    axes.set_xlabel("E / u_val" if narrow() else "E / u_val (grey: agrees)")


def _parts(axes: Axes, shares: NDArray[np.float64]) -> None:
    """What the square of each validation uncertainty is made of."""
    rows, start = np.arange(len(shares))[::-1], np.zeros(len(shares))
    for (name, colour), part in zip(_PARTS, shares.T, strict=True):
        axes.barh(rows, part, left=start, height=0.62, color=colour, label=name, lw=0)
        start = start + part
    axes.set_xlim(0, 1)
    axes.set_xticks([0, 0.5, 1], ["0", "½", "1"])
    axes.tick_params(axis="y", length=0, labelleft=False)
    axes.grid(visible=False)
    axes.set_xlabel("share" if narrow() else "share of u_val²")
    axes.figure.legend(loc="outside upper right", ncols=3, handlelength=1.2)
