"""Histories that are not forces against a model: the blade in the photographs, and several tests together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ploughval.report.figures.look import legend_outside
from ploughval.report.figures.style import INK, MEASURED, SERIES, new_figure, plain, styled
from ploughval.report.thinning import MOST_POINTS, thin

_DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1)), (0, (6, 1.5, 1, 1.5)))  # tests differ without their colours
MOST_NAMES = 12  # in a legend; more would leave no room for the curves


@dataclass(frozen=True, slots=True)
class History:
    """One test's force histories and what they are divided by.

    Attributes
    ----------
    name : str
        Of the test.
    depth_mm, P0_N : float, mm and N
        Divisors of the axes.
    force : DataFrame of FORCE_COLUMNS or None
        Measured history.
    model : DataFrame of MODEL_FORCE_COLUMNS or None
        Predicted history.
    """

    name: str
    depth_mm: float
    P0_N: float
    force: pd.DataFrame | None
    model: pd.DataFrame | None


@styled
def blade_figure(blade: pd.DataFrame) -> Figure:
    """Blade position seen in the photographs minus the displacement used, against displacement.

    Parameters
    ----------
    blade : DataFrame
        Columns frame, time_s, u_mm, blade_x_mm, blade_std_mm.
    """
    figure = new_figure(2.5)
    axes = figure.subplots()
    gap = (blade["blade_x_mm"] - blade["u_mm"]).to_numpy(float)
    std = blade["blade_std_mm"].to_numpy(float)
    axes.axhline(0, color=INK, lw=0.8)
    axes.errorbar(
        blade["u_mm"],
        gap,
        yerr=np.where(np.isfinite(std), std, 0.0),
        fmt="o",
        ms=3.5,
        color=MEASURED,
        elinewidth=0.9,
    )
    axes.set_xlabel("u, mm")
    axes.set_ylabel("seen − used, mm")
    return figure


@styled
def forces_figure(histories: Sequence[History], *, measured: bool = True) -> Figure:
    """Normalised force histories of several tests on the same axes.

    Parameters
    ----------
    histories : sequence of History
        One or more tests; those that share a name share colour and entry in the legend.
    measured : bool
        The measured side, or the predicted one.
    """
    figure = new_figure(3.5)
    axes = figure.subplots()
    names = list(dict.fromkeys(history.name for history in histories))
    labelled: set[str] = set()
    most = min(MOST_POINTS, 5 * MOST_POINTS // len(histories))
    for history in histories:
        table = history.force if measured else history.model
        if table is None:
            continue
        shown, place = thin(table, "force_N", most), names.index(history.name)
        axes.plot(
            shown["u_mm"] / history.depth_mm,
            shown["force_N"] / history.P0_N,
            color=SERIES[place % len(SERIES)],
            ls=_DASHES[place % len(_DASHES)],
            lw=1.4,
            label=None if history.name in labelled else plain(history.name),
        )
        labelled.add(history.name)
    axes.set_xlabel("u / d")
    axes.set_ylabel("P / P₀, measured" if measured else "P / P₀, predicted")
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    if 0 < len(labelled) <= MOST_NAMES:
        legend_outside(figure, *axes.get_legend_handles_labels(), columns=2)
    return figure
