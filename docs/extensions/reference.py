"""The reference from docstrings: every public name is in it, and the types that docstrings name are links."""

import enum
import inspect
import tomllib
from pathlib import Path
from typing import Any

from numpydoc.xref import DEFAULT_LINKS
from sphinx.application import Sphinx
from sphinx.util import logging

import ploughval.errors
import ploughval.scene

_LIST = Path(__file__).parents[2] / "tests" / "house" / "public_names.toml"
_LOG = logging.getLogger(__name__)
_NOT_OURS = ("Alias for field number", "Configuration for the model")  # texts of namedtuple and pydantic


def public_names() -> list[str]:
    """What others may build on, with the module's name before it; scene has its settings and tables."""
    listed = tomllib.loads(_LIST.read_text(encoding="utf-8")) | {"ploughval.scene": ploughval.scene.__all__}
    return [f"{module}.{name}" for module, names in listed.items() for name in names if name[0] != "_"]


def _missing(app: Sphinx, env: Any) -> None:
    shown = env.get_domain("py").objects
    for name in public_names():
        module, _, own = name.rpartition(".")
        of_the_room = f"{module.rpartition('.')[0]}.{own}"  # what a part of a room offers, the room may too
        if name not in shown and of_the_room not in shown:
            _LOG.warning("%s is public and has no place in docs/api", name)


def _link_types(_app: Sphinx, config: Any) -> None:
    """Let numpydoc link the types that parameters and results are said to have."""
    DEFAULT_LINKS.clear()  # they lead to other sites
    config.numpydoc_xref_param_type = True
    config.numpydoc_xref_ignore = "all"
    errors = [f"ploughval.errors.{name}" for name in vars(ploughval.errors) if name.endswith("Error")]
    rooms_last = reversed([*public_names(), *errors])  # what a room and a part of it offer links to the room
    config.numpydoc_xref_aliases = {name.rpartition(".")[2]: name for name in rooms_last}


def _skipped(_app: Sphinx, _what: str, name: str, thing: Any, skip: bool, _options: Any) -> bool | None:
    """Show every value of an enumeration; leave out what others wrote about their own workings."""
    if isinstance(thing, enum.Enum) and name in type(thing).__members__:
        return False
    ours = name != "model_config" and not (inspect.getdoc(thing) or "").startswith(_NOT_OURS)
    return None if ours else True


def _signature(
    _app: Sphinx, _what: str, _name: str, thing: Any, _options: Any, signature: str, returned: str
) -> tuple[str, str] | None:
    """Nobody calls an enumeration."""
    return ("", returned) if inspect.isclass(thing) and issubclass(thing, enum.Enum) else None


def setup(app: Sphinx) -> dict[str, Any]:
    """Take part in every build."""
    app.connect("config-inited", _link_types, priority=100)
    app.connect("autodoc-skip-member", _skipped)
    app.connect("autodoc-process-signature", _signature)
    app.connect("env-updated", _missing)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
