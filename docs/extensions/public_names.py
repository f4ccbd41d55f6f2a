"""Every public name of every room is in the reference, and the types that docstrings name link to it."""

import importlib
import pkgutil
from typing import Any

from numpydoc.xref import DEFAULT_LINKS
from sphinx.application import Sphinx
from sphinx.util import logging

import ploughval

_LOG = logging.getLogger(__name__)


def public_names() -> list[str]:
    """What the rooms list in ``__all__``, with the room's name before it."""
    rooms = [f"ploughval.{room.name}" for room in pkgutil.iter_modules(ploughval.__path__) if room.ispkg]
    listed = [
        (name, importlib.import_module(name).__all__) for name in ["ploughval", "ploughval.scene", *rooms]
    ]
    return [f"{room}.{name}" for room, names in listed for name in names if not name.startswith("__")]


def _missing(app: Sphinx, env: Any) -> None:
    shown = env.get_domain("py").objects
    for name in public_names():
        if name not in shown:
            _LOG.warning("%s is public and has no place in docs/api", name)


def _link_types(_app: Sphinx, config: Any) -> None:
    """Let numpydoc link the types that parameters and results are said to have."""
    DEFAULT_LINKS.clear()  # they lead to other sites
    config.numpydoc_xref_param_type = True
    config.numpydoc_xref_ignore = "all"
    config.numpydoc_xref_aliases = {name.rpartition(".")[2]: name for name in public_names()}


def setup(app: Sphinx) -> dict[str, Any]:
    """Take part in every build."""
    app.connect("config-inited", _link_types, priority=100)
    app.connect("env-updated", _missing)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
