"""Shape of the force: each side over its own initial force, as in Hambleton et al., Figure 9."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ploughval.report.figures.style import INK, MEASURED, MODEL, legend_above, new_figure, styled
from ploughval.report.thinning import thin

_MARKS = {"peak": "o", "trough": "v"}


@styled
def shape_figure(
    force: pd.DataFrame,
    model: pd.DataFrame,
    initial_N: tuple[float, float],
    *,
    depth_mm: float,
    peaks: pd.DataFrame | None = None,
    envelope: pd.DataFrame | None = None,
    pairs: pd.DataFrame | None = None,
) -> Figure:
    """Measured and predicted force, each over its own initial force, against travel in depths.

    Parameters
    ----------
    force : DataFrame of FORCE_COLUMNS
        Measured history.
    model : DataFrame of MODEL_FORCE_COLUMNS
        Predicted history.
    initial_N : (float, float)
        Initial force of either side, measured and predicted.
    depth_mm : float
        Depth of the tip.
    peaks : DataFrame or None
        Columns source, kind, u_mm, force_N: circles on peaks, triangles on troughs.
    envelope : DataFrame or None
        Columns u_mm, low_N, high_N: the limits that hold 95 % of the runs with drawn inputs.
    pairs : DataFrame or None
        Columns u_mm_experiment, force_N_experiment, u_mm_model, force_N_model: partners are joined.
    """
    figure = new_figure(3.6)
    axes = figure.subplots()
    if envelope is not None and envelope["low_N"].notna().any():
        _fill(axes, envelope, initial_N[1], depth_mm)
    shown = thin(force, "force_N")
    axes.plot(
        shown["u_mm"] / depth_mm, shown["force_N"] / initial_N[0], color=MEASURED, lw=1.2, label="measured"
    )
    axes.plot(
        model["u_mm"] / depth_mm,
        model["force_N"] / initial_N[1],
        color=MODEL,
        ls="--",
        lw=1.6,
        label="predicted",
    )
    if peaks is not None:
        _mark(axes, peaks, initial_N, depth_mm)
    if pairs is not None:
        _join(axes, pairs, initial_N, depth_mm)
    axes.axhline(1, color=INK, lw=0.7, ls=":")
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("u / d")
    axes.set_ylabel("P / own P₀")
    legend_above(axes)
    return figure


def _fill(axes: Axes, envelope: pd.DataFrame, initial_N: float, depth_mm: float) -> None:
    """Between the limits of the runs with drawn inputs."""
    low, high = (envelope[name] / initial_N for name in ("low_N", "high_N"))
    u_d = envelope["u_mm"] / depth_mm
    axes.fill_between(u_d, low, high, color=MODEL, alpha=0.18, lw=0, label="95 % of drawn inputs")


def _mark(axes: Axes, peaks: pd.DataFrame, initial_N: tuple[float, float], depth_mm: float) -> None:
    """Peaks and troughs of either side."""
    for source, colour, own in (("experiment", MEASURED, initial_N[0]), ("model", MODEL, initial_N[1])):
        for kind, mark in _MARKS.items():
            some = peaks[(peaks["source"] == source) & (peaks["kind"] == kind)]
            place = some["u_mm"] / depth_mm, some["force_N"] / own
            axes.plot(*place, mark, ms=6, mfc="none", mec=colour, mew=1.3)


def _join(axes: Axes, pairs: pd.DataFrame, initial_N: tuple[float, float], depth_mm: float) -> None:
    """A thin line from every measured peak to its partner."""
    for _, pair in pairs.dropna(subset=["u_mm_experiment", "u_mm_model"]).iterrows():
        axes.plot(
            [pair["u_mm_experiment"] / depth_mm, pair["u_mm_model"] / depth_mm],
            [pair["force_N_experiment"] / initial_N[0], pair["force_N_model"] / initial_N[1]],
            color=INK,
            lw=0.8,
        )
