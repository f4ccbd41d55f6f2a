"""The heap ahead of the blade against what the blade has swept."""

import pandas as pd
from matplotlib.figure import Figure

from ploughval.report.figures.style import INK, MEASURED, new_figure, styled


@styled
def volume_figure(volume: pd.DataFrame) -> Figure:
    """Area of the heap over the area swept, against displacement, with twice its standard deviation.

    Parameters
    ----------
    volume : DataFrame
        Columns u_mm, swept_mm2, std_mm2, ratio; rows without a ratio are left out.
    """
    figure = new_figure(2.5)
    axes = figure.subplots()
    known = volume.dropna(subset=["ratio", "u_mm"])
    axes.axhline(1, color=INK, lw=0.8)
    spread = (2 * known["std_mm2"] / known["swept_mm2"]).fillna(0.0)
    axes.errorbar(known["u_mm"], known["ratio"], yerr=spread, fmt="o", ms=3.5, color=MEASURED, elinewidth=0.9)
    axes.set_xlabel("u, mm")
    axes.set_ylabel("area of heap / swept")
    return figure
