"""Chapter: what depth does to metrics in units of it, and the powers of depth."""

import numpy as np

from ploughval.compare.several import Line, Trend
from ploughval.report.blocks import Cell, Chapter, Pen, Table, value_cell
from ploughval.report.figures.several import power_figure, trends_figure
from ploughval.report.several.findings import SeveralFindings
from ploughval.report.several.repeatability import by_subject, interval, metric_words, with_interval
from ploughval.report.text import MISSING, label, number

LEAD = (
    "Forces are divided by γd²B/2, lengths by d: in the model nothing then depends on depth but through "
    "the mobilization length over d. A weighted line over ln d says by how much a metric changes from "
    "the shallowest to the deepest test; scatter beyond what the tests state widens its 95 % interval."
)
HEAD = (
    "Metric, scaled",
    "Tests",
    "Level",
    "Change, measured (95 %)",
    "Change, predicted",
    "Unpredicted (95 %)",
    "Says",
)
POWER_HEAD = ("Metric", "Tests", "Power of d, measured (95 %)", "Predicted", "Without effect of depth")
_SAYS = {
    "none": ("no effect of depth can be told", "agrees"),
    "predicted": ("changes as predicted", "agrees"),
    "unpredicted": ("changes, not as predicted", "differs"),
    "unknown": ("too few tests", "unknown"),
}
MOST_PANELS = 12
MOST_POWER = 10.0
NUMERICAL = 1e-3  # relative error that the model is run to
_PREFERRED = "first_peak_N"


def depth_chapter(found: SeveralFindings, pen: Pen) -> Chapter | None:
    """Trends over depth; absent where no two tests differ in depth alone."""
    if not found.trends:
        return None
    tables, drawings, notes = [], [], []
    for series in dict.fromkeys(trend.series for trend in found.trends):
        trends = [trend for trend in found.trends if trend.series == series]
        shown = _best_known(trends)
        words = f"Scaled metrics against depth, groups {series}: measured ± std, and predicted."
        drawings.append(pen.draw(trends_figure(shown), words, words, name=f"depth-trends-{series}"))
        if len(shown) < len(trends):
            left = len(trends) - len(shown)
            notes.append(
                f"Groups {series}: {left} metrics are in the tables alone; panels show the best known."
            )
        for subject, some in by_subject(trends).items():
            title = f"Change with depth, groups {series}: {subject.lower()}"
            tables.append(Table(title, HEAD, [_row(trend) for trend in some], kind="wide"))
        powers = [row for trend in trends if (row := _power(trend))]
        tables.append(Table(f"Powers of depth, groups {series}", POWER_HEAD, powers))
        powered = [trend for trend in trends if trend.unit == "N" and _sensible(trend)]
        powered.sort(key=lambda trend: trend.metric != _PREFERRED)
        if powered:
            words = _power_words(powered[0])
            drawings.append(pen.draw(power_figure(powered[0]), words, words, name=f"depth-power-{series}"))
        notes += _notes(series, trends)
    return Chapter("depth", "Effect of depth", lead=LEAD, drawings=drawings, tables=tables, notes=notes)


def _sensible(trend: Trend) -> bool:
    """Whether a power is one that can be drawn: not that of values many orders apart."""
    return trend.power is not None and abs(trend.power.slope - trend.scale_power) < MOST_POWER


def _best_known(trends: list[Trend]) -> list[Trend]:
    """The trends that panels are drawn of: those whose change is known best for their size."""

    def width(trend: Trend) -> float:
        _, low, high = _change(trend, trend.measured)
        size = abs(trend.measured.level) if trend.measured is not None else 0.0
        return (high - low) / size if size and np.isfinite(high - low) else np.inf

    chosen = sorted((trend for trend in trends if trend.measured is not None), key=width)[:MOST_PANELS]
    return [trend for trend in trends if any(trend is one for one in chosen)]


def _change(trend: Trend, line: Line | None) -> tuple[float, float, float]:
    """Change over the range of depths and its interval."""
    if line is None:
        return float("nan"), float("nan"), float("nan")
    span = float(np.log(trend.depth_mm.max() / trend.depth_mm.min()))
    return line.slope * span, line.slope_low * span, line.slope_high * span


def _row(trend: Trend) -> list[Cell]:
    word, mark = _SAYS[trend.verdict]
    level = float("nan") if trend.measured is None else trend.measured.level
    return [
        Cell(metric_words(trend.metric, trend.scale)),
        value_cell(len(trend.tests)),
        value_cell(level),
        with_interval(*_change(trend, trend.measured)),
        _predicted(trend, level),
        with_interval(*_change(trend, trend.beyond)),
        Cell(word, mark=mark),
    ]


def _predicted(trend: Trend, level: float) -> Cell:
    """The model's change; what its numerical error leaves of none is 0."""
    change = _change(trend, trend.predicted)[0]
    return value_cell(0.0 if abs(change) < NUMERICAL * abs(level) else change, 3)


def _power(trend: Trend) -> list[Cell]:
    if trend.power is None or not trend.scale_power:
        return []
    line = trend.power
    return [
        Cell(metric_words(trend.metric, trend.unit)),
        value_cell(len(trend.tests)),
        with_interval(line.slope, line.slope_low, line.slope_high),
        value_cell(trend.predicted_power, 4),
        value_cell(trend.scale_power),
    ]


def _power_words(trend: Trend) -> str:
    line = trend.power
    assert line is not None  # chosen for it
    ends = interval(line.slope_low, line.slope_high)
    said = f" (95 %: {ends})" if ends != MISSING else ""
    return (
        f"{label(trend.metric)} against depth, both logarithmic, width and unit weight taken out: power "
        f"{number(line.slope, 3)}{said}; {trend.scale_power} where the scaled force does not depend on depth."
    )


def _notes(series: str, trends: list[Trend]) -> list[str]:
    words = [trend.verdict for trend in trends]
    judged = len(words) - words.count("unknown")
    if not judged:
        return [f"Groups {series}: too few tests, or no stated uncertainty, to tell an effect of depth."]
    return [
        f"Groups {series}: of {judged} metrics {words.count('none')} show no effect of depth, "
        f"{words.count('predicted')} change as the model says, {words.count('unpredicted')} otherwise; at "
        f"95 % some {0.05 * judged:.1g} would be called otherwise by chance.",
    ]
