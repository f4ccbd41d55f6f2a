"""Writes the tables of test-toml.md and file-formats.md from the code, so that they cannot drift.

    python docs/make_tables.py          # rewrites what stands between the marks of the two pages

A test holds the pages against what this makes.
"""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ploughval.results.catalogue import FILES, VARIABLES
from ploughval.scene import Scene

HERE = Path(__file__).parent
_MARKED = re.compile(r"(<!-- made by make_tables\.py: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
_SANITY = 1e9  # limits from here on keep nonsense out and are no range of a setting
_NO_KEYS = ("folder", "source")  # of Scene, not of test.toml

Schema = dict[str, Any]


def settings_tables() -> str:
    """Every table of test.toml with its keys: values, default and meaning."""
    schema = Scene.model_json_schema()
    known, parts = schema["$defs"], []
    for place, table, required in _tables(schema, known, ""):
        needed = "" if required else ", optional"
        about = table.get("description", "").split(": ", 1)[-1].rstrip(".")
        rows = [
            f"| `{key}` | {_values(field, known)} | {_default(key, field, table)} | {_meaning(field)} |"
            for key, field in table["properties"].items()
            if key not in _NO_KEYS and _inner(field, known) is None
        ]
        head = "| key | value | if absent | meaning |\n| --- | --- | --- | --- |\n"
        parts.append(f"## {place}{needed}\n\n{about[:1].upper()}{about[1:]}.\n\n{head}" + "\n".join(rows))
    return "\n\n".join(parts) + "\n"


def _tables(table: Schema, known: Schema, path: str) -> Iterator[tuple[str, Schema, bool]]:
    """Tables within a table, depth first: their heading, their schema, whether they are required."""
    for key, field in table["properties"].items():
        inner = _inner(field, known)
        if inner is None or key in _NO_KEYS:
            continue
        name = f"{path}.{key}".lstrip(".")
        brackets = "[[{}]]" if field.get("type") == "array" else "[{}]"
        yield f"`{brackets.format(name)}`", inner, key in table.get("required", ())
        yield from _tables(inner, known, name)


def _inner(field: Schema, known: Schema) -> Schema | None:
    """The table that a key holds, where it holds nothing else."""
    choices = [c for c in field.get("anyOf", [field]) if c.get("type") != "null"]
    if len(choices) != 1:
        return None
    target = choices[0].get("items", choices[0]).get("$ref", "").rsplit("/", 1)[-1]
    found = known.get(target)
    return found if found is not None and "properties" in found else None


def _values(field: Schema, known: Schema) -> str:
    """What may stand for a value, in words."""
    if "anyOf" in field:
        words = [_values(choice, known) for choice in field["anyOf"] if choice.get("type") != "null"]
        return ", or ".join(dict.fromkeys(words))
    if "$ref" in field:
        target = known[field["$ref"].rsplit("/", 1)[-1]]
        if "properties" in target:
            inner = ", ".join(f"{k}: {_values(v, known)}" for k, v in target["properties"].items())
            return f"{{{inner}}}"
        return _values(target, known)
    if "enum" in field or "const" in field:
        choices = field.get("enum", [field.get("const")])
        return ", ".join(f"`{value!r}`".replace("'", '"') for value in choices)
    if field["type"] == "array":
        if "prefixItems" in field:
            return f"[{', '.join(_values(item, known) for item in field['prefixItems'])}]"
        return f"list of {_values(field['items'], known)}"
    words = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false"}
    return words[field["type"]] + _range(field)


def _range(field: Schema) -> str:
    """Limits of a number."""
    signs = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
    told = {key: field[key] for key in signs if abs(field.get(key, _SANITY)) < _SANITY}
    if "minimum" in told and told["minimum"] > told.get("exclusiveMinimum", told["minimum"]):
        del told["exclusiveMinimum"]
    limits = [f"{signs[key]} {_number(value)}" for key, value in told.items()]
    return f" {', '.join(limits)}" if limits else ""


def _number(value: float) -> str:
    """A number without an exponent, thousands apart."""
    return f"{value:,.0f}".replace(",", " ") if value == round(value) else f"{value:.7f}".rstrip("0")


def _default(key: str, field: Schema, table: Schema) -> str:
    if key in table.get("required", ()):
        return "**required**"
    default = field.get("default")
    if default is None or default in ("", [], {}):
        return "none"
    return f"`{default!r}`".replace("'", '"').replace("True", "true").replace("False", "false")


def _meaning(field: Schema) -> str:
    return str(field.get("description", "")).replace("|", "\\|")


def results_tables() -> str:
    """Every table of a result folder with its columns: unit and meaning."""
    parts = []
    for name, table in FILES.items():
        rows = [f"| `{c.name}` | {'text' if c.is_text else c.unit} | {c.meaning} |" for c in table.columns]
        head = "| column | unit | meaning |\n| --- | --- | --- |\n"
        about = f"{table.about} A row: {table.row}."
        parts.append(f"### {name}\n\n{about}\n\n{head}" + "\n".join(rows))
    return "\n\n".join(parts) + "\n"


def tracks_table() -> str:
    """The variables of tracks.nc."""
    rows = [f"| `{v.name}` | {', '.join(v.dims)} | {v.unit} | {v.meaning} |" for v in VARIABLES.values()]
    return "| variable | dims | unit | meaning |\n| --- | --- | --- | --- |\n" + "\n".join(rows) + "\n"


MADE: dict[str, Callable[[], str]] = {
    "settings": settings_tables,
    "results": results_tables,
    "tracks": tracks_table,
}


def remade(text: str) -> str:
    """A page's text with its marked parts made anew."""
    return _MARKED.sub(lambda part: f"{part[1]}\n{MADE[part[2]]()}\n{part[3]}", text)


if __name__ == "__main__":
    for page in (HERE / "test-toml.md", HERE / "file-formats.md"):
        page.write_text(remade(page.read_text(encoding="utf-8")), encoding="utf-8")
