"""Motion of the block for a millimetre of the blade, against what a rigid block over the band does."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ploughval.report.figures.look import legend_outside
from ploughval.report.figures.style import INK, MEASURED, MODEL, MUTED, SERIES, new_figure, styled

MECHANISMS = {
    "one_band": ("one band", "o", MEASURED),
    "two_bands": ("two bands", "s", MODEL),
    "shear_along_blade": ("shearing along the blade", "^", SERIES[2]),
    "diffuse": ("diffuse", "D", SERIES[3]),
}


@styled
def kinematics_figure(increments: pd.DataFrame) -> Figure:
    """Velocity of the block along and up, measured ± std, beside 1 and tan beta; marks tell the mechanism.

    Parameters
    ----------
    increments : DataFrame
        INCREMENT_COLUMNS.
    """
    known = increments.dropna(subset=["velocity_x", "velocity_y"])
    u = known["u_mm"] + known["du_mm"] / 2
    figure = new_figure(4.2)
    above, below = figure.subplots(2, 1, sharex=True)
    above.axhline(1.0, color=INK, lw=1, ls="--", label="rigid block: 1 and tan β")
    below.plot(u, np.tan(np.radians(known["beta_deg"])), color=INK, lw=1, ls="--")
    for axes, axis in ((above, "x"), (below, "y")):
        _points(axes, known, u, f"velocity_{axis}")
    above.set_ylabel("along, mm/mm")
    below.set_ylabel("up, mm/mm")
    below.set_xlabel("u, mm")
    legend_outside(figure, *above.get_legend_handles_labels())
    return figure


def _points(axes: Axes, known: pd.DataFrame, u: pd.Series, name: str) -> None:
    for mechanism, (label, marker, colour) in MECHANISMS.items():
        some = (known["mechanism"] == mechanism).to_numpy()
        if some.any():
            axes.errorbar(
                u[some], known[name][some], yerr=known[f"{name}_std"][some], fmt=marker, ms=4,
                color=colour, ecolor=MUTED, elinewidth=0.9, label=label, zorder=4,
            )  # fmt: skip
