"""Friction mobilised on the bands against slip, from the measured force, surface and band."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ploughval.report.figures.style import MODEL, SERIES, new_figure, styled

_MARKERS = "osD^vP"


@styled
def mobilised_figure(
    mobilised: pd.DataFrame,
    *,
    peak_deg: float | None = None,
    residual_deg: float | None = None,
    mobilization_length_mm: float | None = None,
) -> Figure:
    """Mobilised friction angle against slip, one mark a band, with the softening assumed by the model.

    Parameters
    ----------
    mobilised : DataFrame
        Columns frame, u_mm, slip_mm, band, phi_deg, phi_std_deg.
    peak_deg, residual_deg, mobilization_length_mm : float, degrees and mm, or None
        The model's softening line; drawn when all three are given.
    """
    figure = new_figure(3.2)
    axes = figure.subplots()
    colours = [c for c in SERIES if c != MODEL]
    for place, (band, part) in enumerate(mobilised.groupby("band", sort=True)):
        std = part["phi_std_deg"].to_numpy(float)
        axes.errorbar(
            part["slip_mm"],
            part["phi_deg"],
            yerr=np.where(np.isfinite(std), std, 0.0),
            fmt=_MARKERS[place % len(_MARKERS)],
            ms=4,
            color=colours[place % len(colours)],
            elinewidth=0.9,
            label=f"band {band:g} ± std",
        )
    if peak_deg is not None and residual_deg is not None and mobilization_length_mm is not None:
        far = max(float(np.nanmax(mobilised["slip_mm"], initial=0.0)), 1.5 * mobilization_length_mm)
        axes.plot(
            [0, mobilization_length_mm, far],
            [peak_deg, residual_deg, residual_deg],
            color=MODEL,
            ls="--",
            label="assumed by the model",
        )
    axes.set_xlabel("slip on the band, mm")
    axes.set_ylabel("mobilised friction φ, °")
    figure.legend(loc="outside upper center", ncols=3)
    return figure
