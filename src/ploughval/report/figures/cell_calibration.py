"""Residuals of the cells' calibration: what known moments are beside those that the readings give."""

from pathlib import PurePosixPath

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ploughval.report.figures.look import legend_outside, narrow, small_pt
from ploughval.report.figures.style import (
    GRID,
    INK,
    MUTED,
    SERIES,
    new_figure,
    plain,
    styled,
)

_CELLS = ("upper", "lower")
_MARKS = {"up": "^", "down": "v"}
_DASHES = ("-", "-.", ":", (0, (6, 1.5, 1, 1.5, 1, 1.5)))  # runs differ without their colours
_NAMED_RUNS = len(SERIES)  # more runs than colours are not named
_MARGIN = 1.25


@styled
def cell_calibration_figure(points: pd.DataFrame, quality: pd.DataFrame) -> Figure:
    """Known less fitted moment over the known moment, one panel a cell.

    Parameters
    ----------
    points : DataFrame
        Calibration points: file, row, run, direction (up or down), moment_upper_Nm, moment_lower_Nm,
        residual_upper_Nm, residual_lower_Nm, used. A point left out stands at the edge with its value.
    quality : DataFrame
        Columns quantity, cell, value; "standard error" gives the dashed lines at two of them, "lower limit"
        the grey part where values are too small to be used.
    """
    rows = 2 if narrow() else 1
    figure = new_figure(3.8 if rows == 1 else 6.0)
    panels = figure.subplots(rows, 2 // rows)
    shown = points[np.isfinite(points["residual_upper_Nm"].to_numpy(float))]
    keys = list(dict.fromkeys(zip(shown["file"], shown["run"], strict=True)))
    for axes, cell in zip(panels, _CELLS, strict=True):
        _limits(axes, shown, quality, cell)
        _runs(axes, shown, keys, cell)
        _wrong(axes, shown, cell)
        axes.axhline(0, color=INK, lw=0.8)
        axes.set_title(f"{cell} cell", loc="left")
    for axes in panels[rows - 1 :]:
        axes.set_xlabel("known moment, N m")
    for axes in panels[:rows]:
        axes.set_ylabel("known − fitted, N m")
    legend_outside(figure, *panels[0].get_legend_handles_labels())
    return figure


def cell_calibration_alt(points: pd.DataFrame, quality: pd.DataFrame) -> str:
    """What the figure shows, for those who do not see it.

    Parameters
    ----------
    points, quality : DataFrame
        As for :func:`cell_calibration_figure`.

    Returns
    -------
    str
        A sentence a cell.
    """
    used = points[points["used"].to_numpy(bool)]
    parts = []
    for cell in _CELLS:
        largest = used[f"residual_{cell}_Nm"].abs().max()
        scale = used[f"moment_{cell}_Nm"].abs().max()
        parts.append(
            f"{cell} cell: residuals within {largest:.3g} N m ({100 * largest / scale:.2g} % of full scale), "
            f"standard error {_figure(quality, 'standard error', cell):.3g} N m"
        )
    runs = len(set(zip(used["file"], used["run"], strict=True)))
    wrong = int((~points["used"].to_numpy(bool)).sum())
    text = f"Calibration residuals of {len(used)} points in {runs} run{'s' if runs != 1 else ''}. "
    return (
        text + "; ".join(parts) + (f". {wrong} point{'s' if wrong != 1 else ''} left out." if wrong else ".")
    )


def _figure(quality: pd.DataFrame, quantity: str, cell: str) -> float:
    chosen = quality[(quality["quantity"] == quantity) & (quality["cell"] == cell)]["value"]
    return float(chosen.iloc[0]) if len(chosen) else float("nan")


def _limits(axes: Axes, points: pd.DataFrame, quality: pd.DataFrame, cell: str) -> None:
    """Two standard errors, and the moments below the lower limit of use."""
    error, least = (_figure(quality, name, cell) for name in ("standard error", "lower limit"))
    if np.isfinite(least):
        axes.axvspan(-least, least, color=GRID, alpha=0.6, lw=0, label="below lower limit")
    if np.isfinite(error):
        for side in (-2, 2):
            axes.axhline(side * error, color=MUTED, lw=1, ls="--", label="± 2 standard errors")
    used = points[points["used"].to_numpy(bool)]
    reach = max(float(used[f"residual_{cell}_Nm"].abs().max()), 2 * error if np.isfinite(error) else 0.0)
    axes.set_ylim(-_MARGIN * reach, _MARGIN * reach) if reach > 0 else None
    moment = points[f"moment_{cell}_Nm"].to_numpy(float)
    low, high = min(moment.min(), 0.0), max(moment.max(), 0.0)
    axes.set_xlim(low - 0.05 * (high - low), high + 0.05 * (high - low))


def _runs(axes: Axes, points: pd.DataFrame, keys: list[tuple[str, str]], cell: str) -> None:
    for k, (file, run) in enumerate(keys):
        part = points[(points["file"] == file) & (points["run"] == run) & points["used"].to_numpy(bool)]
        moment, residual = (part[f"{name}_{cell}_Nm"].to_numpy(float) for name in ("moment", "residual"))
        colour = SERIES[k % len(SERIES)]
        name = plain(f"{PurePosixPath(file).stem}, run {run}", 28) if 1 < len(keys) <= _NAMED_RUNS else ""
        dash = _DASHES[k % len(_DASHES)]
        axes.plot(moment, residual, color=colour, ls=dash, lw=0.8, alpha=0.7, label=name or "_")
        for direction, mark in _MARKS.items():
            rows = (part["direction"] == direction).to_numpy()
            axes.plot(moment[rows], residual[rows], mark, color=colour, ms=5)
    for direction, mark in _MARKS.items():
        axes.plot([], [], mark, color=MUTED, ms=5, label=f"going {direction}")


def _wrong(axes: Axes, points: pd.DataFrame, cell: str) -> None:
    """Points left out: at the edge of the panel, with how far off they are."""
    wrong = points[~points["used"].to_numpy(bool)]
    if wrong.empty:
        return
    low, high = axes.get_ylim()
    moment, residual = (wrong[f"{name}_{cell}_Nm"].to_numpy(float) for name in ("moment", "residual"))
    place: NDArray[np.float64] = np.clip(residual, 0.93 * low, 0.93 * high)
    axes.plot(moment, place, "x", color=INK, ms=8, mew=1.8, label="left out")
    left, right = axes.get_xlim()
    for x, y, value, row in zip(moment, place, residual, wrong["row"], strict=True):
        beyond = x > 0.6 * right + 0.4 * left
        axes.annotate(
            f"row {row:.0f}: {value:+.3g}".replace("-", "−"),
            (x, y),
            xytext=(-8 if beyond else 8, 0),
            textcoords="offset points",
            ha="right" if beyond else "left",
            va="center",
            fontsize=small_pt(),
        )
