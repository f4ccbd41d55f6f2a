"""The built pages fetch no script, style, font or picture from another host; one that does is a warning."""

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.util import logging

_LOG = logging.getLogger(__name__)
_FETCHED = {"src", "srcset", "poster", "data", "background"}  # of any element
_ELSEWHERE = re.compile(r"(?:https?:)?//[\w.-]+", re.IGNORECASE)
_STYLE = re.compile(r"(?:url\(\s*|@import\s+)[\"']?((?:https?:)?//[^\"')\s]+)", re.IGNORECASE)


class _Fetched(HTMLParser):
    """Collects what a browser fetches for a page without being asked: links to follow are not of it."""

    def __init__(self) -> None:
        super().__init__()
        self.places: list[str] = []
        self._in_style = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._in_style = tag == "style"
        for name, value in attrs:
            if name in _FETCHED or (tag, name) == ("link", "href"):
                self.places += _ELSEWHERE.findall(value or "")
            elif name == "style":
                self.places += _STYLE.findall(value or "")

    def handle_data(self, data: str) -> None:
        if self._in_style:
            self.places += _STYLE.findall(data)


def fetched_elsewhere(text: str, *, style_sheet: bool = False) -> list[str]:
    """What a page of HTML, or a style sheet, has a browser fetch from other hosts."""
    if style_sheet:
        return _STYLE.findall(text)
    reader = _Fetched()
    reader.feed(text)
    return reader.places


def _written(folder: Path) -> Iterator[Path]:
    yield from sorted(path for path in folder.rglob("*") if path.suffix in {".html", ".css"})


def _look(app: Sphinx, fault: Exception | None) -> None:
    if fault is not None:
        return
    for path in _written(Path(app.outdir)):
        text = path.read_text(encoding="utf-8")
        for place in fetched_elsewhere(text, style_sheet=path.suffix == ".css"):
            _LOG.warning("%s has a browser fetch %s", path.relative_to(app.outdir), place)


def setup(app: Sphinx) -> dict[str, Any]:
    """Look at the pages when all are written."""
    app.connect("build-finished", _look)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
