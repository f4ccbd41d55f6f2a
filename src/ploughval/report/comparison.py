"""Several tests side by side: forces on the same axes, metrics and bands in columns."""

from collections.abc import Sequence
from typing import Any

from ploughval.report.blocks import BAND_HEAD, Cell, Chapter, Pen, Table, Tile, band_rows
from ploughval.report.figures import forces_figure
from ploughval.report.figures.series import History
from ploughval.report.results import MetricEntry, Results
from ploughval.report.text import MISSING, number, with_std
from ploughval.report.verdict import by_topic, counts, named, verdict


def comparison_context(tests: Sequence[Results], pen: Pen) -> dict[str, Any]:
    """What the page of several tests shows."""
    names = _names(tests)
    chapters = [
        _overview(tests, names),
        _forces(tests, names, pen),
        _metrics(tests, names),
        _bands(tests, names),
    ]
    agree, differ = 0, 0
    for test in tests:
        if test.metrics is not None:
            one = counts(test.metrics.metrics)
            agree, differ = agree + one[0], differ + one[1]
    tiles = [Tile("tests", str(len(tests)))]
    if agree + differ:
        tiles.append(Tile("metrics agree", f"{agree} / {agree + differ}", "over all tests"))
    judged = f"{agree} of {agree + differ} metrics agree within twice the validation uncertainty."
    return {
        "title": f"{len(tests)} tests compared",
        "notes": "",
        "verdict": judged if agree + differ else "No metric of these tests can be judged.",
        "tiles": tiles,
        "chapters": [chapter for chapter in chapters if chapter is not None],
        "version": ", ".join(sorted({test.run.ploughval for test in tests if test.run.ploughval})),
    }


def _names(tests: Sequence[Results]) -> list[str]:
    """Names of the tests, numbered where two share one."""
    names = [test.name for test in tests]
    return [f"{name} ({place + 1})" if names.count(name) > 1 else name for place, name in enumerate(names)]


def _overview(tests: Sequence[Results], names: Sequence[str]) -> Chapter:
    rows = [
        [
            Cell(name),
            Cell(number(test.depth_mm, 3), test.depth_mm),
            Cell(number(test.P0_N), test.P0_N),
            Cell(verdict(test)),
        ]
        for name, test in zip(names, tests, strict=True)
    ]
    head = ("Test", "Depth d, mm", "P₀, N", "Verdict")
    return Chapter("overview", "Tests", tables=[Table("Tests", head, rows, kind="cards")])


def _forces(tests: Sequence[Results], names: Sequence[str], pen: Pen) -> Chapter | None:
    histories = [
        History(name, test.depth_mm or 1.0, test.P0_N or 1.0, test.force, test.model_force)
        for name, test in zip(names, tests, strict=True)
    ]
    drawings = []
    for measured, word in ((True, "measured"), (False, "predicted")):
        shown = [h.name for h in histories if (h.force if measured else h.model) is not None]
        if shown:
            drawings.append(
                pen.draw(
                    forces_figure(histories, measured=measured),
                    f"Normalised force against displacement, {word}, of {', '.join(shown)}.",
                    f"Force {word}, each test divided by its own P₀ and depth.",
                )
            )
    bare = [name for name, test in zip(names, tests, strict=True) if not (test.depth_mm and test.P0_N)]
    notes = [f"{name}: no depth or no P₀; its axes are in mm or N." for name in bare]
    return Chapter("force", "Force", drawings=drawings, notes=notes) if drawings else None


def _metrics(tests: Sequence[Results], names: Sequence[str]) -> Chapter | None:
    found: dict[str, MetricEntry] = {}
    for test in tests:
        if test.metrics is not None:
            found |= {name: metric for name, metric in test.metrics.metrics.items() if name not in found}
    if not found:
        return None
    tables = []
    for title, pick in (("Experiment ± std", _experiment), ("Model ± std", _model), ("Error E", _error)):
        rows = [
            [Cell(named(name, metric)), *(pick(test.metric(name)) for test in tests)]
            for name, metric in by_topic(found).items()
        ]
        rows = [row for row in rows if any(cell.text != MISSING for cell in row[1:])]
        if rows:
            tables.append(Table(title, ("Metric", *names), rows))
    return Chapter("metrics", "Metrics", lead="The mark of an error says whether it agrees.", tables=tables)


def _experiment(metric: MetricEntry | None) -> Cell:
    if metric is None:
        return Cell(MISSING)
    return Cell(with_std(metric.experiment, metric.experiment_std), metric.experiment)


def _model(metric: MetricEntry | None) -> Cell:
    return Cell(MISSING) if metric is None else Cell(with_std(metric.model, metric.model_std), metric.model)


def _error(metric: MetricEntry | None) -> Cell:
    if metric is None:
        return Cell(MISSING)
    mark = {True: "agrees", False: "differs", None: "unknown"}[metric.agrees]
    return Cell(number(metric.error, 3), metric.error, mark)


def _bands(tests: Sequence[Results], names: Sequence[str]) -> Chapter | None:
    rows = []
    for name, test in zip(names, tests, strict=True):
        for source, bands in (("measured", test.bands), ("predicted", test.model_bands)):
            rows += [[Cell(name), *row] for row in band_rows(bands, source)]
    head = ("Test", *BAND_HEAD)
    return Chapter("bands", "Shear bands", tables=[Table("Shear bands", head, rows)]) if rows else None
