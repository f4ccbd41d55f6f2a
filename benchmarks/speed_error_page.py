"""The page of speed against error, its figures and README.md, made from the tables alone.

    python benchmarks/speed_error_page.py [--out reports/speed-error]

Every number on the page, also in its sentences, is read from a table of the folder.
"""

import argparse
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path

from ploughval.report.blocks import Cell, Chapter, Pen, Table, Tile, value_cell
from ploughval.report.page import render
from ploughval.report.text import brief, label
from speed_error import compare, fit, force, model, piv, sequences
from speed_error.figure import panel_figure, save_png, subject_figure
from speed_error.machine import NAME as MACHINE
from speed_error.machine import PROTOCOL, read_machine
from speed_error.other import Facts, chapters
from speed_error.points import ERROR, Panel, Point, Subject
from speed_error.words import shown

PAGE, README = "index.html", "README.md"
Builder = Callable[[Path], Subject | None]
SUBJECTS: dict[str, Builder] = {
    "piv": piv.subject,
    "sequences": sequences.subject,
    "force": force.subject,
    "model": model.subject,
    "fit": fit.subject,
    "compare": compare.subject,
}
"""By the name of the bench that measures them."""
PICTURES = {
    "correlation": (
        ("piv-band.png", "Error against the distance from a shear band."),
        (
            "piv-star.png",
            "Share of an amplitude of 0.5 px that is measured, against the period of the motion.",
        ),
        ("piv-real.png", "Real pictures of others (`benchmarks/study_piv_real.py`)."),
    ),
    "markers": (("markers.png", "Error of markers (`benchmarks/study_markers.py`)."),),
}
LINES = {
    "target": "dashed, to reach",
    "bound": "whole, a bound",
    "mark": "dotted, what others take or a whole test reaches",
}
SUMMARY_HEAD = ("Part", "Quantity", "Error", "To reach", "Time", "Most exact measured", "Fastest measured")


def write_page(folder: Path) -> list[Path]:
    """Write index.html, README.md and a picture a subject into the folder of the tables.

    Parameters
    ----------
    folder : Path
        Holds the tables of the benches; subjects without a table are named as not measured.

    Returns
    -------
    list of Path
        What was written.
    """
    found = {name: build(folder) for name, build in SUBJECTS.items()}
    subjects = [subject for subject in found.values() if subject is not None]
    missing = [name for name, subject in found.items() if subject is None]
    others = chapters(folder)
    folder.mkdir(parents=True, exist_ok=True)
    page, readme = folder / PAGE, folder / README
    page.write_text(page_of(folder, subjects, others, missing), encoding="utf-8", newline="\n")
    pictures = [save_png(subject_figure(s.panels), folder / f"{s.key}.png") for s in subjects]
    readme.write_text(readme_of(folder, subjects, others, missing), encoding="utf-8", newline="\n")
    return [page, readme, *pictures]


def page_of(
    folder: Path, subjects: Sequence[Subject], others: Sequence[Facts], missing: Sequence[str]
) -> str:
    """The page as HTML."""
    pen = Pen()
    return render(
        "test.html.j2",
        title="Speed against error",
        notes="",
        verdict=verdict(subjects),
        tiles=[_tile(subject) for subject in subjects],
        chapters=[
            _summary(subjects, missing),
            *(_chapter(subject, pen) for subject in subjects),
            *(Chapter(f.key, f.title, f.lead, notes=f.notes, tables=f.tables) for f in others),
            _protocol(folder),
        ],
        version=version("ploughval"),
    )


def verdict(subjects: Sequence[Subject]) -> str:
    """How many figures the defaults reach, and whether anything measured beats one on both counts."""
    kept, count = 0, 0
    for panel in (panel for subject in subjects for panel in subject.panels):
        for level in panel.targets(ERROR):
            count += 1
            kept += panel.standard.error <= level
    panels = [panel for subject in subjects for panel in subject.panels]
    beaten = [panel.title for panel in panels if panel.better()]
    said = f"The defaults reach {kept} of {count} figures of error that they are to reach. "
    if not beaten:
        return (
            said + f"In none of {len(panels)} comparisons is a measured setting both faster and more exact."
        )
    return said + (
        f"In {len(panels) - len(beaten)} of {len(panels)} comparisons no measured setting is both faster "
        "and more exact."
    )


def _unit(axis: str) -> str:
    """The unit of an axis label: what follows its first comma, without statistics."""
    parts = [part.strip() for part in axis.split(",")]
    return next((part for part in reversed(parts) if part not in ("rms", "error")), "")


def _time(value: float, panel: Panel) -> str:
    return f"{shown(value)} {panel.time_label.split(',', 1)[1].split('(')[0].strip()}"


def _error(value: float, panel: Panel, digits: int = 3) -> str:
    unit, text = _unit(panel.error_label), brief(value, digits)
    return f"{text}°" if unit == "degrees" else f"{text} {unit}"


def _tile(subject: Subject) -> Tile:
    panel = subject.panels[0]
    mine = panel.standard
    large = _error(mine.error, panel, 2)  # three digits are wider than a tile
    return Tile(subject.title, large, f"{panel.title}; {_time(mine.time, panel)}")


