"""Chapter: model against experiment over all tests."""

from ploughval.compare.several import MeanError
from ploughval.report.blocks import Cell, Chapter, Pen, Table, value_cell
from ploughval.report.figures.several import errors_figure
from ploughval.report.several.findings import SeveralFindings
from ploughval.report.several.repeatability import by_subject, metric_words, with_interval
from ploughval.report.text import label

LEAD = (
    "E is model minus experiment, forces in γd²B/2 and lengths in d so that depths compare. The mean's 95 "
    "% interval holds the scatter of E between tests, which averages out, and whole what does not or may "
    "not: the model's uncertainty, for the friction angles and unit weight of one sand are the same error "
    "in all its tests, and the stated uncertainty of the measurement, for no file says how much of it the "
    "tests share."
)
HEAD = (
    "Metric, scaled",
    "Tests",
    "Mean E (95 %)",
    "s of E (95 %)",
    "u of the model, common",
    "Agree",
    "Mean agrees",
)


def errors_chapter(found: SeveralFindings, pen: Pen) -> Chapter | None:
    """Mean error of every metric; absent where no two tests have one."""
    if not found.errors:
        return None
    drawings, tables = [], []
    for subject, errors in by_subject(found.errors).items():
        tables.append(Table(f"Mean errors: {subject.lower()}", HEAD, [_row(e) for e in errors], kind="wide"))
        judged = [error for error in errors if error.mean_agrees is not None]
        if not judged:
            continue
        outside = [label(error.metric) for error in judged if error.mean_agrees is False]
        said = (
            f"Means that differ from zero: {', '.join(outside)}." if outside else "No mean differs from zero."
        )
        words = f"{subject}: errors of {len(judged)} metrics in validation uncertainties. {said}"
        drawings.append(pen.draw(errors_figure(judged), words, words, name=f"mean-errors-{subject}"))
    return Chapter("errors", "Model against experiment", lead=LEAD, drawings=drawings, tables=tables)


def _row(error: MeanError) -> list[Cell]:
    pooled = error.pooled
    words = {True: ("yes", "agrees"), False: ("no", "differs"), None: ("unknown", "unknown")}
    word, mark = ("a distance", "") if error.distance else words[error.mean_agrees]
    agree = f"{error.agree} / {error.judged}" if error.judged else ""
    return [
        Cell(metric_words(error.metric, error.scale)),
        value_cell(pooled.count),
        with_interval(pooled.pooled, error.low, error.high),
        with_interval(pooled.std, pooled.std_low, pooled.std_high),
        value_cell(error.input_std, 3),
        Cell(agree, float(error.agree) if error.judged else None),
        Cell(word, mark=mark),
    ]
