"""The chapter of what good practice asks to tell of photographs and correlation, from good_practice.csv."""

import math
import re
from collections.abc import Hashable, Mapping, Sequence

import pandas as pd

from ploughval.report.blocks import Cell, Chapter, Table
from ploughval.report.text import MISSING, brief, number, with_std
from ploughval.report.text import unit as unit_text
from ploughval.results import Results

_FLOORS = "noise floors"
_TITLES = {
    "camera and photographs": "Camera and photographs",
    "pattern": "Pattern",
    "correlation": "Correlation",
    "strain": "Strain",
}
_LEAD = (
    "What a report on digital image correlation should tell (Jones & Iadicola 2018, A Good Practices Guide "
    "for Digital Image Correlation, doi 10.32720/idics/gpg.ed1)."
)
_FORCE_LEAD = "Noise of what was measured, at rest and as the stated uncertainties predict it."
_FOLDED = ("Camera and photographs", "Correlation", "Strain")
_SOURCES = {"exif": "EXIF"}
_UNTOLD = "not told"
_LARGE = 2.0  # measured over predicted
_SHORT_S = 0.5  # exposures below are told as photographers do


def good_practice_chapter(results: Results) -> Chapter | None:
    """Noise floors, then what was photographed with what, and how it was correlated."""
    table = results.practice
    if table is None or table.empty:
        return None
    floors = table[table["group"] == _FLOORS]
    tables = [_floors(floors)] if len(floors) else []
    for group, title in _TITLES.items():
        rows = table[table["group"] == group]
        if len(rows):
            tables.append(_told(title, rows))
    missing = int((table["source"] == _UNTOLD).sum())
    lead = _LEAD if len(floors) < len(table) else _FORCE_LEAD
    notes = [_missing(missing)] if missing else []
    return Chapter("good-practice", "Good practice", lead=lead, tables=tables, notes=notes)


def _missing(count: int) -> str:
    if count == 1:
        return "One value is not known; its row says how it can be told or had."
    return f"{count} values are not known; their rows say how they can be told or had."


def _told(title: str, rows: pd.DataFrame) -> Table:
    """A table of what, value, where it comes from and how it was had."""
    cells = [
        [
            Cell(row["item"]),
            value_cell(row),
            Cell(_unit(row)),
            Cell(_source(row["source"])),
            Cell(_sentence(row["note"])),
        ]
        for row in rows.to_dict("records")
    ]
    head = ("What", "Value", "Unit", "From", "Remarks")
    return Table(title, head, cells, kind="cards", folded=title in _FOLDED)


def _source(name: str) -> str:
    return _SOURCES.get(name, name)


def value_cell(row: Mapping[Hashable, object], digits: int = 4) -> Cell:
    """A value, words, or a dash; so many digits where no uncertainty says how many."""
    text, value, std = str(row["text"]), _number(row["value"]), _number(row["std"])
    if text or value is None:
        return Cell(text or MISSING)
    return Cell(brief(value, digits) if std is None else with_std(value, std), value, std=std)


def _unit(row: Mapping[Hashable, object]) -> str:
    """The unit of a row that has a number; photographers write short exposures as fractions too."""
    value, unit = _number(row["value"]), unit_text(str(row["unit"]))
    if value is None and _number(row["predicted"]) is None:
        return ""
    if row["item"] == "Exposure" and unit == "s" and value is not None and value < _SHORT_S:
        return f"s, 1/{brief(1 / value, 3)}"
    return unit


def _floors(rows: pd.DataFrame) -> Table:
    """A table of noise: what was measured, what was predicted, and their ratio."""
    cells = [_floor(row) for row in rows.to_dict("records")]
    head = ("Quantity", "Measured", "Predicted", "Unit", "Measured / predicted", "Remarks")
    footnotes: Sequence[str] = (
        "Measured: standard deviation of what should not move. Predicted: what the stated standard "
        "uncertainties say of it. A ratio far above 1 means that these are too small; below 1, that they "
        "hold errors which what rests does not show.",
    )
    return Table("Noise floors", head, cells, kind="cards", footnotes=footnotes)


def _floor(row: Mapping[Hashable, object]) -> list[Cell]:
    value, predicted = _number(row["value"]), _number(row["predicted"])
    stated = Cell(number(predicted, 2), predicted)
    ratio = Cell(MISSING)
    if value is not None and predicted:
        share = value / predicted
        ratio = Cell(number(share, 2), share, mark="differs" if share > _LARGE else "")
    note = Cell(_sentence(str(row["note"])))
    return [Cell(str(row["item"])), value_cell(row, 2), stated, Cell(_unit(row)), ratio, note]


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def _sentence(text: str) -> str:
    """A remark that begins with a capital letter; a number or a file's name is left as it is."""
    text = re.sub(r"(?<![\w.\-])-(?=\d)", "−", text)
    first = text[:1]
    return text if not first.isalpha() or _is_name(text) else first.upper() + text[1:]


def _is_name(text: str) -> bool:
    """Whether a text begins with a key of the settings or a file's name."""
    word = text.split(maxsplit=1)[0].rstrip(";,")
    return "." in word.rstrip(".") or "_" in word or "/" in word
