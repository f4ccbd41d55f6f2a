r"""Equations as MathML, made when the site is built: nothing is fetched or run in the reader's browser.

The TeX of ``$..$`` and ``$$ .. \tag{3} $$`` becomes MathML (tex.py). The tag becomes the number at the
right and the anchor ``eq-3``, so that ``[Eq. (3)](theory-model.md#eq-3)`` is a link that the build checks.
"""

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.transforms import SphinxTransform
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util import logging
from tex import TAG, mathml

_LOG = logging.getLogger(__name__)
_END = re.compile(r"[,.;:!?)\]]+")


class Numbers(SphinxTransform):
    """Takes the tags out of the TeX of a page's equations and makes anchors of them."""

    default_priority = 700  # when all other anchors are there, before links to them are looked up

    def apply(self, **_: Any) -> None:
        """Number and name every equation that has a tag."""
        for equation in self.document.findall(nodes.math_block):
            tags = TAG.findall(equation.astext())
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
        of_all_pages = self.env.metadata[self.env.docname].setdefault("myst_slugs", {})
        self.document.myst_slugs[anchor] = of_all_pages[anchor] = place


class Ends(SphinxPostTransform):
    """Keeps the sign that ends a clause on the line of the formula before it: browsers would part them."""

    default_priority = 900

    def run(self, **_: Any) -> None:
        """Move the sign from the text to the formula."""
        for formula in list(self.document.findall(nodes.math)):
            after = formula.next_node(descend=False, siblings=True)
            end = _END.match(after) if isinstance(after, nodes.Text) else None
            if end:
                formula["end"] = end[0]
                after.parent.replace(after, nodes.Text(after[end.end() :]))


def _written(translator: Any, node: nodes.Element, *, block: bool) -> str:
    try:
        return mathml(node.astext(), block=block)
    except ValueError as fault:
        _LOG.warning("this TeX cannot be shown: %s", fault, location=node)
        return str(translator.encode(node.astext()))


def _inline(translator: Any, node: nodes.math) -> None:
    written = _written(translator, node, block=False)
    end = node.get("end")
    translator.body.append(f'<span class="whole">{written}{end}</span>' if end else written)
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
    app.add_post_transform(Ends)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
