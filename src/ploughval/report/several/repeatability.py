"""Chapter: how tests that repeat each other scatter, against what each states of itself."""

from collections.abc import Sequence
from typing import Protocol, TypeVar

from ploughval.compare.several import Pooled, Repeat
from ploughval.report.blocks import Cell, Chapter, Drawing, Pen, Table, value_cell
from ploughval.report.figures.several import envelope_figure, scatter_figure
from ploughval.report.several.findings import SeveralFindings
from ploughval.report.text import MISSING, label, number, unit
from ploughval.report.verdict import topic

HEAD = (
    "Metric",
    "Tests",
    "Mean",
    "s_r (95 %)",
    "Stated u",
    "Birge ratio",
    "Excess τ (95 %)",
    "Pooled value (95 %)",
    "Than stated",
)
MOST_GROUPS = 2  # whose figures and tables are shown at once
_WORDS = {
    "explained": ("as stated", "agrees"),
    "more": ("more", "differs"),
    "less": ("less", ""),
    "unknown": ("none stated", "unknown"),
}
LEAD = (
    "s_r is the repeatability standard deviation of ISO 5725-2: of tests under equal conditions in one "
    "laboratory, each on a bed made anew, so that making the bed is part of it. Two such tests differ by "
    "less than 2.8 s_r in 95 % of cases. Reproducibility between laboratories cannot be told from these "
    "tests. Stated u is the root mean square of the tests' own standard uncertainties; a Birge ratio of 1 "
    "says that they explain the scatter, τ is the standard deviation between tests that they do not "
    "explain."
)


def repeatability_chapter(found: SeveralFindings, pen: Pen) -> Chapter | None:
    """Scatter between the tests of each group; absent where no test repeats another."""
    if not found.repeats and not found.histories:
        return None
    drawings: list[Drawing] = []
    tables: list[Table] = []
    notes: list[str] = []
    shown = _by_size(found)[:MOST_GROUPS]
    tables += [_summary(found)] if found.repeats else []
    for group in _by_size(found):
        repeats = found.repeats.get(group, [])
        for subject, some in by_subject(repeats).items():
            if group in shown:
                drawings += _scatter(some, f"Group {group}, {subject.lower()}", pen)
            title = f"Repeatability, group {group}: {subject.lower()}"
            rows = [_row(repeat) for repeat in some]
            tables.append(Table(title, HEAD, rows, kind="wide", folded=group not in shown))
        notes += _notes(found, repeats)
    for group in shown:
        history = found.histories.get(group)
        if history is not None:
            words = f"Group {group}: measured force of {len(history.tests)} tests over travel."
            caption = words + _envelope_words(found, group)
            drawings.append(pen.draw(envelope_figure(history), words, caption, name=f"mean-force-{group}"))
    if len({*found.repeats, *found.histories}) > MOST_GROUPS:
        notes.append(
            f"Figures are of the {MOST_GROUPS} groups with the most tests; the tables of others are folded."
        )
    tables += [*_switches(found), *_levels(found)]
    return Chapter("repeatability", "Repeatability", lead=LEAD, drawings=drawings, tables=tables, notes=notes)


def _by_size(found: SeveralFindings) -> list[str]:
    """Labels of groups, those with the most tests first."""
    groups = sorted(found.grouping.groups, key=lambda group: -len(group.members))
    return [group.label for group in groups if len(group.members) > 1]


class Named(Protocol):
    """Anything that is found of a metric."""

    @property
    def metric(self) -> str:
        """Its name."""


Item = TypeVar("Item", bound=Named)


def by_subject(items: Sequence[Item]) -> dict[str, list[Item]]:
    """What is found of metrics, by what they are about."""
    subjects: dict[str, list[Item]] = {}
    for item in items:
        subjects.setdefault(topic(item.metric), []).append(item)
    return subjects


def _scatter(repeats: Sequence[Repeat], of: str, pen: Pen) -> list[Drawing]:
    """Values about their mean; those that are all alike or about 0 are in the table alone."""
    drawn = [repeat for repeat in repeats if abs(repeat.pooled.mean) > 0 and repeat.pooled.std > 0]
    if not drawn:
        return []
    words = f"{of}: scatter between tests, in per cent of the mean of each metric."
    caption = "Dots: tests. Line: ± s_r. Grey: ± the standard uncertainty that the tests state."
    return [pen.draw(scatter_figure(drawn), words, f"{words} {caption}", name=f"scatter-{of}")]


def interval(low: float, high: float) -> str:
    """An interval's two ends; a dash where there is none."""
    return MISSING if low != low or high != high else f"{number(low, 3)} to {number(high, 3)}"


