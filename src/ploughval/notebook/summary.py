"""A test in a few lines of HTML, as notebooks show it."""

from collections.abc import Sequence
from html import escape

from ploughval.report.blocks import Table
from ploughval.report.verdict import agreement_tables, short_chapter, verdict
from ploughval.results import Results
from ploughval.run.outcome import Outcome

_MOST_FAULTS = 5


def summary(outcome: Outcome, results: Results) -> str:
    """What became of a test: the verdict, what was lost, the chief metrics.

    Parameters
    ----------
    outcome : Outcome
        What became of it.
    results : Results
        Its files.

    Returns
    -------
    str
        An HTML element without scripts and styles of its own; texts of users are escaped.
    """
    state = "complete" if outcome.complete else "incomplete"
    lines = [
        f"<p><b>{escape(outcome.name)}</b> ({state}): {escape(verdict(results))}</p>",
        f"<p>Steps: {escape(', '.join(outcome.steps))}. "
        f"Results: <code>{escape(str(outcome.results))}</code></p>",
    ]
    if outcome.faults:
        more = len(outcome.faults) - _MOST_FAULTS
        shown = [*outcome.faults[:_MOST_FAULTS], *([f"and {more} more"] if more > 0 else [])]
        lines.append(f"<ul>{''.join(f'<li>{escape(fault)}</li>' for fault in shown)}</ul>")
    short = short_chapter(results)
    tables: Sequence[Table] = agreement_tables(results) if short is None else short.tables
    return f"<div>{''.join(lines)}{''.join(_table(table) for table in tables[:1])}</div>"


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in table.head)
    rows = ("".join(f"<td>{escape(cell.text)}</td>" for cell in row) for row in table.rows)
    return f"<table><tr>{head}</tr>{''.join(f'<tr>{row}</tr>' for row in rows)}</table>"
