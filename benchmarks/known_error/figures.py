"""Figures of the study of known errors: shares of tests within what is stated, and of wrong inputs found."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drawing.png import save_light
from drawing.style import BLUE, GREY, VERMILION, style

COVERED = 0.9545  # of a normal within two standard deviations
_SHOWN = {
    "peak_friction_deg": ("first_peak_N", "first_switch_u_mm", "first_switch_N", "first_outcrop_x_mm"),
    "residual_friction_deg": (
        "first_trough_N",
        "second_band_beta_deg",
        "first_switch_u_mm",
        "force_mean_N",
    ),
}
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
_MARKS = ("o", "s", "^", "D")


def draw_coverage(table: pd.DataFrame, path: Path) -> None:
    """Shares of tests with their intervals, a row a metric that most tests have: coverage, and verdicts."""
    judged = table[["within_2", "agrees"]].notna().any(axis=1)
    table = table[judged & (table["tests"] >= table["tests"].max() / 2)]
    with style():
        figure = Figure(figsize=(9.0, 1.2 + 0.155 * len(table)), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        rows = np.arange(len(table))[::-1]
        _shares(left, rows, table, "within_2", BLUE)
        _shares(right, rows, table, "agrees", VERMILION)
        left.set_title("stated E within 2 u of the known E\n(u: of the measurement and numerics)")
        right.set_title("verdict: agrees\n(inputs drawn from what is stated of them)")
        left.set_yticks(rows, table.index)
        left.set_ylim(-0.8, len(table) - 0.2)
        for ax in (left, right):
            ax.set_xlabel("share of tests, with 95 % interval")
            ax.axvline(COVERED, color=GREY, linewidth=0.8, linestyle="--")
            ax.set_xlim(0.0, 1.02)
            ax.tick_params(axis="y", length=0, labelsize=6.5)
            ax.grid(axis="y", linewidth=0.3, color="0.9")
        save_light(figure, path, dpi=85)


def _shares(ax: Axes, rows: np.ndarray, table: pd.DataFrame, name: str, colour: str) -> None:
    share, low, high = (table[f"{name}{end}"].to_numpy(dtype=float) for end in ("", "_low", "_high"))
    ax.errorbar(
        share, rows, xerr=np.vstack([share - low, high - share]).clip(0), fmt="o", color=colour, linewidth=0.9
    )


def draw_power(power: pd.DataFrame, path: Path) -> None:
    """Share of tests in which a metric differs over how far an input is told off, in its own uncertainty."""
    with style():
        figure = Figure(figsize=(9.0, 3.6), layout="constrained")
        for ax, (parameter, metrics) in zip(figure.subplots(1, 2, sharey=True), _SHOWN.items(), strict=True):
            some = power[power["parameter"] == parameter]
            for metric, colour, mark in zip(metrics, _COLOURS, _MARKS, strict=True):
                line = some[some["metric"] == metric].sort_values("steps")
                ax.plot(line["steps"], line["differs"], mark, ls="-", color=colour, label=metric)
            ax.axhline(1 - COVERED, color=GREY, linewidth=0.8, linestyle="--")
            ax.set_title(f"{parameter} told too high")
            ax.set_xlabel("by so many of its stated standard uncertainties")
            ax.legend(frameon=False, fontsize=7)
            ax.set_ylim(-0.02, 1.02)
        figure.axes[0].set_ylabel("share of tests in which it differs")
        save_light(figure, path, dpi=85)
