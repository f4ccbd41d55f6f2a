"""The mound ahead of the blade against travel: height, front, slopes and area, measured and predicted."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ploughval.report.figures.look import legend_outside
from ploughval.report.figures.style import INK, MEASURED, MODEL, new_figure, styled

_PANELS = (
    ("crest_mm", "crest_std_mm", "crest height, mm"),
    ("face_mm", "face_std_mm", "face height, mm"),
    ("front_mm", "front_std_mm", "front ahead, mm"),
    ("flank_deg", "flank_std_deg", "flank slope, °"),
    ("slope_deg", "slope_std_deg", "front slope, °"),
    ("area_mm2", "area_std_mm2", "heap area, mm²"),
)


@styled
def mound_figure(mound: pd.DataFrame, *, repose_deg: float | None = None) -> Figure:
    """Six panels against the travel of the blade.

    Parameters
    ----------
    mound : DataFrame
        source (experiment or model), u_mm and, with their standard uncertainties, crest_mm, face_mm,
        front_mm, flank_deg, slope_deg and area_mm2.
    repose_deg : float or None
        Slope of repose that the model was given, as a dotted line.
    """
    figure = new_figure(7.0)
    panels = figure.subplots(3, 2, sharex=True)
    for axes, (name, std, label) in zip(panels.flat, _PANELS, strict=True):
        _panel(axes, mound, name, std)
        axes.set_title(label, loc="left")
        if name in ("flank_deg", "slope_deg") and repose_deg is not None:
            axes.axhline(repose_deg, color=INK, lw=0.8, ls=":")
    for axes in panels[-1]:
        axes.set_xlabel("u, mm")
    legend_outside(figure, *panels[0, 0].get_legend_handles_labels())
    return figure


def _panel(axes: Axes, mound: pd.DataFrame, name: str, std: str) -> None:
    predicted = mound[mound["source"] == "model"].sort_values("u_mm")
    axes.plot(predicted["u_mm"], predicted[name], color=MODEL, ls="--", marker=".", ms=3, label="predicted")
    seen = mound[mound["source"] == "experiment"].dropna(subset=[name])
    axes.errorbar(
        seen["u_mm"], seen[name], yerr=2 * np.nan_to_num(seen[std].to_numpy(float)), fmt="o", ms=3.5,
        color=MEASURED, elinewidth=0.9, label="measured ± 2 std", zorder=4,
    )  # fmt: skip
