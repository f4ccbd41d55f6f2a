"""A drawing as a small inline SVG: hundredths of a unit, one class a style, no group without purpose."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

UNITS = 100  # quanta of a coordinate in a user unit
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")
_REFERENCE = re.compile(r"^(?:#|url\(#)([^)]+)")
_KNOWN_PATH = re.compile(r"[MLQCzZ\s\d.,e+-]*")
_POINTS = {"M": 1, "L": 1, "Q": 2, "C": 3}
_PLACES = frozenset({"x", "y", "x1", "x2", "y1", "y2", "cx", "cy", "width", "height"})
_NO_TURN = re.compile(r"rotate\(-?0(?:\.0+)?(?: [^)]*)?\)")


@dataclass(slots=True)
class _Names:
    """Short names, given in the order in which they are asked for."""

    prefix: str
    given: dict[str, str] = field(default_factory=dict)

    def of(self, what: str) -> str:
        if what not in self.given:
            self.given[what] = self.prefix + _letters(len(self.given))
        return self.given[what]


def compact(source: str, key: str, restyle: Callable[[str], str]) -> str:
    """The content of an SVG document, much shorter, drawing the same.

    Parameters
    ----------
    source : str
        An SVG file as matplotlib writes it.
    key : str
        Begins every id and class, so that drawings of one page do not meet.
    restyle : callable
        Makes a style attribute's text into the one that is written.

    Returns
    -------
    str
        Elements without the outer ``svg``; coordinates are off by 0.005 user units at most.
    """
    root = ET.fromstring(source)
    ids, styles = _Names(f"{key}-"), _Names(f"{key}_")
    _write_ids(root, ids)
    body = "".join(part for child in root for part in _written(child, ids, styles, restyle))
    rules = "".join(f".{name}{{{text}}}" for text, name in styles.given.items())
    return f"<style>{escaped(rules)}</style>{body}"


def path_data(text: str) -> str:
    """Path data (M, L, Q, C, z; absolute) in steps of hundredths from point to point.

    >>> path_data("M 10 20 L 10.004 30.5 L 12 30.5 z")
    'M10 20v10.5h2z'
    """
    if not _KNOWN_PATH.fullmatch(text):
        return text
    out: list[str] = []
    at, begun = (0, 0), (0, 0)
    tokens = iter(text.replace(",", " ").split())
    last = ""
    for command in tokens:
        if command in "zZ":
            out.append("z")
            at, last = begun, "z"
            continue
        points = [(_units(next(tokens)), _units(next(tokens))) for _ in range(_POINTS[command])]
        if command == "M":
            out.append("M" + _pair(*points[0]))
            begun, last = points[0], "M"
        else:
            step, last = _step(command, points, at, last)
            out.append(step)
        at = points[-1]
    return "".join(out)


def _step(command: str, points: list[tuple[int, int]], at: tuple[int, int], last: str) -> tuple[str, str]:
    """A segment relative to where the pen is; the letter is left out where it is that of the last."""
    moves = [(x - at[0], y - at[1]) for x, y in points]
    if command != "L":
        return command.lower() + _joined([value for move in moves for value in move]), command
    dx, dy = moves[0]
    if (dx, dy) == (0, 0) and last != "M":
        return "", last
    if dy == 0 or dx == 0:
        letter, value = ("h", dx) if dy == 0 else ("v", dy)
        return (letter if letter != last else _gap(value)) + _plain(value), letter
    text = _pair(dx, dy)
    return ("l" if last != "l" else _gap(dx)) + text, "l"


def _write_ids(root: ET.Element, ids: _Names) -> None:
    """Name what is referred to, in the order of the references."""
    for element in root.iter():
        for name, value in element.attrib.items():
            if _local(name) in ("href", "clip-path"):
                for referred in _REFERENCE.findall(value):
                    ids.of(referred)


def _written(
    element: ET.Element, ids: _Names, styles: _Names, restyle: Callable[[str], str]
) -> Iterator[str]:
    tag = _local(element.tag)
    if tag in ("metadata", "style"):
        return
    attributes = _attributes(element.attrib, ids, styles, restyle)
    text = element.text or ""
    inner = "" if text.isspace() else escaped(text)
    for child in element:
        inner += "".join(_written(child, ids, styles, restyle))
        inner += "" if not child.tail or child.tail.isspace() else escaped(child.tail)
    if tag in ("g", "defs") and not inner:
        return
    if tag == "g" and not attributes:
        yield inner
        return
    head = f"<{tag}" + "".join(f' {name}="{escaped(value)}"' for name, value in attributes.items())
    yield f"{head}>{inner}</{tag}>" if inner else f"{head}/>"


def _attributes(
    given: Mapping[str, str], ids: _Names, styles: _Names, restyle: Callable[[str], str]
) -> dict[str, str]:
    out: dict[str, str] = {}
    for full, value in given.items():
        name = _local(full)
        if name == "id":
            if value in ids.given:
                out["id"] = ids.given[value]
        elif name == "style":
            out["class"] = styles.of(restyle(re.sub(r"\s*([:;])\s*", r"\1", value.strip().rstrip(";"))))
        elif name == "href" and value.startswith("#"):
            out["href"] = "#" + ids.given[value[1:]]
        elif name == "clip-path":
            out[name] = f"url(#{ids.given[value[5:-1]]})"
        elif name == "d":
            out[name] = path_data(value)
        elif name in _PLACES:
            out[name] = " ".join(_plain(_units(part)) for part in value.split())
        elif name == "transform":
            turned = _NUMBER.sub(lambda found: f"{float(found.group()):.6g}", _NO_TURN.sub("", value)).strip()
            out |= {"transform": turned} if turned else {}
        else:
            out[name] = value
    return out


def _units(text: str) -> int:
    return round(float(text) * UNITS)


def _plain(units: int) -> str:
    """So many hundredths as the shortest decimal number."""
    whole, part = divmod(abs(units), UNITS)
    digits = f"{part:02d}".rstrip("0")
    text = f"{whole if whole or not digits else ''}{'.' if digits else ''}{digits}"
    return f"-{text}" if units < 0 else text


def _gap(units: int) -> str:
    return "" if units < 0 else " "


def _pair(x: int, y: int) -> str:
    return _joined([x, y])


def _joined(values: list[int]) -> str:
    return "".join((_gap(value) if i else "") + _plain(value) for i, value in enumerate(values))


def _local(name: str) -> str:
    return name.rpartition("}")[2]


def _letters(number: int) -> str:
    """0, 1, ... 25, 26 as a, b, ... z, aa."""
    text = ""
    number += 1
    while number:
        number, rest = divmod(number - 1, 26)
        text = chr(ord("a") + rest) + text
    return text


def escaped(text: str) -> str:
    """Text as it stands between elements or in an attribute."""
    for mark, entity in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ('"', "&quot;")):
        text = text.replace(mark, entity)
    return text