def with_interval(value: float, low: float, high: float) -> Cell:
    """A cell with a value and its interval."""
    if value != value:
        return Cell(MISSING)
    ends = interval(low, high)
    return Cell(number(value, 3) if ends == MISSING else f"{number(value, 3)} ({ends})", value)


def metric_words(name: str, measure: str) -> str:
    """A metric's name with a unit, or with what it was divided by."""
    shown = unit(measure)
    return f"{label(name)}, {shown}" if shown else label(name)


def _row(repeat: Repeat) -> list[Cell]:
    pooled = repeat.pooled
    word, mark = _WORDS[pooled.verdict]
    return [
        Cell(metric_words(repeat.metric, repeat.unit)),
        value_cell(pooled.count),
        value_cell(pooled.mean),
        with_interval(pooled.std, pooled.std_low, pooled.std_high),
        value_cell(pooled.stated_std, 3),
        value_cell(pooled.birge, 3),
        with_interval(pooled.excess_std, pooled.excess_low, pooled.excess_high),
        with_interval(pooled.pooled, pooled.pooled_low, pooled.pooled_high),
        Cell(word, mark=mark),
    ]


def _summary(found: SeveralFindings) -> Table:
    """Of each group, how many metrics scatter as their tests state."""
    rows = [[Cell(group), *map(value_cell, found.scatter(group).values())] for group in found.repeats]
    notes = (
        "At 95 % one metric in twenty is called otherwise by chance.",
        "Scatter below what is stated is no fault: parts common to all tests (calibration, width, the same "
        "empty runs) do not show as scatter, nor do they average out.",
    )
    head = ("Group", "Metrics judged", "Scatter as stated", "More", "Less")
    return Table("Do the stated uncertainties explain the scatter?", head, rows, footnotes=notes)


def _notes(found: SeveralFindings, repeats: Sequence[Repeat]) -> list[str]:
    said = []
    for repeat in repeats:
        if repeat.pooled.outlier >= 0:
            name = found.names[repeat.tests[repeat.pooled.outlier]]
            value = number(repeat.values[repeat.pooled.outlier])
            said.append(
                f"{metric_words(repeat.metric, repeat.unit)}: {value} of {name} is an outlier at 1 % "
                "(Grubbs); it was kept."
            )
    return said


def _envelope_words(found: SeveralFindings, group: str) -> str:
    history = found.histories[group]
    spread = float((history.std**2).mean() ** 0.5)
    stated = float((history.stated_std**2).mean() ** 0.5)
    of = f" {history.scale}" if history.scale else " N"
    said = f" Band: mean ± s between tests, {number(spread, 2)}{of} rms; stated {number(stated, 2)}{of}."
    if history.aligned_std is None:
        return said + " Not every test has a switch: nothing was aligned."
    inside = history.aligned_std[history.aligned_std == history.aligned_std]
    aligned = float((inside**2).mean() ** 0.5) if inside.size else float("nan")
    common = history.switches_d.shape[1]
    which = "first switch coincides" if common == 1 else f"first {common} switches coincide"
    return f"{said} Below: travel stretched so that the {which}: {number(aligned, 2)}{of}."


def _switches(found: SeveralFindings) -> list[Table]:
    rows = []
    for group, history in found.histories.items():
        for number_, pooled in enumerate(history.switches):
            rows.append([Cell(f"{group}, switch {number_ + 1}"), *_place(pooled)])
    head = ("Group and switch", "Tests", "Mean u / d", "s_r (95 %)", "Stated u", "Than stated")
    counts = [
        f"Group {group}: within the common travel tests have {_either(history.switch_counts)} switches; the "
        "first of each are compared, which need not be the same event."
        for group, history in found.histories.items()
        if len(set(history.switch_counts)) > 1
    ]
    return [Table("Places of the switches", head, rows, footnotes=counts)] if rows else []


def _either(counts: Sequence[int]) -> str:
    return " or ".join(map(str, sorted(set(counts))))


def _place(pooled: Pooled) -> list[Cell]:
    word, mark = _WORDS[pooled.verdict]
    return [
        value_cell(pooled.count),
        value_cell(pooled.mean),
        with_interval(pooled.std, pooled.std_low, pooled.std_high),
        value_cell(pooled.stated_std, 3),
        Cell(word, mark=mark),
    ]


def _levels(found: SeveralFindings) -> list[Table]:
    rows = [
        [
            Cell(metric_words(level.metric, level.scale)),
            value_cell(level.groups),
            value_cell(level.dof),
            with_interval(level.std, level.std_low, level.std_high),
        ]
        for level in found.levels
    ]
    head = ("Metric, scaled", "Groups", "Degrees of freedom", "s_r (95 %)")
    caption = "Repeatability over all groups, of scaled metrics"
    return [Table(caption, head, rows)] if rows else []
