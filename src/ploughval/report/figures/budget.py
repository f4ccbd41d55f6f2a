"""What the standard uncertainty of the force is made of."""

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ploughval.report.figures.look import small_pt
from ploughval.report.figures.style import MEASURED, MUTED, new_figure, plain, styled

LEAST_SHARE = 0.0005  # what is less is in the table alone


def by_source(budget: pd.DataFrame) -> pd.DataFrame:
    """Shares with those of the two cells and of all constants added up.

    What a source does to both cells at once cancels or adds in a result: alone, a cell's share says little.

    Parameters
    ----------
    budget : DataFrame of BUDGET_COLUMNS
        A row a source and cell.

    Returns
    -------
    DataFrame
        source, share, arm_share.
    """
    both = budget["source"].str.replace(
        r"^(calibration|cross-talk|second order).*$", "calibration", regex=True
    )
    both = both.str.replace(r", (upper|lower) cell$", "", regex=True)
    return budget.groupby(both, sort=False)[["share", "arm_share"]].sum(min_count=1).reset_index()


@styled
def budget_figure(budget: pd.DataFrame) -> Figure:
    """Share of each source in the variance of the force and of the line of action.

    Parameters
    ----------
    budget : DataFrame of BUDGET_COLUMNS
        Shares are fractions of the variance; a panel without any is left out.
    """
    budget = by_source(budget)
    panels = [
        (share, text)
        for share, text in (("share", "force"), ("arm_share", "line of action"))
        if budget[share].notna().any()
    ]
    large = budget[[share for share, _ in panels]].abs().max(axis=1) >= LEAST_SHARE
    rows = budget[large].sort_values("share" if budget["share"].notna().any() else "arm_share")
    figure = new_figure(text_in=1.2 + 0.27 * max(len(rows), 1))
    places = range(len(rows))
    for axes, (share, text) in zip(
        np.atleast_1d(figure.subplots(1, max(len(panels), 1), sharey=True)), panels, strict=True
    ):
        values = rows[share].to_numpy(float) * 100
        axes.barh(places, values, color=MEASURED, height=0.62)
        for place, value in zip(places, values, strict=True):
            axes.annotate(
                f"{value:.1f} %".replace("-", "−"),
                (max(value, 0.0), place),
                xytext=(4, 0),
                textcoords="offset points",
                va="center",
                fontsize=small_pt(),
            )
        axes.axvline(0, color=MUTED, lw=0.8)
        axes.grid(visible=False, axis="y")
        axes.set_xlim(1.25 * values.min(initial=0.0), max(100.0, 1.1 * values.max(initial=0.0)) * 1.3)
        axes.set_xticks([0, 50, 100])
        axes.set_yticks(places, [plain(name.replace("_", " ")) for name in rows["source"]])
        axes.set_title(text, loc="left")
    figure.supxlabel("share of the variance, %", fontsize=mpl.rcParams["axes.labelsize"])
    return figure
