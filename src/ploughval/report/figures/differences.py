"""Measured lines coloured by their distance from the predicted ones, and the distances of a whole test."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke
from numpy.typing import NDArray

from ploughval.report.figures.look import narrow
from ploughval.report.figures.style import ON_PHOTO_HALO, new_figure, styled

Floats = NDArray[np.float64]
# From far below over just below to just above and far above: blue and brown, told apart without green or
# red, darker the further off, so that a print without colour still shows how far.
STEPS = ("#08306b", "#1764ab", "#4a97c9", "#7fb8dc", "#efa35c", "#dd6f1e", "#b04708", "#742a04")
NEUTRAL = "#6f757c"
ON_COLOUR = "#101214"  # what is drawn over a photograph or over colours, alike on pale and on dark pages
_ALONE, _NEUTRAL = -2, -1  # classes of line beside the steps: nothing to compare with; within 2 u
_WIDTH = 2.4


@dataclass(frozen=True, slots=True, eq=False)
class ColouredLine:
    """A measured line at one stage.

    ``points_mm`` (N, 2), rows of NaN at tears; ``distance_mm`` (N,) above (+) or below (-) the predicted
    line, NaN where there is none; ``credible`` (N,) whether that is more than twice its standard uncertainty.
    """

    points_mm: Floats
    distance_mm: Floats
    credible: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Differences:
    """The lines of a stage, and the distance at which the colours end, the same at all stages."""

    lines: Sequence[ColouredLine]
    scale_mm: float

    @property
    def edges_mm(self) -> Floats:
        """Distances at which the colour changes."""
        return np.linspace(-self.scale_mm, self.scale_mm, len(STEPS) + 1)


def draw_differences(axes: Axes, differences: Differences, *, on_photo: bool) -> None:
    """Lines in runs of one colour; neutral within twice the uncertainty, thin without a predicted line."""
    runs: dict[int, list[Floats]] = defaultdict(list)
    for line in differences.lines:
        for kind, points in _runs(line, differences.edges_mm):
            runs[kind].append(points)
    for kind, pieces in sorted(runs.items()):
        width = 1.0 if kind == _ALONE else _WIDTH
        # A pale rim parts dark colours from a photograph, and from the dark ground of a dark page.
        rim = 1.6 if on_photo else 1.0
        halo = [Stroke(linewidth=width + rim, foreground=ON_PHOTO_HALO, alpha=0.85), Normal()]
        colour = NEUTRAL if kind < 0 else STEPS[kind]
        axes.add_collection(
            LineCollection(
                pieces, colors=colour, linewidths=width, capstyle="butt", zorder=4.5 if kind < 0 else 5,
                path_effects=halo,
            ),
            autolim=False,
        )  # fmt: skip


def coarsened(points: Floats, most: int = 1200) -> Floats:
    """Means of neighbours where a line has more points than a figure shows; gaps stay gaps."""
    size = -(-len(points) // most)
    whole = len(points) - len(points) % size if size else 0
    return points if size <= 1 else points[:whole].reshape(-1, size, 2).mean(axis=1)


def difference_bar(figure: Figure, axes: Sequence[Axes], differences: Differences) -> None:
    """The colours with their distances, below the panels."""
    norm = BoundaryNorm(differences.edges_mm, len(STEPS))
    shown = ScalarMappable(norm, ListedColormap(list(STEPS)))
    bar = figure.colorbar(
        shown, ax=list(axes), orientation="horizontal", aspect=45, pad=0.02, extend="both",
        ticks=differences.edges_mm[::2],
    )  # fmt: skip
    bar.ax.xaxis.set_major_formatter(lambda value, _: f"{value:+.3g}".replace("-", "−") if value else "0")
    between = "\n" if narrow() else "; "
    bar.set_label(f"measured above (+) or below (−) predicted, mm{between}grey: within 2 u")


def _runs(line: ColouredLine, edges: Floats) -> list[tuple[int, Floats]]:
    """Successive segments of one class as one piece."""
    points, d = line.points_mm, line.distance_mm
    if len(points) < 2:
        return []
    middle = 0.5 * (d[:-1] + d[1:])
    kind = np.clip(np.searchsorted(edges, np.nan_to_num(middle), side="right") - 1, 0, len(STEPS) - 1)
    kind = np.where(line.credible[:-1] | line.credible[1:], kind, _NEUTRAL)
    kind = np.where(np.isfinite(middle), kind, _ALONE)
    there = np.asarray(np.isfinite(points).all(axis=1))
    whole = np.asarray(there[:-1] & there[1:])
    change = np.flatnonzero((np.diff(kind) != 0) | (np.diff(whole) != 0)) + 1
    return [
        (int(kind[first]), points[first : last + 1])
        for first, last in zip(np.append(0, change), np.append(change, len(kind)), strict=True)
        if whole[first]
    ]


@styled
def distance_map_figure(table: pd.DataFrame) -> Figure:
    """Rms distance of every layer in every frame.

    Parameters
    ----------
    table : DataFrame
        u_mm, layer, rms_mm and validation_std_mm; crosses mark what is more than twice the uncertainty.
    """
    grid = table.pivot_table(index="layer", columns="u_mm", values="rms_mm", aggfunc="first")
    ratio = table.assign(ratio=table["rms_mm"] / table["validation_std_mm"])
    off = ratio[ratio["ratio"] > 2.0]
    rows = {height: k for k, height in enumerate(grid.index)}
    figure = new_figure(text_in=1.3 + 0.26 * max(len(rows), 2))
    axes = figure.subplots()
    image = axes.pcolormesh(
        _edges(grid.columns.to_numpy(float)), np.arange(len(rows) + 1) - 0.5, grid.to_numpy(float),
        cmap="cividis_r", vmin=0.0, rasterized=True,
    )  # fmt: skip
    axes.plot(
        off["u_mm"], [rows[height] for height in off["layer"]], "x", color=ON_COLOUR, ms=4, mew=1, zorder=4,
        path_effects=[Stroke(linewidth=2.6, foreground=ON_PHOTO_HALO, alpha=0.8), Normal()],
    )  # fmt: skip
    axes.set_yticks(list(rows.values()), [f"{height:g}" for height in rows])
    axes.grid(visible=False)
    axes.set_xlabel("u, mm")
    axes.set_ylabel("height of layer, mm")
    figure.colorbar(image, ax=axes, pad=0.02).set_label("rms distance, mm")
    return figure


def _edges(centres: Floats) -> Floats:
    """Borders half-way between places."""
    if len(centres) == 1:
        return np.asarray(centres[0] + np.array([-0.5, 0.5]))
    inner = 0.5 * (centres[:-1] + centres[1:])
    ends = 2 * centres[[0, -1]] - inner[[0, -1]]
    return np.concatenate([ends[:1], inner, ends[1:]])
