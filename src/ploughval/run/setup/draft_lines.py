"""Lines of a draft: questions, guesses and remarks."""

import json
import textwrap
from collections.abc import Iterable

from pydantic import BaseModel

_WIDTH = 110


def quoted(text: str) -> str:
    """A text as a TOML string."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def listed(names: Iterable[str]) -> str:
    """Texts as a TOML list."""
    return f"[{', '.join(quoted(name) for name in names)}]"


def remark(text: str) -> str:
    """A text as comment lines."""
    lines = [part for line in text.splitlines() for part in textwrap.wrap(line, _WIDTH)]
    return "".join(f"# {line}\n" for line in lines)


def ask(table: type[BaseModel], key: str, guess: str = "", found: str = "") -> str:
    """A question: what the key means, how the guess was found, and the key with the guess before its ?."""
    meaning = table.model_fields[key].description or key
    return f"{remark(meaning)}{remark(found)}# {key} = {f'{guess} ' if guess else ''}?\n"


def offer(line: str, found: str) -> str:
    """A line that may be taken as it is, once its comment sign is taken away, and how it was found."""
    return f"{remark(found)}# {line}\n"
