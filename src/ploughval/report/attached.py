"""Tables behind the figures of a page, as CSV that goes with it: small ones whole, long curves as drawn."""

import csv
import io
import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ploughval.columns import floats_of
from ploughval.report.blocks import Chapter
from ploughval.report.thinning import thin
from ploughval.results import MetricEntry, Results

MOST_BYTES = 100_000  # of a table on the page; a longer one stays in the result folder
# Long tables go with the page as they are drawn: the curve that they are thinned by, the columns kept.
_DRAWN: dict[str, tuple[str, tuple[str, ...]]] = {
    "force.csv": ("force_N", ("u_mm", "force_N", "force_std_N", "arm_mm", "arm_std_mm")),
    "mobilised_curve.csv": ("phi_deg", ("band", "u_mm", "slip_mm", "phi_deg", "phi_std_deg")),
    "layer_distances.csv": (
        "",
        ("frame", "u_mm", "layer", "source", "points", "mean_mm", "rms_mm", "validation_std_mm"),
    ),
    "fit_force.csv": ("force_N", ()),
}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE)
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


@dataclass(frozen=True, slots=True)
class Attached:
    """A table that can be saved from the page: the name it is saved under, its text, what it leaves out."""

    name: str
    text: str
    note: str = ""


def attached(results: Results, chapters: Iterable[Chapter]) -> dict[str, Attached]:
    """Tables behind the drawings of some chapters, by the file of the result folder that they come from.

    Parameters
    ----------
    results : Results
        The result folder.
    chapters : iterable of Chapter
        Whose drawings name the files behind them.

    Returns
    -------
    dict of str to Attached
        Without those that are no tables or too long for a page.
    """
    names = {
        name
        for chapter in chapters
        for drawing in (*chapter.drawings, *chapter.grid)
        for name in drawing.data
    }
    found = {name: _attached(results, name) for name in sorted(names)}
    return {name: table for name, table in found.items() if table is not None}


def csv_text(rows: Iterable[Sequence[str]]) -> str:
    r"""Rows as CSV (RFC 4180); a text that a spreadsheet would run as a formula gets an apostrophe.

    >>> csv_text([["name", "u_mm"], ["=1+1", "-0.5"]])
    "name,u_mm\r\n'=1+1,-0.5\r\n"
    """
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\r\n").writerows([guarded(cell) for cell in row] for row in rows)
    return buffer.getvalue()


def _attached(results: Results, name: str) -> Attached | None:
    made = _MADE.get(name)
    if made is not None:
        return made(results)
    path = results.folder / name
    if path.suffix != ".csv" or not path.is_file():
        return None
    if name not in _DRAWN and path.stat().st_size > MOST_BYTES:
        return None
    drawn = name in _DRAWN and path.stat().st_size > MOST_BYTES / 4
    rows, note = _as_drawn(path, *_DRAWN[name]) if drawn else (_rows(path), "")
    text = csv_text(rows)
    return Attached(name.replace("/", "-"), text, note) if len(text) <= MOST_BYTES else None


def _rows(path: Path) -> Iterator[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        yield from csv.reader(file)


def _as_drawn(path: Path, curve: str, columns: Sequence[str]) -> tuple[list[list[str]], str]:
    """The rows that a figure is drawn through, the head first, and the columns that it shows.

    A log of hours has millions of rows: they are gone through one by one.
    """
    head, *_ = itertools.islice(_rows(path), 1)
    kept = [place for place, title in enumerate(head) if not columns or title in columns]
    shown = None
    if curve in head:
        values = floats_of(pd.read_csv(path, usecols=[curve], skip_blank_lines=False)[curve])
        shown = set(thin(pd.DataFrame({curve: values}), curve).index.tolist())
    some, count = [[head[place] for place in kept]], 0
    for row in itertools.islice(_rows(path), 1, None):
        if shown is None or count in shown:
            some.append([row[place] for place in kept])
        count += 1
    said = f"{len(some) - 1} of {count} rows" if len(some) - 1 < count else "the columns that are drawn"
    return some, f"{path.name}: {said}; all of it is in the result folder."


def _model_force(results: Results) -> Attached | None:
    """The prediction as it is drawn: what load cells would measure of it."""
    table = results.model_force
    if table is None:
        return None
    return Attached("model-force.csv", _frame_text(thin(table, "force_N")))


def _metrics(results: Results) -> Attached | None:
    """The metrics with every part of their uncertainty, one a row."""
    if results.metrics is None:
        return None
    parts = [name for name in MetricEntry.model_fields if name not in ("unit", "note")]
    head = ["metric", "unit", *parts, "note"]
    rows = [
        [name, metric.unit, *(_cell(getattr(metric, part)) for part in parts), metric.note]
        for name, metric in results.metrics.metrics.items()
    ]
    return Attached("metrics.csv", csv_text([head, *rows]))


def _noise(results: Results) -> Attached | None:
    """Noise of the camera against grey level."""
    noise = results.run.noise
    if noise is None:
        return None
    rows = zip(noise.grey, noise.std, noise.std_std, strict=True)
    head = ["grey", "std", "std_std"]
    return Attached("camera-noise.csv", csv_text([head, *([_cell(value) for value in row] for row in rows)]))


def _control_points(results: Results) -> Attached | None:
    """Points of the calibration and their residuals."""
    if results.calibration is None or results.calibration.points.empty:
        return None
    return Attached("calibration-points.csv", _frame_text(results.calibration.points))


def _frame_text(table: pd.DataFrame) -> str:
    rows = ([_cell(value) for value in row] for row in table.itertuples(index=False, name=None))
    return csv_text([[str(name) for name in table.columns], *rows])


def _cell(value: object) -> str:
    """A value in full precision; what could not be had is empty."""
    if value is None or value != value:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return repr(float(value)) if isinstance(value, float) else str(value)


def guarded(cell: str) -> str:
    """A cell, with an apostrophe before what a spreadsheet would run as a formula; numbers stay."""
    return f"'{cell}" if cell.startswith(_FORMULA) and not _NUMBER.fullmatch(cell) else cell


_MADE: dict[str, Callable[[Results], Attached | None]] = {
    "metrics.json": _metrics,
    "model/force.csv": _model_force,
    "run.json": _noise,
    "calibration.json": _control_points,
}