def _summary(subjects: Sequence[Subject], missing: Sequence[str]) -> Chapter:
    rows = []
    for subject in subjects:
        for panel in subject.panels:
            mine = panel.standard
            exact = min(panel.measured, key=lambda p: p.error)
            fast = min(panel.measured, key=lambda p: p.time)
            targets = panel.targets(ERROR)
            reached = bool(targets) and mine.error <= targets[0]
            mark = "" if not targets else "agrees" if reached else "differs"
            rows.append(
                [
                    Cell(
                        f"{subject.title}: {panel.default}" if panel is subject.panels[0] else subject.title
                    ),
                    Cell(panel.title),
                    Cell(_error(mine.error, panel), mine.error),
                    Cell(f"at most {shown(targets[0])}" if targets else "", mark=mark),
                    Cell(_time(mine.time, panel)),
                    Cell(_named(exact, panel)),
                    Cell(_named(fast, panel)),
                ]
            )
    faults = [f"Not measured: {name}. Run: ploughval bench {name}" for name in missing]
    return Chapter(
        "defaults",
        "The defaults: error, time, what they cost",
        "What happens when nothing is set, and the ends of what was measured beside it.",
        tables=(Table("Defaults", list(SUMMARY_HEAD), rows, kind="cards"),),
        faults=faults,
    )


def _named(point: Point, panel: Panel) -> str:
    if point.default:
        return "the default"
    name = f"{point.family} {point.setting}".strip()
    return f"{name}: {_error(point.error, panel)}, {_time(point.time, panel)}"


def _chapter(subject: Subject, pen: Pen) -> Chapter:
    drawings = [
        pen.draw(panel_figure(p, subject.panels), alt_of(p), caption_of(p), name=f"{subject.key}-{p.key}")
        for p in subject.panels
    ]
    return Chapter(
        subject.key,
        subject.title,
        subject.lead,
        grid=drawings,
        notes=[f"What to choose when. {subject.choice[0]}", *subject.choice[1:]],
        tables=subject.tables,
    )


def alt_of(panel: Panel) -> str:
    """What the figure shows, in words."""
    mine, exact = panel.standard, min(panel.measured, key=lambda p: p.error)
    return (
        f"{panel.title}: {panel.error_label}, against {panel.time_label}, both logarithmic; "
        f"{len(panel.measured)} settings in {len({p.family for p in panel.points})} families. The default "
        f"has {shown(mine.error)} at {shown(mine.time)}; the most exact, {exact.family} {exact.setting}, "
        f"{shown(exact.error)} at {shown(exact.time)}."
    )


def caption_of(panel: Panel) -> str:
    """Title, and what the marks are."""
    words = f"{panel.title}. A point a setting, a line a family; the ring is the default ({panel.default})."
    kinds = {level.kind for level in panel.levels}
    lines = [text for kind, text in LINES.items() if kind in kinds]
    return f"{words} Thin lines: {'; '.join(lines)}." if lines else words


def _protocol(folder: Path) -> Chapter:
    facts = read_machine(folder)
    rows = [[Cell(label(name)), value_cell(value)] for name, value in facts.items()]
    return Chapter(
        "protocol",
        "How the times were taken",
        "",
        notes=PROTOCOL,
        faults=[] if facts else [f"No {MACHINE}: the machine of these times is not recorded."],
        tables=(Table("Machine and versions", ["What", "Value"], rows),) if rows else (),
    )


def readme_of(
    folder: Path, subjects: Sequence[Subject], others: Sequence[Facts], missing: Sequence[str]
) -> str:
    """The short page for those who read the repository."""
    facts = read_machine(folder)
    machine = f"{facts['cores']} cores, {facts['processor']}, {facts['python']}" if facts else "not recorded"
    lines = [
        "# Speed against error",
        "",
        "Made by `ploughval bench`; from the tables alone by `ploughval bench --page`. The page with all "
        f"tables is [{PAGE}]({PAGE}). {verdict(subjects)}",
        "",
        f"Machine: {machine}. Times are CPU of one thread, medians of rounds, compiled before; only ratios "
        "travel.",
        *(f"\nNot measured: {name} (`ploughval bench {name}`)." for name in missing),
    ]
    for subject in subjects:
        lines += [
            "",
            f"## {subject.title}",
            "",
            subject.lead,
            "",
            f"![{subject.title}]({subject.key}.png)",
            "",
        ]
        lines += ["What to choose when:", "", *(f"- {text}" for text in subject.choice)]
        lines += _more(folder, subject.key, subject.files)
    for other in others:
        lines += ["", f"## {other.title}", "", other.lead, "", *(f"- {text}" for text in other.notes)]
        lines += _more(folder, other.key, other.files)
    return "\n".join(lines) + "\n"


def _more(folder: Path, key: str, files: Sequence[str]) -> list[str]:
    shown_files = [(name, text) for name, text in PICTURES.get(key, ()) if (folder / name).is_file()]
    lines = [
        line for name, text in shown_files for line in ("", f"![{text.split(' (')[0]}]({name})", "", text)
    ]
    tables = ", ".join(f"[{name}]({name})" for name in files)
    return [*lines, "", f"Tables: {tables}."] if tables else lines


def main(arguments: Sequence[str] | None = None) -> list[Path]:
    """Write the page, README.md and the pictures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    return write_page(parser.parse_args(arguments).out)


if __name__ == "__main__":
    for path in main():
        print(path)
