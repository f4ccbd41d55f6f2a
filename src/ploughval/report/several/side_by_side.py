"""Chapters: force curves, metrics and bands of several tests beside each other."""

from collections.abc import Callable, Sequence

from ploughval.report.blocks import BAND_HEAD, Cell, Chapter, Pen, Table, band_rows, pair_cell
from ploughval.report.figures import forces_figure
from ploughval.report.figures.series import MOST_NAMES, History
from ploughval.report.several.findings import SeveralFindings
from ploughval.report.text import MISSING, number
from ploughval.report.verdict import by_topic, named, topic
from ploughval.results import MetricEntry, Results

MOST_COLUMNS = 8  # tests side by side; more stand below each other
MOST_OPEN = 20  # rows of a table of metrics that is not folded


def forces_chapter(found: SeveralFindings, pen: Pen) -> Chapter | None:
    """Measured and predicted force curves, each divided by its own P0 and depth."""
    tests, names = found.tests, found.names
    legend = ""
    if len(tests) > MOST_NAMES:
        legend = " Tests of one group have one colour."
        names = [f"group {found.group_label(place)}" for place in range(len(tests))]
    histories = [
        History(name, test.depth_mm, test.P0_N, test.force, test.model_force)
        for name, test in zip(names, tests, strict=True)
        if test.depth_mm and test.P0_N
    ]
    drawings = []
    for measured, word in ((True, "measured"), (False, "predicted")):
        shown = dict.fromkeys(h.name for h in histories if (h.force if measured else h.model) is not None)
        if shown:
            drawings.append(
                pen.draw(
                    forces_figure(histories, measured=measured),
                    f"Normalised force against displacement, {word}, of {', '.join(shown)}.",
                    f"Force {word}, each test divided by its own P₀ and depth.{legend}",
                    name=f"forces-{word}",
                )
            )
    bare = [
        name
        for name, test in zip(found.names, tests, strict=True)
        if test.force is not None and not (test.depth_mm and test.P0_N)
    ]
    notes = [f"{name}: no depth or no P₀ to divide by; its force is on its own page alone." for name in bare]
    return Chapter("force", "Force", drawings=drawings, notes=notes) if drawings or notes else None


def metrics_chapter(found: SeveralFindings) -> Chapter | None:
    """Every metric of every test: tests in columns, or in rows where there are many."""
    entries: dict[str, MetricEntry] = {}
    for test in found.tests:
        if test.metrics is not None:
            entries |= {name: metric for name, metric in test.metrics.metrics.items() if name not in entries}
    if not entries:
        return None
    entries = by_topic(entries)
    tables: list[Table] = []
    for title, pick in (("Experiment ± std", _experiment), ("Model ± std", _model), ("Error E", _error)):
        lay_out = _in_columns if len(found.tests) <= MOST_COLUMNS else _in_rows
        tables += lay_out(found, entries, title, pick)
    return Chapter("metrics", "Metrics", lead="The mark of an error says whether it agrees.", tables=tables)


Pick = Callable[[MetricEntry | None], Cell]


def _in_columns(
    found: SeveralFindings, entries: dict[str, MetricEntry], title: str, pick: Pick
) -> list[Table]:
    rows = [
        [Cell(named(name, metric)), *(pick(test.metric(name)) for test in found.tests)]
        for name, metric in entries.items()
    ]
    rows = [row for row in rows if any(cell.text != MISSING for cell in row[1:])]
    return [Table(title, ("Metric", *found.names), rows, folded=len(rows) > MOST_OPEN)] if rows else []


def _in_rows(found: SeveralFindings, entries: dict[str, MetricEntry], title: str, pick: Pick) -> list[Table]:
    """One table a topic and half a dozen metrics, tests below each other: as wide as a sheet of paper."""
    tables = []
    for subject in dict.fromkeys(topic(name) for name in entries):
        names = [name for name in entries if topic(name) == subject and _held(found.tests, name, pick)]
        for start in range(0, len(names), 6):
            chosen = names[start : start + 6]
            rows = [
                [Cell(name), *(pick(test.metric(metric)) for metric in chosen)]
                for name, test in zip(found.names, found.tests, strict=True)
            ]
            head = ("Test", *(named(metric, entries[metric]) for metric in chosen))
            part = f" ({start // 6 + 1})" if len(names) > 6 else ""
            tables.append(Table(f"{title}: {subject}{part}", head, rows, folded=True))
    return tables


def _held(tests: Sequence[Results], name: str, pick: Pick) -> bool:
    return any(pick(test.metric(name)).text != MISSING for test in tests)


def _experiment(metric: MetricEntry | None) -> Cell:
    if metric is None:
        return Cell(MISSING)
    return pair_cell(metric.experiment, metric.experiment_std)


def _model(metric: MetricEntry | None) -> Cell:
    return Cell(MISSING) if metric is None else pair_cell(metric.model, metric.model_std)


def _error(metric: MetricEntry | None) -> Cell:
    if metric is None:
        return Cell(MISSING)
    mark = {True: "agrees", False: "differs", None: "unknown"}[metric.agrees]
    return Cell(number(metric.error, 3), metric.error, mark)


def bands_chapter(found: SeveralFindings) -> Chapter | None:
    """Measured and predicted bands of every test."""
    rows = []
    for name, test in zip(found.names, found.tests, strict=True):
        for source, bands in (("measured", test.bands), ("predicted", test.model_bands)):
            rows += [[Cell(name), *row] for row in band_rows(bands, source)]
    head = ("Test", *BAND_HEAD)
    table = Table("Shear bands", head, rows, folded=len(found.tests) > MOST_COLUMNS)
    return Chapter("bands", "Shear bands", tables=[table]) if rows else None
