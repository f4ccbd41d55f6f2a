"""Errors in units of their validation uncertainty (after ASME V&V 20): what agrees, at a glance."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ploughval.report.figures.style import GRID, INK, MEASURED, MODEL, new_figure, styled

FARTHEST = 8.0


@styled
def agreement_figure(names: Sequence[str], ratios: Sequence[float]) -> Figure:
    """Each metric's error over its validation uncertainty; within two it agrees.

    Parameters
    ----------
    names : sequence of str
        Labels, one a metric.
    ratios : sequence of float
        E / u_val, one a metric, finite; beyond 8 an arrow at the edge.
    """
    figure = new_figure(0.75 + 0.3 * max(len(names), 1))
    axes = figure.subplots()
    rows = np.arange(len(names))[::-1]
    values = np.asarray(ratios, dtype=float)
    axes.axvspan(-2, 2, color=GRID, lw=0, alpha=0.8)
    axes.axvline(0, color=INK, lw=0.8)
    inside = np.abs(values) <= 2
    far = np.abs(values) > FARTHEST
    shown = np.clip(values, -FARTHEST, FARTHEST)
    axes.hlines(rows, 0, shown, color=[MEASURED if good else MODEL for good in inside], lw=1.2)
    axes.plot(shown[inside], rows[inside], "o", color=MEASURED, ms=7)
    axes.plot(shown[~inside & ~far], rows[~inside & ~far], "D", color=MODEL, ms=6.5)
    for side, marker in ((1, ">"), (-1, "<")):
        beyond = far & (np.sign(values) == side)
        axes.plot(shown[beyond], rows[beyond], marker, color=MODEL, ms=8, clip_on=False)
        for row, value in zip(rows[beyond], values[beyond], strict=True):
            axes.annotate(
                f"{value:+.0f}".replace("-", "−"),
                (side * FARTHEST, row),
                xytext=(-9 * side, 0),
                textcoords="offset points",
                ha="right" if side > 0 else "left",
                va="bottom",
                fontsize=9,
            )
    axes.set_yticks(rows, list(names))
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.spines["left"].set_visible(False)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set_xlim(-FARTHEST * 1.03, FARTHEST * 1.03)
    axes.set_xlabel("E / u_val, model − experiment (grey: agrees)")
    return figure
