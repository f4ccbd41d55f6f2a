"""Docstrings cite the theory as ``docs/theory-model.md, Eq. (3)``: on the site that links to the equation."""

import re
from typing import Any

from sphinx.application import Sphinx

_CITED = re.compile(r"docs/(?P<page>[\w-]+)\.md(?:, Eqs?\.? \((?P<number>\w+)\))?")


def linked(line: str) -> str:
    """One line of a docstring, with links in reStructuredText from a page of docs/api/.

    >>> linked("The least force (docs/theory-model.md, Eq. (4)).")
    'The least force (`docs/theory-model.md, Eq. (4) <../theory-model.html#eq-4>`__).'
    """

    def link(cited: re.Match[str]) -> str:
        anchor = f"#eq-{cited['number']}" if cited["number"] else ""
        return f"`{cited[0]} <../{cited['page']}.html{anchor}>`__"

    return _CITED.sub(link, line)


def _link(_app: Sphinx, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    lines[:] = map(linked, lines)


def setup(app: Sphinx) -> dict[str, Any]:
    """Link in every docstring that the reference shows."""
    app.connect("autodoc-process-docstring", _link, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
