"""Scripts and data of a page: inline, admitted by digest alone, unable to close their own element."""

import base64
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from ploughval.report.rendering import template_text

_JSON_ESCAPES = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}


@dataclass(frozen=True, slots=True)
class Script:
    """An inline script and what the page's security policy knows it by."""

    text: Markup
    digest: str

    @property
    def source(self) -> str:
        """The entry of ``script-src`` that admits this script and no other."""
        return f"'sha256-{self.digest}'"


def page_script(names: Sequence[str]) -> Script:
    """Scripts of the package's templates as one, each in a scope of its own.

    Parameters
    ----------
    names : sequence of str
        Files in ``templates``, in the order in which they run.
    """
    parts = [template_text(name).strip() for name in names]
    text = '"use strict";\n' + "\n".join(f"(() => {{\n{part}\n}})();" for part in parts)
    digest = base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii")
    return Script(Markup(text), digest)


def json_block(key: str, data: Any) -> Markup:
    """Data for a script, as an element that no text within it can close.

    Parameters
    ----------
    key : str
        The element's id.
    data : Any
        What ``json`` can write; not-a-number is refused.

    Raises
    ------
    ValueError
        A value that is not finite.
    """
    text = json.dumps(data, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    for character, escape in _JSON_ESCAPES.items():
        text = text.replace(character, escape)
    return Markup('<script type="application/json" id="{}">{}</script>').format(key, Markup(text))
