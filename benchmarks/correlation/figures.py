"""Figures of the correlation's errors: beside a shear band, and of sinusoids."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drawing.png import save_light
from drawing.style import BLUE, GREEN, GREY, ORANGE, VERMILION, style

COLOURS = 128


def save(figure: Figure, stem: Path) -> None:
    """Write stem.png with a palette: the same picture in a third of the bytes."""
    save_light(figure, stem.with_suffix(".png"), colours=COLOURS)


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
