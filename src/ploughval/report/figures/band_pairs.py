"""Differences of matched shear bands with twice their uncertainty, pair by pair."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ploughval.report.figures.look import narrow
from ploughval.report.figures.style import INK, MEASURED, MODEL, new_figure, styled

_PANELS = (
    ("u_start_mm", "start, mm"),
    ("life_mm", "life, mm"),
    ("beta_deg", "β, °"),
    ("ahead_mm", "ahead, mm"),
)


@styled
def band_pairs_figure(pairs: pd.DataFrame) -> Figure:
    """Model minus experiment of four quantities, one point a matched band.

    Parameters
    ----------
    pairs : DataFrame
        Table ``band_pairs.csv``; rows without a partner are left out.
    """
    matched = pairs.dropna(subset=["band_experiment", "band_model"])
    rows = 2 if narrow() else 1
    figure = new_figure(2.5 * rows)
    panels = figure.subplots(rows, len(_PANELS) // rows, squeeze=False)
    for axes, (name, title) in zip(panels.flat, _PANELS, strict=True):
        _panel(axes, matched, name)
        axes.set_title(title, loc="left")
    for axes in panels[-1]:
        axes.set_xlabel("band")
    for axes in panels[:, 0]:
        axes.set_ylabel("model − experiment")
    return figure


def _panel(axes: Axes, matched: pd.DataFrame, name: str) -> None:
    number = np.arange(1, len(matched) + 1)
    error = matched[f"{name}_difference"].to_numpy(dtype=np.float64)
    twice = 2.0 * np.nan_to_num(matched[f"{name}_validation_std"].to_numpy(dtype=np.float64))
    inside = np.abs(error) <= twice
    axes.axhline(0, color=INK, lw=0.8)
    for chosen, colour, marker in ((inside, MEASURED, "o"), (~inside & np.isfinite(error), MODEL, "D")):
        axes.errorbar(
            number[chosen], error[chosen], yerr=twice[chosen], fmt=marker, ms=5, color=colour, elinewidth=1.0
        )
    axes.set_xlim(0.5, max(len(matched), 1) + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
