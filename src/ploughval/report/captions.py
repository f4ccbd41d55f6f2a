"""Captions, alternative texts and sources of figures that were written as files."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from ploughval.report.attached import guarded
from ploughval.run.kept.written import write_text

NAMES = ("captions.md", "captions.csv")
_HEAD = ("figure", "chapter", "caption", "alternative_text", "data", "width_mm", "height_mm")


@dataclass(frozen=True, slots=True)
class Captioned:
    """A figure with its words: lead of its chapter, caption, alternative text; data files, size in mm."""

    name: str
    chapter: str
    lead: str
    caption: str
    alt: str
    data: Sequence[str]
    size_mm: tuple[float, float]


def write_captions(figures: Sequence[Captioned], folder: Path, *, subject: str, source: str) -> list[Path]:
    """Write captions.md and captions.csv beside the figures.

    Parameters
    ----------
    figures : sequence of Captioned
        In the order in which they are listed.
    folder : Path
        Where the figures are.
    subject, source : str
        Of what and by what they are.

    Raises
    ------
    DataError
        When the disk refuses.
    """
    texts = (_markdown(figures, subject, source), _table(figures))
    written = []
    for name, text in zip(NAMES, texts, strict=True):
        write_text(folder / name, text)
        written.append(folder / name)
    return written


def _markdown(figures: Sequence[Captioned], subject: str, source: str) -> str:
    lines = [f"# Figures: {_text(subject)}", "", f"{_text(source)}."]
    for (chapter, lead), group in groupby(figures, key=lambda one: (one.chapter, one.lead)):
        lines += ["", f"## {_text(chapter)}"]
        lines += ["", _text(lead)] if lead else []
        for one in group:
            width, height = one.size_mm
            lines += ["", f"### {one.name}", "", _text(one.caption), ""]
            lines.append(f"- Alternative text: {_text(one.alt)}")
            if one.data:
                lines.append(f"- Data: {', '.join(one.data)}")
            lines.append(f"- {one.name}.svg, {one.name}.png, {width:.0f} mm × {height:.0f} mm")
    return "\n".join(lines) + "\n"


def _table(figures: Sequence[Captioned]) -> str:
    buffer = io.StringIO()
    rows = csv.writer(buffer, lineterminator="\n")
    rows.writerow(_HEAD)
    for one in figures:
        caption = f"{one.lead} {one.caption}".strip()
        size = (f"{length:.1f}" for length in one.size_mm)
        words = (one.name, one.chapter, caption, one.alt, " ".join(one.data))
        rows.writerow([*map(guarded, words), *size])
    return buffer.getvalue()


def _text(words: str) -> str:
    r"""Words on one line that Markdown takes as words.

    >>> _text("u_val of <b>")
    'u\\_val of \\<b\\>'
    """
    return re.sub(r"([\\`*_\[\]<>#|])", r"\\\1", " ".join(words.split()))
