"""Figures of the study of the fit."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from drawing.png import save_light
from fit_study.example import SHEAR_BOX
from fit_study.objectives import HIGH, LOW, SIDE
from ploughval.report.figures.style import INK, MEASURED, MODEL, MUTED, new_figure, styled

Floats = NDArray[np.float64]

OBJECTIVES = ("squares", "absolute", "features", "registered")
SHOWN = ("model right", "teeth 10 % longer", "material points, least_softened")
TRUE = (50.0, 32.0)


def save(figure: Figure, path: Path) -> None:
    """A small PNG."""
    with mpl.rc_context({"savefig.dpi": 80}):
        save_light(figure, path, dpi=80)


@styled
def landscapes_figure(maps: dict[str, Floats]) -> Figure:
    """Cost over both friction angles: a row a record, a column an objective."""
    records = [name for name in SHOWN if f"{name}|squares|residual" in maps]
    figure = new_figure(2.15 * len(records) + 0.5, width_in=9.0)
    panels = figure.subplots(len(records), len(OBJECTIVES), sharex=True, sharey=True, squeeze=False)
    peak, residual = (np.linspace(LOW[k], HIGH[k], SIDE) for k in (0, 1))
    for line, record in zip(panels, records, strict=True):
        for axes, objective in zip(line, OBJECTIVES, strict=True):
            cost = maps[f"{record}|{objective}|residual"]
            rise = cost - np.nanmin(cost)
            shown = np.log10(1e-3 + rise / np.nanmedian(rise))
            image = axes.pcolormesh(
                peak, residual, shown, cmap="cividis_r", vmin=-2, vmax=0.5, rasterized=True
            )
            low = np.unravel_index(np.nanargmin(cost), cost.shape)
            axes.plot(*TRUE, "o", ms=9, mfc="none", mec="white", mew=1.6)
            axes.plot(peak[low[1]], residual[low[0]], "+", ms=10, mew=1.8, color=INK)
            axes.grid(visible=False)
        named = record.replace(", ", ",\n")
        line[0].set_ylabel(f"{named}\nresidual, °", fontsize=9)
    for axes, objective in zip(panels[0], OBJECTIVES, strict=True):
        axes.set_title(objective)
    for axes in panels[-1]:
        axes.set_xlabel("peak, °")
    bar = figure.colorbar(image, ax=panels, aspect=40, extend="both")
    bar.set_label("log₁₀ of the rise over its median")
    return figure


@styled
def virtual_figure(curves: pd.DataFrame) -> Figure:
    """The material-point run and its best fits by both rules of the direction, laid on it."""
    figure = new_figure(3.4, width_in=7.0)
    axes = figure.subplots()
    for rule, colour, dash in (("least_force", MODEL, "-"), ("least_softened", "#009e73", "--")):
        part = curves[curves["record"] == f"material points, {rule}"]
        if rule == "least_force":
            axes.plot(part["u_mm"], part["force_N"], ".", ms=3, color=MEASURED, label="material points")
        axes.plot(part["u_mm"], part["model_N"], color=colour, ls=dash, label=f"best fit, {rule}")
    axes.set(xlabel="displacement u, mm", ylabel="force, N", ylim=(0, None))
    figure.legend(loc="outside upper center", ncols=3)
    return figure


@styled
def intervals_figure(table: pd.DataFrame) -> Figure:
    """Intervals of both angles beside the direct shear tests."""
    names = list(dict.fromkeys(table["record"]))
    figure = new_figure(0.34 * len(names) + 1.4, width_in=8.6)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (parameter, box) in zip(panels, SHEAR_BOX.items(), strict=True):
        axes.axvspan(box[0] - 0.15, box[1] + 0.15, color=MUTED, alpha=0.3, lw=0)
        part = table[table["parameter"] == parameter].set_index("record")
        for k, name in enumerate(names):
            row = part.loc[name]
            colour = MEASURED if name.startswith("paper") else MODEL
            limits = np.array([row["low_95"], row["high_95"]])
            axes.plot(limits, [k, k], color=colour, lw=1.4)
            axes.plot([row["low_68"], row["high_68"]], [k, k], color=colour, lw=4)
            axes.plot(row["value"], k, "o", ms=5, mfc="white", mec=colour)
        axes.set_xlabel(f"{parameter.split('_')[0]} friction angle, °")
    panels[0].set_yticks(range(len(names)), names)
    panels[0].invert_yaxis()
    return figure
