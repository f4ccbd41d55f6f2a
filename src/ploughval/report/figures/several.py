"""Several tests together: scatter of repeats, mean force and spread, trends over depth, mean errors."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ploughval.compare.several import MeanError, MeanHistory, Repeat, Trend
from ploughval.report.figures.look import legend_outside, narrow
from ploughval.report.figures.style import GRID, INK, MEASURED, MODEL, MUTED, new_figure, plain, styled
from ploughval.report.text import label, unit

Floats = NDArray[np.float64]
FARTHEST_PER_CENT = 50.0
FARTHEST_ERROR = 8.0
_MOST_POINTS = 300


@styled
def scatter_figure(repeats: Sequence[Repeat]) -> Figure:
    """Values of repeated tests about their mean, in per cent of it, beside what they state of themselves.

    Parameters
    ----------
    repeats : sequence of Repeat
        One row each, means other than 0; beyond 50 % dots stand at the edge.
    """
    figure = new_figure(text_in=0.75 + 0.34 * len(repeats))
    axes = figure.subplots()
    rows = np.arange(len(repeats))[::-1].astype(float)
    for row, repeat in zip(rows, repeats, strict=True):
        pooled, per_cent = repeat.pooled, 100 / abs(repeat.pooled.mean)
        if np.isfinite(pooled.stated_std):
            reach = min(pooled.stated_std * per_cent, FARTHEST_PER_CENT)
            axes.barh(row, 2 * reach, 0.62, left=-reach, color=MUTED, alpha=0.3, lw=0)
        reach = min(pooled.std * per_cent, FARTHEST_PER_CENT)
        colour = MODEL if pooled.verdict == "more" else MEASURED
        axes.plot([-reach, reach], [row - 0.2] * 2, color=colour, lw=3, solid_capstyle="butt")
        values = (np.array(repeat.values) - pooled.mean) * per_cent
        inside = np.abs(values) <= FARTHEST_PER_CENT
        axes.plot(values[inside], np.full(inside.sum(), row + 0.08), "o", ms=4.5, color=colour, alpha=0.75)
        for side, marker in ((1, ">"), (-1, "<")):
            beyond = int(np.sum(~inside & (np.sign(values) == side)))
            axes.plot([side * FARTHEST_PER_CENT] * beyond, [row + 0.08] * beyond, marker, color=colour, ms=7)
    axes.axvline(0, color=INK, lw=0.8)
    _rows(axes, rows, [_named(repeat.metric, repeat.unit) for repeat in repeats])
    axes.set_xlabel("off the mean, %" if narrow() else "difference from the mean of the tests, %")
    axes.barh(np.nan, 0, color=MUTED, alpha=0.3, label="stated")
    axes.plot([], [], color=MEASURED, lw=3, label="s between tests")
    if any(repeat.pooled.verdict == "more" for repeat in repeats):
        axes.plot([], [], color=MODEL, lw=3, label="s, more than stated")
    legend_outside(figure, *axes.get_legend_handles_labels())
    return figure


@styled
def envelope_figure(history: MeanHistory) -> Figure:
    """Force of repeated tests, their mean and standard deviation; below, with switches made to coincide.

    Parameters
    ----------
    history : MeanHistory
        Of one group.
    """
    both = history.aligned is not None and history.aligned_mean is not None
    figure = new_figure(5.6 if both else 3.2)
    panels = figure.subplots(2 if both else 1, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    measure = f"P / ({history.scale})" if history.scale else "P, N"
    _envelope(panels[0], history.u_d, history.forces, history.mean, history.std)
    panels[0].set_ylabel(f"{measure}\nat equal travel")
    if both and history.aligned is not None:
        mean, std = history.aligned_mean, history.aligned_std
        assert mean is not None
        assert std is not None
        _envelope(panels[1], history.u_d, history.aligned, mean, std)
        panels[1].set_ylabel(f"{measure}\nswitches aligned")
    panels[-1].set_xlabel("u / d")
    panels[0].set_ylim(bottom=min(0.0, panels[0].get_ylim()[0]))
    legend_outside(figure, *panels[0].get_legend_handles_labels())
    return figure


def _envelope(axes: Axes, u_d: Floats, forces: Floats, mean: Floats, std: Floats) -> None:
    every = -(-u_d.size // _MOST_POINTS)
    place = slice(None, None, every)
    for number, force in enumerate(forces):
        axes.plot(
            u_d[place], force[place], color=MUTED, lw=0.7, alpha=0.6, label=None if number else "single tests"
        )
    axes.fill_between(
        u_d[place],
        (mean - std)[place],
        (mean + std)[place],
        color=MEASURED,
        alpha=0.25,
        lw=0,
        label="mean ± s",
    )
    axes.plot(u_d[place], mean[place], color=MEASURED, lw=1.8, label="mean")


@styled
def trends_figure(trends: Sequence[Trend]) -> Figure:
    """Scaled metrics against depth: measured with standard uncertainty and line, predicted beside them.

    Parameters
    ----------
    trends : sequence of Trend
        One panel each; each with a measured line.
    """
    height = (len(trends) + 1) // 2
    figure = new_figure(0.6 + 1.75 * height)
    panels = figure.subplots(height, 2, sharex=True, squeeze=False)
    for axes, trend in zip(panels.flat, trends, strict=False):
        _trend(axes, trend)
    for axes in list(panels.flat)[len(trends) :]:
        axes.set_visible(False)
    for axes in list(panels.flat)[max(0, len(trends) - 2) : len(trends)]:
        axes.set_xlabel("depth d, mm")
        axes.tick_params(labelbottom=True)
    legend_outside(figure, *panels.flat[0].get_legend_handles_labels(), columns=4)
    return figure


def _trend(axes: Axes, trend: Trend) -> None:
    over = np.geomspace(trend.depth_mm.min(), trend.depth_mm.max(), 30)
    std = np.where(np.isfinite(trend.stds), trend.stds, 0.0)
    axes.errorbar(
        trend.depth_mm,
        trend.values,
        yerr=std,
        fmt="o",
        ms=4,
        color=MEASURED,
        elinewidth=0.9,
        label="measured ± std",
    )
    axes.plot(trend.depth_mm, trend.models, "s", ms=6, mfc="none", mec=MODEL, label="predicted")
    for line, colour, dash in ((trend.measured, MEASURED, "-"), (trend.predicted, MODEL, "--")):
        if line is not None:
            axes.plot(over, line.at(np.log(over)), dash, color=colour, lw=1.2)
    divided = " / " if trend.scale_power else ", "
    axes.set_title(plain(label(trend.metric)) + (divided + plain(unit(trend.scale)) if trend.scale else ""))
    shown = np.concatenate([trend.values - std, trend.values + std, trend.models[np.isfinite(trend.models)]])
    low, high = float(shown.min()), float(shown.max())
    # A quantity that hardly changes is shown flat: the axis spans a tenth of its size at least.
    room = max(0.12 * (high - low), 0.05 * abs(high + low) / 2 - (high - low) / 2, 1e-12)
    axes.set_ylim(low - room, high + room)


@styled
def power_figure(trend: Trend) -> Figure:
    """A force against depth, both logarithmic, with the fitted power and the one without effect of depth.

    Parameters
    ----------
    trend : Trend
        With a power.

    Raises
    ------
    ValueError
        A trend without a power.
    """
    line = trend.power
    if line is None:
        raise ValueError("a trend without a power has nothing to draw")
    figure = new_figure(3.0)
    axes = figure.subplots()
    grow = (trend.depth_mm / np.exp(line.centre)) ** trend.scale_power
    axes.errorbar(
        trend.depth_mm,
        trend.values * grow,
        yerr=np.where(np.isfinite(trend.stds), trend.stds, 0.0) * grow,
        fmt="o",
        ms=4.5,
        color=MEASURED,
        elinewidth=0.9,
        label="measured ± std",
    )
    axes.plot(trend.depth_mm, trend.models * grow, "s", ms=6.5, mfc="none", mec=MODEL, label="predicted")
    d = np.geomspace(trend.depth_mm.min(), trend.depth_mm.max(), 20)
    size = np.exp(line.level - trend.scale_power * line.centre)
    ratio = d / np.exp(line.centre)
    axes.plot(d, size * ratio**line.slope, color=MEASURED, lw=1.4, label=f"power {line.slope:.3f}")
    axes.plot(d, size * ratio**trend.scale_power, ":", color=INK, lw=1.2, label=f"power {trend.scale_power}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    ticks = np.unique(trend.depth_mm.round(3))
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    low, high = axes.get_ylim()
    heights = [step * 10.0**power for power in range(-9, 10) for step in (1, 2, 5)]
    heights = [height for height in heights if low <= height <= high]
    axes.set_yticks(heights, [f"{height:g}" for height in heights])
    axes.minorticks_off()
    axes.set_xlabel("depth d, mm")
    axes.set_ylabel(f"{plain(label(trend.metric))} over its\nscale at {np.exp(line.centre):.3g} mm")
    legend_outside(figure, *axes.get_legend_handles_labels(), columns=4)
    return figure


@styled
def errors_figure(errors: Sequence[MeanError]) -> Figure:
    """Errors of all tests in their validation uncertainties, and the mean with its interval.

    Parameters
    ----------
    errors : sequence of MeanError
        One row each, with tests that can be judged; beyond 8 dots stand at the edge.
    """
    figure = new_figure(text_in=0.75 + 0.3 * len(errors))
    axes = figure.subplots()
    rows = np.arange(len(errors))[::-1].astype(float)
    axes.axvspan(-2, 2, color=GRID, lw=0, alpha=0.8)
    axes.axvline(0, color=INK, lw=0.8)
    for row, error in zip(rows, errors, strict=True):
        stds = np.array(error.validation_stds)
        known = np.isfinite(stds) & (stds > 0)
        if not known.any():
            continue
        with np.errstate(over="ignore"):  # beyond all numbers stands at the edge
            values = np.array(error.errors)[known] / stds[known]
        clipped = np.clip(values, -FARTHEST_ERROR, FARTHEST_ERROR)
        axes.plot(clipped, np.full(clipped.size, row), "o", ms=4, color=MUTED, alpha=0.6)
        most = float(stds[known].max())
        size = most * float(np.sqrt(np.mean((stds[known] / most) ** 2)))
        colour = MODEL if error.mean_agrees is False else MEASURED
        low, high = (np.clip(end / size, -FARTHEST_ERROR, FARTHEST_ERROR) for end in (error.low, error.high))
        axes.plot([low, high], [row, row], color=colour, lw=2)
        mean = np.clip(error.pooled.pooled / size, -FARTHEST_ERROR, FARTHEST_ERROR)
        axes.plot(mean, row, "D", ms=6, color=colour)
    _rows(axes, rows, [_named(error.metric, error.scale) for error in errors])
    axes.set_xlim(-FARTHEST_ERROR * 1.03, FARTHEST_ERROR * 1.03)
    axes.set_xlabel("E / u_val" if narrow() else "E / u_val, model − experiment (grey band: a test agrees)")
    axes.plot([], [], "o", ms=4, color=MUTED, label="tests")
    axes.plot([], [], "D-", ms=6, color=MEASURED, label="mean, 95 %")
    legend_outside(figure, *axes.get_legend_handles_labels(), columns=2)
    return figure


def _named(metric: str, measure: str) -> str:
    """A metric's name with its unit, for metrics of one name and two units."""
    shown = unit(measure)
    return plain(f"{label(metric)}, {shown}" if shown else label(metric))


def _rows(axes: Axes, rows: Floats, names: Sequence[str]) -> None:
    """Names of rows on the left, nothing else there."""
    axes.set_yticks(rows, list(names))
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.spines["left"].set_visible(False)
    axes.set_ylim(-0.6, len(rows) - 0.4)
