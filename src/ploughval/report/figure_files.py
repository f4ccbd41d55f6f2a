"""The figures of a report as files for a paper: SVG and PNG of one width, their captions beside them."""

import os
import re
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from markupsafe import Markup
from matplotlib.figure import Figure

from ploughval.errors import ConfigError, DataError, Fault
from ploughval.report.blocks import Chapter, Drawing, Pen
from ploughval.report.calibration import calibration_chapter
from ploughval.report.captions import Captioned, write_captions
from ploughval.report.chapters import bands_chapter, field_chapter
from ploughval.report.figures.look import paper_look
from ploughval.report.figures.style import styled
from ploughval.report.force import force_chapter
from ploughval.report.friction import friction_chapter
from ploughval.report.load_cells import load_cells_chapter
from ploughval.report.mound import mound_chapter
from ploughval.report.paper import paper_chapter
from ploughval.report.quality import quality_chapter
from ploughval.report.several import find_several, several_context
from ploughval.report.shear import shear_chapter
from ploughval.report.soil_fit import soil_fit_chapter
from ploughval.report.stages import layers_chapter
from ploughval.report.verdict import agreement_chapter
from ploughval.results import Results, read_results
from ploughval.run.kept.written import write_aside

COLUMN_MM = 84.0
FORMATS = ("svg", "png")
FIGURED: tuple[Callable[[Results, Pen], Chapter | None], ...] = (
    agreement_chapter,
    force_chapter,
    layers_chapter,
    mound_chapter,
    bands_chapter,
    field_chapter,
    shear_chapter,
    friction_chapter,
    soil_fit_chapter,
    load_cells_chapter,
    calibration_chapter,
    quality_chapter,
    paper_chapter,
)


@dataclass(slots=True, kw_only=True)
class FilePen(Pen):
    """Writes every figure to a folder as it is drawn."""

    folder: Path
    subject: str = ""
    source: str = ""
    alts: dict[str, str] = field(default_factory=dict)
    sizes_mm: dict[str, tuple[float, float]] = field(default_factory=dict)
    written: list[Path] = field(default_factory=list)

    def draw(self, figure: Figure, alt: str, caption: str, *, name: str, data: Sequence[str] = ()) -> Drawing:
        """A figure as files; see :meth:`Pen.draw`."""
        self.count += 1
        own = self.own_name(name)
        words = {"Title": f"{self.subject}: {own}", "Description": alt, "Source": self.source}
        for kind in FORMATS:
            path = self.folder / f"{own}.{kind}"
            _saved(figure, path, {key: _printable(text) for key, text in words.items()})
            self.written.append(path)
            figure.set_layout_engine(None)  # laid out once, alike in all formats
        width, height = figure.get_size_inches()
        self.alts[own], self.sizes_mm[own] = alt, (25.4 * float(width), 25.4 * float(height))
        return Drawing(Markup(""), caption, own, tuple(data))


def write_figures(
    results: Path | str | Sequence[Path | str],
    out: Path | str,
    *,
    width_mm: float = COLUMN_MM,
    type_pt: float = 8.0,
) -> list[Path]:
    """Write every figure of the page of one result folder, or of several compared, for a paper.

    Parameters
    ----------
    results : path or sequence of paths
        Result folders (or test folders that hold ``results``).
    out : path
        Folder to write to; files of the same names are replaced, others stay.
    width_mm : float, mm
        Width of every figure in print: that of a column or of a page.
    type_pt : float, points
        Size of titles and labels at that width; numbers and legends are one point smaller.

    Returns
    -------
    list of Path
        SVG and PNG (300 dots per inch) of every figure, then captions.md and captions.csv; the same results
        give the same bytes.

    Raises
    ------
    DataError
        No result folder, a file in it that cannot be read, or a folder that cannot be written to.
    ConfigError
        No folder at all; a width or a type size that cannot be drawn.
    """
    folders = [results] if isinstance(results, str | Path) else list(results)
    if not folders:
        raise ConfigError("report", [Fault("results", "no folder", "at least one result folder")])
    with paper_look(width_mm, type_pt=type_pt):
        tests = [read_results(folder) for folder in folders]
        target = _ready(Path(out))
        pen = FilePen(folder=target, subject=_subject(tests), source=_source(tests))
        chapters = _chapters(tests, pen)
    shown = [
        Captioned(
            name=drawing.name,
            chapter=chapter.title,
            lead=chapter.lead,
            caption=drawing.caption,
            alt=pen.alts[drawing.name],
            data=tuple(name for name in drawing.data if (tests[0].folder / name).is_file()),
            size_mm=pen.sizes_mm[drawing.name],
        )
        for chapter in chapters
        for drawing in (*chapter.grid, *chapter.drawings)
    ]
    return pen.written + write_captions(shown, target, subject=pen.subject, source=pen.source)


def _chapters(tests: Sequence[Results], pen: Pen) -> list[Chapter]:
    if len(tests) > 1:
        chapters: list[Chapter] = several_context(find_several(list(tests)), pen)["chapters"]
        return chapters
    built = (chapter(tests[0], pen) for chapter in FIGURED)
    return [chapter for chapter in built if chapter is not None]


def _subject(tests: Sequence[Results]) -> str:
    return tests[0].name if len(tests) == 1 else f"{len(tests)} tests compared"


def _source(tests: Sequence[Results]) -> str:
    """Which version and settings the numbers are of."""
    versions = sorted({test.run.ploughval for test in tests if test.run.ploughval})
    hashes = sorted({test.run.settings_hash[:12] for test in tests if test.run.settings_hash})
    said = [f"ploughval {', '.join(versions)}" if versions else "ploughval"]
    return ", ".join([*said, f"settings {', '.join(hashes)}"] if hashes else said)


def _ready(folder: Path) -> Path:
    """The folder, made and tried, before anything is drawn."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=".figures-", dir=folder)
        os.close(handle)
        Path(name).unlink()
    except OSError as error:
        reason = "it is a file" if folder.is_file() else error.strerror or str(error)
        raise DataError(
            f"figures cannot be written here: {reason}; expected a folder that can be written to", path=folder
        ) from None
    return folder


@styled
def _saved(figure: Figure, target: Path, words: dict[str, str]) -> None:
    """Write a figure; under the look in force, for ticks are made as they are drawn."""
    kind = target.suffix.lstrip(".")
    metadata: dict[str, str | None] = dict(words)
    metadata |= {"Date": None, "Creator": words["Source"]} if kind == "svg" else {"Software": words["Source"]}

    def write(aside: Path) -> None:
        figure.savefig(aside, format=kind, metadata=metadata)
        if kind == "svg":
            _describe(aside, words["Description"])

    write_aside(target, write)


def _describe(path: Path, text: str) -> None:
    """Put the alternative text where readers of the picture's text look for it."""
    body = path.read_text(encoding="utf-8")
    safe = str(Markup.escape(text))
    path.write_text(
        re.sub(r"(</title>)", lambda found: f"{found.group(1)}\n <desc>{safe}</desc>", body, count=1),
        encoding="utf-8",
        newline="\n",
    )


def _printable(text: str) -> str:
    """Text on one line, without what no XML can hold."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())
