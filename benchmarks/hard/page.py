"""Pictures, page and README of the hard cases."""

import re
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl
import pandas as pd
from matplotlib.figure import Figure

from drawing.png import save_light
from drawing.svg import light
from hard.cases import Canvas, Fate, Outcome, Part
from ploughval.report.blocks import Cell, Chapter, Drawing, Pen, Table, Tile, value_cell
from ploughval.report.figures.style import INK, MEASURED, MODEL, MUTED, styled
from ploughval.report.page import render

COLUMNS = 4
PANEL_IN = (2.75, 1.75)
MARKS = {Fate.HOLDS: "agrees", Fate.REFUSED: "unknown", Fate.DEGRADED: "unknown", Fate.WRONG: "differs"}
COLOURS = {Fate.HOLDS: MEASURED, Fate.REFUSED: MUTED, Fate.DEGRADED: INK, Fate.WRONG: MODEL}
HEAD = ("Case", "Done", "Must hold", "Happened", "Error", "Limit", "Said", "Verdict")
SMALL = {
    "font.size": 6.0,
    "axes.titlesize": 6.0,
    "axes.labelsize": 6.0,
    "xtick.labelsize": 5.5,
    "ytick.labelsize": 5.5,
    "legend.fontsize": 5.5,
    "axes.linewidth": 0.5,
    "xtick.major.size": 2.0,
    "ytick.major.size": 2.0,
}


