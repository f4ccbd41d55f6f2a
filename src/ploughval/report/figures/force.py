"""Force against displacement, normalised as in Hambleton et al., Figure 9, and its line of action."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ploughval.report.figures.look import legend_outside, narrow
from ploughval.report.figures.style import (
    INK,
    MEASURED,
    MODEL,
    MUTED,
    legend_above,
    new_figure,
    styled,
)
from ploughval.report.thinning import thin


@styled
def force_figure(
    force: pd.DataFrame | None,
    model: pd.DataFrame | None,
    *,
    depth_mm: float | None = None,
    P0_N: float | None = None,
    bands: pd.DataFrame | None = None,
    model_bands: pd.DataFrame | None = None,
    peaks: pd.DataFrame | None = None,
    envelope: pd.DataFrame | None = None,
) -> Figure:
    """Measured and predicted force histories; both are divided by the same force, so levels compare.

    Parameters
    ----------
    force : DataFrame of FORCE_COLUMNS or None
        Measured history.
    model : DataFrame of MODEL_FORCE_COLUMNS or None
        Predicted history.
    depth_mm, P0_N : float, mm and N, or None
        Divisors of the axes; None: that axis keeps its unit.
    bands, model_bands : DataFrame of BAND_COLUMNS or None
        Their starts are marked, measured above, predicted below.
    peaks : DataFrame or None
        Columns source, kind, u_mm, force_N; peaks are circled.
    envelope : DataFrame or None
        Columns u_mm, low_N, high_N: the limits that hold 95 % of the runs with drawn inputs.
    """
    figure = new_figure(4.6 if narrow() else 3.7)
    axes = figure.subplots()
    per_u, per_P = 1 / (depth_mm or 1.0), 1 / (P0_N or 1.0)
    if envelope is not None and envelope["low_N"].notna().any():
        axes.fill_between(
            envelope["u_mm"] * per_u,
            envelope["low_N"] * per_P,
            envelope["high_N"] * per_P,
            color=MODEL,
            alpha=0.18,
            lw=0,
            label="95 % of drawn inputs",
        )
    if force is not None:
        _measured(axes, force, per_u, per_P)
    if model is not None:
        axes.plot(
            model["u_mm"] * per_u, model["force_N"] * per_P, color=MODEL, ls="--", lw=1.8, label="predicted"
        )
    if peaks is not None:
        _mark_peaks(axes, peaks, per_u, per_P)
    _mark_starts(axes, bands, per_u, colour=MEASURED, height=1.0, marker="v", text="band starts, measured")
    _mark_starts(
        axes, model_bands, per_u, colour=MODEL, height=0.0, marker="^", text="band starts, predicted"
    )
    axes.set_xlabel("u / d" if depth_mm else "u, mm")
    axes.set_ylabel("P / P₀" if P0_N else "P, N")
    axes.set_xlim(left=min(0.0, axes.get_xlim()[0]) if axes.get_xlim()[0] < -0.2 else 0.0)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    _unit_axes(axes, depth_mm, P0_N)
    legend_outside(figure, *axes.get_legend_handles_labels())
    return figure


def _measured(axes: Axes, force: pd.DataFrame, per_u: float, per_P: float) -> None:
    shown = thin(force, "force_N")
    u, P, std = (shown[name].to_numpy(float) for name in ("u_mm", "force_N", "force_std_N"))
    if np.isfinite(std).any():
        axes.fill_between(
            u * per_u,
            (P - 2 * std) * per_P,
            (P + 2 * std) * per_P,
            color=MEASURED,
            alpha=0.25,
            lw=0,
            label="measured ± 2 std",
        )
    axes.plot(u * per_u, P * per_P, color=MEASURED, lw=1.2, label="measured")


def _mark_peaks(axes: Axes, peaks: pd.DataFrame, per_u: float, per_P: float) -> None:
    for source, colour in (("experiment", MEASURED), ("model", MODEL)):
        chosen = peaks[(peaks["source"] == source) & (peaks["kind"] == "peak")]
        axes.plot(
            chosen["u_mm"] * per_u, chosen["force_N"] * per_P, "o", ms=6, mfc="none", mec=colour, mew=1.3
        )


def _mark_starts(
    axes: Axes,
    bands: pd.DataFrame | None,
    per_u: float,
    *,
    colour: str,
    height: float,
    marker: str,
    text: str,
) -> None:
    if bands is None or bands.empty:
        return
    starts = bands["u_start_mm"].to_numpy(float) * per_u
    axes.plot(
        starts,
        np.full(len(starts), height),
        marker,
        color=colour,
        ms=8,
        clip_on=False,
        transform=axes.get_xaxis_transform(),
        label=text,
        zorder=5,
    )
    axes.vlines(starts, 0, 1, color=colour, lw=0.7, alpha=0.5, transform=axes.get_xaxis_transform(), ls=":")


def _unit_axes(axes: Axes, depth_mm: float | None, P0_N: float | None) -> None:
    """The same axes again in mm and N."""
    if P0_N:
        right = axes.secondary_yaxis("right", functions=_scaled(P0_N))
        right.set_ylabel("P, N", color=MUTED)
    if depth_mm:
        top = axes.secondary_xaxis("top", functions=_scaled(depth_mm))
        top.set_xlabel("u, mm", color=MUTED)


def _scaled(factor: float) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    return lambda value: value * factor, lambda value: value / factor


@styled
def arm_figure(force: pd.DataFrame, *, depth_mm: float | None = None) -> Figure:
    """Height of the force's line of action above the tip, with two standard uncertainties.

    Parameters
    ----------
    force : DataFrame of FORCE_COLUMNS
        Measured history.
    depth_mm : float, mm, or None
        A third of it is drawn: the line of action of a pressure that grows linearly with depth.
    """
    figure = new_figure(2.7)
    axes = figure.subplots()
    shown = thin(force, "arm_mm")
    u, arm, std = (shown[name].to_numpy(float) for name in ("u_mm", "arm_mm", "arm_std_mm"))
    axes.fill_between(
        u, arm - 2 * std, arm + 2 * std, color=MEASURED, alpha=0.25, lw=0, label="measured ± 2 std"
    )
    axes.plot(u, arm, color=MEASURED, lw=1.2, label="measured")
    if depth_mm:
        axes.axhline(depth_mm / 3, color=INK, lw=1, ls=":", label="d / 3")
        good = arm[np.isfinite(arm)]
        if good.size:
            low, high = np.quantile(good, (0.02, 0.98))
            axes.set_ylim(min(0.0, low - 2), max(depth_mm, high + 2))
    axes.set_xlabel("u, mm")
    axes.set_ylabel("above the tip, mm")
    legend_above(axes)
    return figure
