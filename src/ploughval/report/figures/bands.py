"""Shear bands against displacement: outcrop and inclination, measured and predicted."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ploughval.report.figures.style import MEASURED, MODEL, new_figure, styled

Values = NDArray[np.float64]


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
        Columns u_mm, beta_deg, beta_std_deg, outcrop_x_mm, outcrop_std_mm.
    model_bands : DataFrame of BAND_COLUMNS or None
        Predicted bands, drawn where ``model_force`` is not given.
    model_force : DataFrame of MODEL_FORCE_COLUMNS or None
        Carries the model's band at every displacement.
    """
    figure = new_figure(5.2)
    above, below = figure.subplots(2, 1, sharex=True)
    for axes, value, std in ((above, "outcrop_x_mm", "outcrop_std_mm"), (below, "beta_deg", "beta_std_deg")):
        if bands is not None:
            _bars(axes, bands, value, std)
        if increments is not None:
            _points(axes, increments, value, std)
        if model_force is not None:
            _histories(axes, model_force, value)
        elif model_bands is not None:
            _starts(axes, model_bands, value)
    above.set_ylabel("outcrop x, mm")
    below.set_ylabel("inclination β, °")
    below.set_xlabel("u, mm")
    handles, labels = above.get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _bars(axes: Axes, bands: pd.DataFrame, value: str, std: str) -> None:
    """A band's life as a bar two standard deviations to either side; its inclination holds at its start."""
    label: str | None = "bands, measured ± 2 std"
    for _, band in bands.iterrows():
        u = np.linspace(float(band["u_start_mm"]), float(band["u_end_mm"]), 40)
        middle = _along(band, u, value)
        spread = 2 * np.nan_to_num(float(band[std]))
        axes.fill_between(
            u,
            middle - spread,
            middle + spread,
            color=MEASURED,
            alpha=0.25,
            lw=1.5,
            label=label,
        )
        label = None


def _along(band: pd.Series, u_mm: Values, value: str) -> Values:
    """Outcrop or inclination of a band at displacements of its life: the outcrop stays, so it steepens."""
    x, start = float(band["outcrop_x_mm"]), float(band["u_start_mm"])
    if value == "outcrop_x_mm":
        return np.full(u_mm.shape, x)
    rise = (x - start) * np.tan(np.radians(float(band["beta_deg"])))
    beta: Values = np.degrees(np.arctan2(rise, x - u_mm))
    return beta


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
        u = np.linspace(float(band["u_start_mm"]), float(band["u_end_mm"]), 40)
        axes.plot(u, _along(band, u, value), color=MODEL, ls="--", lw=1.8, label=label)
        label = None