@styled
def draw_sheet(part: Part, outcomes: Sequence[Outcome], path: Path) -> None:
    """All cases of a part as small pictures on one sheet; ticks take their size when they are drawn."""
    rows = -(-len(outcomes) // COLUMNS)
    with mpl.rc_context(SMALL):
        figure = Figure(figsize=(COLUMNS * PANEL_IN[0], rows * PANEL_IN[1]), layout="constrained")
        panels = figure.subfigures(rows, COLUMNS, squeeze=False).ravel()
        for panel, outcome in zip(panels, outcomes, strict=False):
            title = f"{outcome.case.name}: {outcome.fate.value}"
            panel.suptitle("\n".join(textwrap.wrap(title, 62)), fontsize=6.5, color=COLOURS[outcome.fate])
            _panel(part, outcome, panel)
        save_light(figure, path, dpi=110)


def _panel(part: Part, outcome: Outcome, canvas: Canvas) -> None:
    """What is drawn of a case, or the words with which it was refused."""
    if outcome.happened.shown is not None:
        part.draw(canvas, outcome.case, outcome.happened.shown)
        return
    said = str(outcome.row()["said"]) or outcome.happened.what
    text = "\n".join(textwrap.wrap(said, 58)[:7]).replace("$", r"\$")
    canvas.text(0.5, 0.45, text, ha="center", va="center", color=MUTED, fontsize=mpl.rcParams["font.size"])


@styled
def _single(part: Part, outcome: Outcome) -> Figure:
    figure = Figure(figsize=(5.2, 2.7), layout="constrained")
    _panel(part, outcome, figure)
    return figure


def write_page(
    parts: Mapping[str, Part],
    tables: Mapping[str, pd.DataFrame],
    done: Mapping[str, Sequence[Outcome]],
    path: Path,
) -> None:
    """The page: chapters of parts that were run are drawn anew, the others are kept as they stand there."""
    before = path.read_text(encoding="utf-8") if path.is_file() else ""
    chapters = [overview(parts, tables)]
    chapters += [chapter_of(parts[key], table, done.get(key, ())) for key, table in tables.items()]
    counts = counts_of(tables)
    total = int(counts.sum())
    tiles = [Tile(fate.value, f"{int(counts[fate.value])} / {total}") for fate in Fate]
    page = render(
        "test.html.j2",
        title="Hard cases",
        notes="",
        verdict=verdict(counts),
        tiles=tiles,
        chapters=chapters,
        version="",
    )
    page = light(page)
    for key in tables:
        if key not in done:
            page = kept(page, before, key)
    path.write_text(page, encoding="utf-8", newline="\n")


def kept(page: str, before: str, key: str) -> str:
    """A page with the section of a part as an earlier page had it, where that has one."""
    section = re.compile(rf'<section id="{key}">.*?</section>', re.DOTALL)
    old = section.search(before)
    return page if old is None else section.sub(lambda _: old.group(0), page)


def counts_of(tables: Mapping[str, pd.DataFrame]) -> pd.Series:
    """How many cases came to each fate."""
    every = pd.concat([table["verdict"] for table in tables.values()])
    return every.value_counts().reindex([fate.value for fate in Fate], fill_value=0)


def verdict(counts: pd.Series) -> str:
    """One sentence on all of them."""
    holds, refused, degraded, wrong = (int(counts[fate.value]) for fate in Fate)
    said = f"Of {int(counts.sum())} hard cases {holds} {'holds' if holds == 1 else 'hold'}, {refused} "
    said += f"{'is' if refused == 1 else 'are'} refused with a message, {degraded} "
    said += f"{'is' if degraded == 1 else 'are'} degraded and {'says' if degraded == 1 else 'say'} so, "
    return said + f"{wrong or 'none'} {'are' if wrong > 1 else 'is'} wrong and silent."


def wrong_of(parts: Mapping[str, Part], tables: Mapping[str, pd.DataFrame]) -> list[str]:
    """The cases that are wrong and silent, with what happened."""
    return [
        f"{parts[key].title}, {row.case} ({row.done}): {row.happened}"
        for key, table in tables.items()
        for row in table[table["verdict"] == Fate.WRONG.value].itertuples()
    ]


def overview(parts: Mapping[str, Part], tables: Mapping[str, pd.DataFrame]) -> Chapter:
    """How many cases of each part came to what, and which are wrong."""
    rows = []
    for key, table in tables.items():
        counts = counts_of({key: table})
        rows.append([Cell(parts[key].title), *(value_cell(int(counts[fate.value])) for fate in Fate)])
    lead = (
        "Each case states what is done, what must hold, and the largest error that is still right. A "
        "case holds "
        "if that error is kept; it is degraded if it is not, or if nothing could be measured, but "
        "the words that "
        "come with the result own up to it; without such words it is wrong and silent. A refusal is "
        "an error of "
        "ploughval's own, with a message; any other error counts as wrong."
    )
    wrong = wrong_of(parts, tables)
    table = Table("Cases by part", ["Part", *(fate.value for fate in Fate)], rows)
    return Chapter("overview", "What happens in hard cases", lead=lead, tables=[table], faults=wrong)


def chapter_of(part: Part, table: pd.DataFrame, outcomes: Sequence[Outcome]) -> Chapter:
    """A part: a small figure a case, and the whole table."""
    pen = Pen(prefix=f"{part.key[:3]}-")
    drawings: list[Drawing] = [
        pen.draw(
            _single(part, outcome),
            f"{outcome.case.name}, {outcome.case.done}: {outcome.fate.value}",
            f"{outcome.case.name} – {outcome.fate.value}. {outcome.row()['happened']}.",
            name=f"{part.key} {outcome.case.name}",
        )
        for outcome in outcomes
        if outcome.happened.shown is not None
    ]
    rows = [
        [
            Cell(row.case), Cell(row.done), Cell(row.must_hold), Cell(str(row.happened)),
            value_cell(float(row.error)), Cell(f"{row.limit:g} {row.unit}"),
            Cell("" if isinstance(row.said, float) else str(row.said)),
            Cell(row.verdict, mark=MARKS[Fate(row.verdict)]),
        ]
        for row in table.itertuples()
    ]  # fmt: skip
    counts = counts_of({part.key: table})
    refused = [f"{r.case} ({r.done}): {r.said}" for r in table[table["verdict"] == Fate.REFUSED].itertuples()]
    return Chapter(
        part.key,
        part.title,
        lead=f"{part.lead} {verdict(counts)}{' Refused are:' if refused else ''}",
        grid=drawings,
        notes=refused,
        tables=[Table(f"{part.title}: all cases", HEAD, rows, folded=True, kind="cases")],
    )


def write_readme(parts: Mapping[str, Part], tables: Mapping[str, pd.DataFrame], path: Path) -> None:
    """A short README: counts, what is wrong, one picture a part."""
    lines = [
        "# Hard cases",
        "",
        "Made by `python benchmarks/study_hard_cases.py`; [index.html](index.html) shows every case "
        "with its picture,",
        "the tables are beside it. " + verdict(counts_of(tables)),
        "",
        "| part | " + " | ".join(fate.value for fate in Fate) + " |",
        "| --- |" + " ---: |" * len(Fate),
    ]
    for key, table in tables.items():
        counts = counts_of({key: table})
        lines.append(
            f"| [{parts[key].title}]({key}.csv) | "
            + " | ".join(str(int(counts[fate.value])) for fate in Fate)
            + " |"
        )
    wrong = wrong_of(parts, tables)
    if wrong:
        lines += ["", "Wrong and silent:", "", *(f"- {text}" for text in wrong)]
    for key in tables:
        lines += ["", f"## {parts[key].title}", "", parts[key].lead, "", f"![{parts[key].title}]({key}.png)"]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
