"""Shear bands against displacement: outcrop and inclination, measured and predicted."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ploughval.report.figures.look import legend_outside
from ploughval.report.figures.style import MEASURED, MODEL, new_figure, styled


@styled
def bands_figure(
    bands: pd.DataFrame | None,
    increments: pd.DataFrame | None = None,
    *,
    model_bands: pd.DataFrame | None = None,
    model_force: pd.DataFrame | None = None,
) -> Figure:
    """Outcrop x and inclination beta against u: increments as points, bands as bars, the model as lines.

    Parameters
    ----------
    bands : DataFrame of BAND_COLUMNS or None
        Measured bands.
    increments : DataFrame or None
        INCREMENT_COLUMNS; beta and outcrop are those half-way through an increment, and are drawn there.
    model_bands : DataFrame of BAND_COLUMNS or None
        Predicted bands, drawn where ``model_force`` is not given.
    model_force : DataFrame of MODEL_FORCE_COLUMNS or None
        Carries the model's band at every displacement.
    """
    if increments is not None:
        increments = increments.assign(u_mm=increments["u_mm"] + increments["du_mm"] / 2)
    figure = new_figure(5.2)
    above, below = figure.subplots(2, 1, sharex=True)
    for axes, value, std in ((above, "outcrop_x_mm", "outcrop_std_mm"), (below, "beta_deg", "beta_std_deg")):
        if bands is not None:
            _bars(axes, bands, increments, value, std)
        if increments is not None:
            _points(axes, increments, value, std)
        if model_force is not None:
            _histories(axes, model_force, value)
        elif model_bands is not None:
            _starts(axes, model_bands, value)
    above.set_ylabel("outcrop x, mm")
    below.set_ylabel("inclination β, °")
    below.set_xlabel("u, mm")
    legend_outside(figure, *above.get_legend_handles_labels())
    return figure


def _bars(axes: Axes, bands: pd.DataFrame, increments: pd.DataFrame | None, value: str, std: str) -> None:
    """A band's life as a bar two standard deviations to either side.

    The outcrop stays, so its bar is level; the inclination's bar follows the increments, where there are any.
    """
    label: str | None = "bands, measured ± 2 std"
    for _, band in bands.iterrows():
        u = np.array([float(band["u_start_mm"]), float(band["u_end_mm"])])
        middle, spread = np.full(2, float(band[value])), np.full(2, float(band[std]))
        if value == "beta_deg" and increments is not None:
            own = increments[(increments["band"] == band["band"]) & increments[value].notna()]
            own = own[own["mechanism"] == "one_band"] if (own["mechanism"] == "one_band").sum() > 1 else own
            if len(own) > 1:
                u, middle, spread = (own[name].to_numpy(float) for name in ("u_mm", value, std))
        spread = 2 * np.nan_to_num(spread)
        axes.fill_between(
            u, middle - spread, middle + spread, color=MEASURED, alpha=0.25, lw=2.5, label=label
        )
        label = None


def _points(axes: Axes, increments: pd.DataFrame, value: str, std: str) -> None:
    spread = increments[std].to_numpy(float)
    axes.errorbar(
        increments["u_mm"],
        increments[value],
        yerr=np.where(np.isfinite(spread), spread, 0.0),
        fmt="o",
        ms=3.5,
        color=MEASURED,
        elinewidth=0.9,
        label="increments, measured ± std",
        zorder=4,
    )


def _histories(axes: Axes, model: pd.DataFrame, value: str) -> None:
    label: str | None = "predicted"
    for _, part in model.groupby("band", sort=True):
        axes.plot(part["u_mm"], part[value], color=MODEL, ls="--", lw=1.8, label=label)
        label = None


def _starts(axes: Axes, bands: pd.DataFrame, value: str) -> None:
    label: str | None = "predicted"
    for _, band in bands.iterrows():
        ends = [band["u_start_mm"], band["u_end_mm"]]
        axes.plot(ends, [band[value]] * 2, color=MODEL, ls="--", lw=1.8, label=label)
        label = None
