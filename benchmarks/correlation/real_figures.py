"""Figures of the correlation on real pictures of others."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from drawing.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION
from ploughval.axes import Status

Floats = NDArray[np.float64]
BAR = {"location": "bottom", "shrink": 0.7, "aspect": 35}
ARROWS = {"angles": "xy", "scale_units": "xy", "width": 0.003}
WAVE_SETTINGS = ((31, 1, VERMILION), (25, 2, BLUE), (21, 2, GREEN))
PERIODS = np.array([12, 16, 20, 24, 28, 32, 36, 40, 46, 52, *range(60, 151, 10)], float)
STILL = [(500, 45), (560, 100), (600, 160), (600, 200), (300, 45), (600, 320)]


def draw_wave(ax: Axes, gains: dict[str, Floats]) -> None:
    """Amplitude found against period."""
    middle = (PERIODS[:-1] + PERIODS[1:]) / 2
    colours = [BLACK, *(colour for *_, colour in WAVE_SETTINGS)]
    for (label, gain), colour, marker in zip(gains.items(), colours, "xos^", strict=True):
        ax.plot(middle, 0.5 * gain, color=colour, marker=marker, ms=4, lw=1.3, label=label)
    ax.axhline(0.5, color=GREY, lw=0.8)
    ax.axhline(0.45, color=GREY, lw=0.8, ls="--")
    ax.annotate("true 0.5 px; dashed: 90 %", (148, 0.507), ha="right", va="bottom", color=GREY, fontsize=8)
    ax.set(xlabel="period of the wave, px", ylabel="amplitude of v, px", ylim=(-0.1, 0.56))
    ax.set_title("a  Wave: amplitude found")
    ax.legend(loc="lower right", fontsize=8, borderaxespad=0.2)


def draw_tbar(ax: Axes, result: dict[str, Any]) -> None:
    """Mean field, coloured by the scatter over the five pairs."""
    points, d = result["points"][17:], result["d81"][:, 17:]
    sparse = (points % 192 == 96).all(axis=1) | (np.hypot(*(points - (1923, 1456)).T) < 950)
    seen = np.isfinite(d[:, :, 0]).all(axis=0) & sparse
    mean, std = d[:, seen].mean(axis=0), np.hypot(*d[:, seen].std(axis=0, ddof=1).T)
    ax.imshow(np.where(result["mask"], 1.0, 0.75), cmap="gray", vmin=0, vmax=1)
    x, y = points[seen].T
    arrows = ax.quiver(x, y, *mean.T, std, scale=0.02, cmap="cividis", clim=(0, 0.1), **ARROWS)
    ax.quiverkey(arrows, 0.86, 1.04, 4.0, "4 px", labelpos="E", coordinates="axes")
    ax.figure.colorbar(arrows, ax=ax, label="scatter over the five pairs, px", extend="max", **BAR)
    ax.set(xlabel="x, px", ylabel="y, px")
    ax.set_title("b  T-bar: mean of five pairs, subset 81")


def draw_avalanche(ax: Axes, result: dict[str, Any]) -> None:
    """Vectors of one pair over its photograph, by status."""
    tracks, points = result["tracks"], result["points"]
    ax.imshow(result["picture"], cmap="gray", vmin=-60, vmax=300)
    ok = tracks.valid
    x, y = points[ok].T
    ax.quiver(x, y, *tracks.displacement[ok].T, scale=0.4, color=BLUE, **ARROWS)
    ax.plot([], [], color=BLUE, lw=2, label=f"ok ({ok.sum()}), 2.5 times enlarged")
    codes = (Status(int(code)) for code in np.unique(tracks.status[~ok]))
    for status, colour, marker in zip(codes, (ORANGE, VERMILION, GREEN, PURPLE), "XPD*", strict=False):
        where = points[tracks.status == status]
        name = f"{status.meaning.replace('_', ' ')} ({len(where)})"
        ax.plot(*where.T, marker, color=colour, mec=BLACK, ms=8, mew=0.6, label=name)
    ax.plot(*np.array(STILL, float).T, "s", mfc="none", mec=BLACK, ms=8, label="still points of SOURCE.md")
    ax.set(xlabel="x, px", ylabel="y, px", xlim=(0, 639), ylim=(359, 0))
    ax.set_title("c  Avalanche: a pair, by status")
    ax.legend(loc="upper left", bbox_to_anchor=(0, -0.24), ncols=2, frameon=False, borderaxespad=0)


def draw_wedge(ax: Axes, medians: Floats) -> None:
    """Median difference to PIVlab with the median absolute deviation."""
    ax.axhspan(-0.1, 0.1, color="0.92", label="within 0.1 px")
    ax.axhline(0, color=GREY, lw=0.8)
    for k, (label, colour, marker) in enumerate((("u", VERMILION, "o"), ("v", BLUE, "s"))):
        x = medians[:, 0] + (-0.12, 0.12)[k]
        look = {"color": colour, "marker": marker, "label": label}
        ax.errorbar(x, medians[:, 1 + k], medians[:, 3 + k], lw=0.9, **look)
    ax.set(xlabel="first frame of the pair", ylabel="correlate less PIVlab, px", ylim=(-0.32, 0.32))
    ax.set_xticks(range(500, 519, 3))
    ax.set_title("d  Wedge: difference to PIVlab, median and MAD of the nodes")
    ax.legend(loc="upper left", ncols=3)


def draw_honesty(ax: Axes, honesty: list[tuple[str, float, float]]) -> None:
    """Scatter that was found against the std that was predicted."""
    limits = np.array([0.002, 0.2])
    ax.loglog(limits, limits, color=GREY, lw=0.8)
    ax.loglog(limits, 2 * limits, color=GREY, lw=0.8, ls="--")
    names = list(dict.fromkeys(name for name, *_ in honesty))
    for name, colour, marker in zip(names, (BLACK, BLUE, ORANGE, PURPLE), "os^D", strict=True):
        values = [(predicted, found) for n, predicted, found in honesty if n == name]
        ax.plot(*np.array(values).T, marker, color=colour, ms=6, label=name)
    ax.annotate("equal", (0.13, 0.12), color=GREY, fontsize=8, va="top")
    ax.annotate("twice", (0.08, 0.17), color=GREY, fontsize=8, ha="right", va="center")
    ax.set(xlabel="predicted std, px", ylabel="scatter found, px", xlim=limits, ylim=limits)
    ax.set_title("e  Scatter found against the std predicted")
    ax.legend(loc="lower right")
