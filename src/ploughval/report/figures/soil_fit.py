"""The fit of the soil to the force: best fit over the record, profiles, landscapes."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ploughval.report.figures.look import legend_outside, narrow, small_pt
from ploughval.report.figures.style import (
    INK,
    MEASURED,
    MODEL,
    MUTED,
    STAGE_WIDTH_IN,
    WIDTH_IN,
    new_figure,
    styled,
)
from ploughval.report.text import label, unit

_HIGHEST = 8.0  # of a profile that is drawn
_COLOURS = "cividis_r"
_MOST_MAPS = 3  # beside each other


@styled
def soil_fit_figure(curve: pd.DataFrame, switches_mm: np.ndarray) -> Figure:
    """Record and best fit over travel, and what the fit misses in standard deviations of the noise.

    Parameters
    ----------
    curve : DataFrame
        Columns u_mm, force_N, noise_std_N, model_N.
    switches_mm : (K,) float
        Where the record changes its band.
    """
    figure = new_figure(4.2)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    above.plot(curve["u_mm"], curve["force_N"], ".", ms=2.5, color=MEASURED, label="measured")
    above.plot(curve["u_mm"], curve["model_N"], color=MODEL, lw=1.3, label="best fit, laid on the record")
    missed = (curve["force_N"] - curve["model_N"]) / curve["noise_std_N"]
    below.plot(curve["u_mm"], missed, ".", ms=2.5, color=MEASURED)
    below.axhline(0.0, color=MODEL, lw=1.0)
    for axes in (above, below):
        for place in switches_mm:
            axes.axvline(place, color=MUTED, lw=0.9, ls=":")
    above.set_ylim(bottom=0.0)
    above.set_ylabel("force, N")
    below.set(xlabel="displacement u, mm", ylabel="missed, std")
    legend_outside(figure, *above.get_legend_handles_labels(), columns=2)
    return figure


@styled
def profiles_figure(profiles: pd.DataFrame, levels: Mapping[str, float]) -> Figure:
    """Rise of the least cost over each parameter, with the rises that end the intervals.

    Parameters
    ----------
    profiles : DataFrame
        Columns parameter, value, rise.
    levels : mapping of str to float
        Name of an interval, and the rise at its ends.
    """
    names = list(dict.fromkeys(profiles["parameter"]))
    columns = min(2 if narrow() else 3, len(names))
    lines = -(-len(names) // columns)
    figure = new_figure(2.5 * lines, width_in=max(STAGE_WIDTH_IN, 2.15 * columns))
    panels = figure.subplots(lines, columns, sharey=True, squeeze=False).ravel()
    highest = max(_HIGHEST, 1.3 * max(levels.values()))
    for axes, name in zip(panels, names, strict=False):
        part = profiles[profiles["parameter"] == name].sort_values("value")
        x, y = part["value"].to_numpy(float), part["rise"].to_numpy(float)
        best = int(np.argmin(y))
        signs = np.where(np.arange(len(x)) < best, -1.0, 1.0)
        fine = np.linspace(x[0], x[-1], 200)
        # straight in the root of the rise, as the intervals are read
        rise = np.interp(fine, x, signs * np.sqrt(np.maximum(y - y[best], 0.0))) ** 2
        axes.plot(fine, rise, color=MODEL)
        axes.plot(x, y - y[best], "o", ms=3.5, color=MODEL)
        for text, level in levels.items():
            axes.axhline(level, color=MUTED, lw=0.9, ls="--")
            place = _clear(fine, rise, level)
            axes.annotate(text, (place, level), ha="center", va="bottom", fontsize=small_pt(), color=MUTED)
        axes.set_ylim(0.0, highest)
        axes.set_xlabel(quantity(name))
        axes.locator_params(axis="x", nbins=4)
    for axes in panels[len(names) :]:
        axes.set_visible(False)
    for axes in panels[::columns]:
        axes.set_ylabel("rise of the cost")
    return figure


def _clear(x: NDArray[np.float64], rise: NDArray[np.float64], level: float) -> float:
    """Where on a level a remark is farthest from the curve."""
    inner = slice(len(x) // 8, -(len(x) // 8))
    apart = np.abs(np.minimum(rise[inner], _HIGHEST) - level - 0.05 * _HIGHEST)
    return float(x[inner][int(np.argmax(apart))])


@styled
def landscape_figure(landscape: pd.DataFrame, best: Mapping[str, float]) -> Figure:
    """The cost over two parameters at a time; the cross is the best fit.

    Parameters
    ----------
    landscape : DataFrame
        Columns map ("first x second"), x, y, rise.
    best : mapping of str to float
        Best value of each parameter.
    """
    maps = list(dict.fromkeys(landscape["map"]))
    columns = 1 if narrow() else min(_MOST_MAPS, len(maps))
    lines = -(-len(maps) // columns)
    figure = new_figure(
        0.4 + (3.2 if narrow() else 2.5) * lines, width_in=WIDTH_IN if columns > 1 else STAGE_WIDTH_IN
    )
    panels = figure.subplots(lines, columns, squeeze=False).ravel()
    rises = np.log10(1.0 + np.maximum(landscape["rise"].to_numpy(float), 0.0))
    top = float(np.nanquantile(rises, 0.98))
    for axes in panels[len(maps) :]:
        axes.set_visible(False)
    for axes, name in zip(panels, maps, strict=False):
        part = landscape[landscape["map"] == name]
        x, y = np.unique(part["x"]), np.unique(part["y"])
        shown = np.full((len(y), len(x)), np.nan)
        place = np.searchsorted(y, part["y"]), np.searchsorted(x, part["x"])
        shown[place] = np.log10(1.0 + np.maximum(part["rise"].to_numpy(float), 0.0))
        image = axes.pcolormesh(
            x, y, shown,
            cmap=_COLOURS, vmin=0.0, vmax=top, shading="nearest", rasterized=True,
        )  # fmt: skip
        first, _, second = name.partition(" x ")
        axes.plot(best[first], best[second], "+", ms=11, mew=2.2, color="white")
        axes.plot(best[first], best[second], "+", ms=10, mew=1.1, color=INK)
        axes.set(xlabel=quantity(first), ylabel=quantity(second))
        axes.grid(visible=False)
        axes.locator_params(nbins=4)  # as few at every size: labels do not grow once they are laid out
    bar = figure.colorbar(
        image, ax=list(panels[: len(maps)]), orientation="horizontal", aspect=50, extend="max"
    )
    bar.set_label("log₁₀ (1 + rise of the cost)")
    return figure


def quantity(name: str) -> str:
    """A parameter's name with its unit, as it is printed."""
    for ending in ("kN_m3", "deg", "mm"):
        if name.endswith(f"_{ending}"):
            return f"{label(name)}, {unit(ending)}"
    return label(name)
