r"""Equations as MathML, made when the site is built: nothing is fetched or run in the reader's browser.

latex2mathml turns the TeX of ``$..$`` and ``$$ .. \tag{3} $$`` into MathML. The tag becomes the number at the
right and the anchor ``eq-3``, so that ``[Eq. (3)](theory-model.md#eq-3)`` is a link that the build checks.
"""

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.transforms import SphinxTransform
from sphinx.util import logging

_LOG = logging.getLogger(__name__)
_TAG = re.compile(r"\s*\\tag\{([^{}]+)\}")
_FUNCTION = re.compile(r"<(m[io])>([a-z]{2,})</\1>(?=(<mo stretchy=\"false\">&#x00028;)?)")
_OPENED = re.compile(r"(?:<mrow>|<mtd[^>]*>|(?<!&#x00029;)(?<![)\]|])</mo>)(?:<m\w+>)*\Z")
_PAIRS = ((r"(?<!\\)\{", r"(?<!\\)\}"), (r"\\left\b", r"\\right\b"), (r"\\begin\b", r"\\end\b"))
_UNKNOWN = re.compile(r"\\[A-Za-z]+")


class Numbers(SphinxTransform):
    """Takes the tags out of the TeX of a page's equations and makes anchors of them."""

    default_priority = 700  # when all other anchors are there, before links to them are looked up

    def apply(self, **_: Any) -> None:
        """Number and name every equation that has a tag."""
        for equation in self.document.findall(nodes.math_block):
            tags = _TAG.findall(equation.astext())
            if len(tags) > 1:
                _LOG.warning("an equation with %d tags: give it one", len(tags), location=equation)
            if tags:
                self._name(equation, tags[0])

    def _name(self, equation: nodes.math_block, tag: str) -> None:
        anchor = "eq-" + tag
        if anchor in self.document.ids:
            _LOG.warning("equation (%s) is on this page twice", tag, location=equation)
            return
        equation["tag"] = tag
        equation["ids"].append(anchor)
        self.document.ids[anchor] = equation
        place = (equation.line or 0, anchor, f"Eq. ({tag})")
        for anchors in (self.document.myst_slugs, self.env.metadata[self.env.docname]["myst_slugs"]):
            anchors[anchor] = place


def mathml(tex: str, *, block: bool) -> str:
    r"""MathML of TeX without its tag.

    Names of functions are given the thin spaces that TeX has about them.

    Raises
    ------
    ValueError
        When the TeX holds a command that is not known, or does not close.
    """
    for opens, closes in _PAIRS:
        if len(re.findall(opens, tex)) != len(re.findall(closes, tex)):
            raise ValueError(f"{opens} and {closes} are not as many")
    try:
        markup = convert(_TAG.sub("", tex), display="block" if block else "inline")
    except Exception as fault:  # of a dozen kinds, none of them documented
        raise ValueError(f"{type(fault).__name__} {fault}") from fault
    if unknown := _UNKNOWN.search(markup):
        raise ValueError(f"{unknown[0]} is not known")
    return _FUNCTION.sub(_spaced, markup)


def _spaced(function: re.Match[str]) -> str:
    before = "0" if _OPENED.search(function.string, 0, function.start()) else "0.17em"
    after = "0" if function[3] else "0.17em"
    return f'<mo form="prefix" lspace="{before}" rspace="{after}">{function[2]}</mo>'


def _written(translator: Any, node: nodes.Element, *, block: bool) -> str:
    try:
        return mathml(node.astext(), block=block)
    except ValueError as fault:
        _LOG.warning("this TeX cannot be shown: %s", fault, location=node)
        return str(translator.encode(node.astext()))


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(_written(translator, node, block=False))
    raise nodes.SkipNode


def _display(translator: Any, node: nodes.math_block) -> None:
    tag = node.get("tag")
    number = f'<a class="number" href="#eq-{tag}">({tag})</a>' if tag else ""
    body = translator.body
    body.append(translator.starttag(node, "div", CLASS="equation"))
    body.append(f'<div class="formula">{_written(translator, node, block=True)}</div>{number}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Make ``html_math_renderer = "mathml"`` a choice."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    app.add_transform(Numbers)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
