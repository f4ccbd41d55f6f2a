"""Figures of the correlation's speed against error."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from study_model_figures import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILION, save, style

__all__ = ["draw_band", "draw_settings", "draw_star", "save"]

ORDERS = {0: (VERMILION, "o", "translation"), 1: (BLUE, "s", "affine"), 2: (GREEN, "^", "second order")}
LABELS = {
    "sun-dic": (0, 7, "center"),
    "al-dic-admm": (0, -13, "center"),
    "geopyv-dev": (4, -13, "left"),
    "al-dic-local": (7, 3, "left"),
}
"""Where the names of programs stand beside their marks, points."""
PANELS = (
    ("shift 0.25 noise 3", "rmse_px", "translation, noise 3: rmse, px"),
    ("affine", "rmse_px", "2 % stretch, 3 % shear, 1.5 degrees: rmse, px"),
    ("band 4 px tanh noise 3", "near_rmse_px", "closer than half a subset to a band of 4 px: rmse, px"),
    ("star", "star_period_px", "period measured at 90 %, px"),
)


def draw_settings(rows: Sequence[dict[str, Any]]) -> Figure:
    """Error against points a second, by subset, order, spline and shape."""
    with style():
        figure = Figure(figsize=(9.2, 7.0), layout="constrained")
        for ax, (case, column, title) in zip(figure.subplots(2, 2).flat, PANELS, strict=True):
            some = [r for r in rows if r["case"] == case and r["workers"] == 1 and r["step_px"] == 16]
            _settings_panel(ax, some, column)
            ax.set_title(title)
            ax.set_xlabel("thousand points a second, one thread")
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False)
        return figure


def _settings_panel(ax: Axes, rows: Sequence[dict[str, Any]], column: str) -> None:
    for order, (colour, marker, name) in ORDERS.items():
        line = [r for r in rows if r["order"] == order and r["spline"] == 5 and r["shape"] == "fixed"]
        _line(ax, line, column, color=colour, marker=marker, label=f"{name}, as given")
    cubic = [r for r in rows if r["spline"] == 3]
    _line(ax, cubic, column, color=GREY, marker="x", linestyle=":", label="affine, cubic spline")
    adaptive = [r for r in rows if r["shape"] == "adaptive"]
    _line(ax, adaptive, column, color=ORANGE, marker="D", label="adaptive")
    for row in adaptive:
        if row["subset"] == 31 and np.isfinite(row[column]):
            spot = row["points_s"] / 1e3, row[column]
            ax.plot(*spot, "o", color=BLACK, markersize=9, fillstyle="none")
            ax.annotate("default", spot, (7, 7), textcoords="offset points", fontsize=8)
    ax.set_yscale("log")
    ax.set_xlim(left=0)


def _line(ax: Axes, rows: Sequence[dict[str, Any]], column: str, **options: Any) -> None:
    rows = [r for r in rows if np.isfinite(r[column])]
    ax.plot([r["points_s"] / 1e3 for r in rows], [r[column] for r in rows], **options)
    for row in rows:
        if options["marker"] == "s":
            look = {"fontsize": 7, "color": options["color"], "ha": "center"}
            spot = row["points_s"] / 1e3, row[column]
            ax.annotate(f"{row['subset']}", spot, (0, -11), textcoords="offset points", **look)


def draw_band(profiles: Sequence[dict[str, Any]]) -> Figure:
    """Error against the distance from a band, whole affine subsets and adaptive ones."""
    with style():
        figure = Figure(figsize=(9.2, 3.6), layout="constrained")
        axes = figure.subplots(1, 2, sharey=True)
        for profile in profiles:
            ax = axes[0 if "12 px" in profile["case"] else 1]
            adaptive = profile["shape"] == "adaptive"
            names = (ORANGE, "adaptive (default)"), (VERMILION, "whole affine subsets")
            colour, name = names[0 if adaptive else 1]
            ax.plot(
                profile["side_px"], np.maximum(profile["error_px"], 1e-4), ".", color=colour, markersize=3,
                label=name, zorder=3 if adaptive else 2, rasterized=True,
            )  # fmt: skip
        for ax, width in zip(axes, (12, 4), strict=True):
            ax.axvspan(-15.5, 15.5, color=GREY, alpha=0.12, linewidth=0)
            ax.set_xlim(-60, 60)
            ax.set_yscale("log")
            ax.set_xlabel("distance from the band's middle, px")
            ax.set_title(f"slip of 5.4 px spread over {width} px, noise 3 grey levels")
        axes[0].set_ylabel("error of a vector, px")
        axes[0].legend(frameon=False, loc="lower left", markerscale=3)
        axes[1].annotate("half a subset", (0, 4.2), ha="center", va="top", fontsize=8, color=GREY)
        return figure


def draw_star(profiles: Sequence[dict[str, Any]]) -> Figure:
    """Share of a sinusoid's amplitude that is measured, against its period."""
    looks = ((VERMILION, "o"), (GREEN, "^"), (BLUE, "s"), (ORANGE, "D"))
    with style():
        figure = Figure(figsize=(6.4, 3.6), layout="constrained")
        ax = figure.subplots()
        for profile, (colour, marker) in zip(profiles, looks, strict=True):
            ax.plot(
                profile["period_px"], profile["gain"], color=colour, marker=marker, label=profile["label"]
            )
        ax.axhline(0.9, color=GREY, linewidth=0.8, linestyle="--")
        ax.annotate(
            "90 %", (150, 0.9), (0, 2), textcoords="offset points", ha="right", fontsize=8, color=GREY
        )
        ax.set_xlabel("period, px")
        ax.set_ylabel("measured share of an amplitude of 0.5 px")
        ax.set_ylim(-0.1, 1.05)
        ax.legend(frameon=False, loc="lower right")
        return figure


def draw_peers(rows: Sequence[dict[str, str]]) -> Figure:
    """Speed against error of several programs: near a band, under translation, at low contrast."""
    panels = (
        ("near_4", "beside a band of 4 px: rmse, px"),
        ("bias_0", "greatest bias of a translation, px"),
        ("star_90", "period measured at 90 %, px"),
    )
    with style():
        figure = Figure(figsize=(10.5, 3.8), layout="constrained")
        for ax, (column, title) in zip(figure.subplots(1, 3), panels, strict=True):
            for row in rows:
                _peer(ax, row, column)
            ax.set_xscale("log")
            ax.set_yscale("log")
            ax.set_title(title)
            ax.set_xlabel("points a second (translation), one core")
            ax.set_xlim(1e3, 2e5)
            ax.margins(y=0.12)
        return figure


def _peer(ax: Axes, row: dict[str, str], column: str) -> None:
    try:
        spot = float(row["points_s"]), float(row[column])
    except ValueError:  # a dash: not measured
        return
    ours = row["package"] == "ploughval"
    ax.plot(*spot, "D" if ours else "o", color=ORANGE if ours else BLUE, markersize=7 if ours else 5)
    x, y, side = LABELS.get(row["package"], (7, -3, "left"))
    look = {"fontsize": 8, "fontweight": "bold" if ours else "normal", "ha": side}
    ax.annotate(row["package"], spot, (x, y), textcoords="offset points", **look)
