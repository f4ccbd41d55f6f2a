"""Figures of whole sequences: every case against the figures to reach."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drawing.style import BLUE, GREY, VERMILION, save, style
from sequences.rows import Row

SHOWN = {
    "last frame, moved, median [px]": "tracks at the end, median, px",
    "last frame, moved, 95 % [px]": "tracks at the end, 95 %, px",
    "track errors within one std [%]": "tracks within one std, %",
    "track errors within two std [%]": "tracks within two std, %",
    "free surface, rms [px]": "free surface, rms, px",
    "blade face, rms [px]": "blade face, rms, px",
    "layers (dye), median [px]": "dyed layers, median, px",
    "layers (dye), 95 % [px]": "dyed layers, 95 %, px",
    "layers (tracks), median [px]": "tracked layers, median, px",
    "layers (tracks), 95 % [px]": "tracked layers, 95 %, px",
    "bands, largest error of start [frame intervals]": "band start, frame intervals",
    "bands, largest error of outcrop [mm]": "band outcrop, mm",
    "bands, largest error of beta [degree]": "band inclination, degrees",
    "bands missed [1]": "bands missed",
    "bands invented [1]": "bands invented",
}


def draw_cases(tables: Mapping[str, Sequence[Row]], path: Path) -> None:
    """A panel a figure: one dot a case, red where it is missed, the figure to reach as a line."""
    with style():
        figure = Figure(figsize=(11.0, 0.4 * len(tables) + 2.0), layout="constrained")
        axes = figure.subplots(3, 5, sharey=True)
        names = list(tables)[::-1]
        for ax, (label, title) in zip(axes.flat, SHOWN.items(), strict=True):
            _panel(ax, [_find(tables[name], label) for name in names])
            ax.set_title(title, fontsize=8)
        for ax in axes[:, 0]:
            ax.set_yticks(range(len(names)), names, fontsize=7)
        save(figure, path.with_suffix(""))


def _panel(ax: Axes, rows: Sequence[Row | None]) -> None:
    for place, row in enumerate(rows):
        if row is None or not np.isfinite(row.value):
            ax.annotate(
                "not there", (0.02, place), xycoords=("axes fraction", "data"), fontsize=6, va="center"
            )
            continue
        ax.plot(row.value, place, "o", color=VERMILION if row.reached is False else BLUE, markersize=4)
        for limit in (row.least, row.most):
            if limit is not None:
                ax.axvline(limit, color=GREY, linewidth=0.8, zorder=0)
    ax.set_ylim(-0.7, len(rows) - 0.3)
    ax.tick_params(axis="x", labelsize=7)
    there = [row for row in rows if row is not None]
    if not any(row.least is not None for row in there):
        far = [1.15 * most for row in there if (most := row.most) is not None]
        far += [1.1 * row.value for row in there if np.isfinite(row.value)]
        ax.set_xlim(0, max(far, default=0.0) or 1.0)


def _find(rows: Sequence[Row], label: str) -> Row | None:
    return next((row for row in rows if row.label == label), None)
