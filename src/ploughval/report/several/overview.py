"""Chapter: which tests there are, which repeat each other, and what differs between the others."""

import numpy as np

from ploughval.axes import unit_of
from ploughval.compare.several.groups import KEYS, RULE, Group, Key
from ploughval.report.blocks import Cell, Chapter, Table
from ploughval.report.several.findings import SeveralFindings
from ploughval.report.text import brief, label, number, unit
from ploughval.report.verdict import travel_mm, verdict


def overview_chapter(found: SeveralFindings) -> Chapter:
    """Tests, groups and the rule that made them."""
    head = ("Test", "Group", "Depth d, mm", "P₀, N", "Verdict")
    rows = [
        [
            Cell(name),
            Cell(found.group_label(place)),
            Cell(number(test.depth_mm, 3), test.depth_mm),
            Cell(number(test.P0_N), test.P0_N),
            Cell(verdict(test)),
        ]
        for place, (name, test) in enumerate(zip(found.names, found.tests, strict=True))
    ]
    return Chapter(
        "overview",
        "Tests",
        lead=f"Tests of one group repeat each other by what their settings state: {RULE}.",
        notes=_notes(found),
        faults=_faults(found),
        tables=[_groups(found), Table("Tests", head, rows, kind="cards")],
    )


def _groups(found: SeveralFindings) -> Table:
    varying = found.grouping.varying
    rows = [
        [
            Cell(group.label),
            Cell(str(len(group.members)), float(len(group.members))),
            *(Cell(_setting(found, group, key)) for key in varying),
            Cell(found.members(group)),
        ]
        for group in found.grouping.groups
    ]
    return Table("Groups", ("Group", "Tests", *(_head(key) for key in varying), "Names"), rows, kind="cards")


_SAME_TRAVEL = 0.05  # travels that differ by less are alike
_OWN_UNITS = {"_mm_s": "mm/s", "_kPa": "kPa"}


def _words_of(key: Key) -> tuple[str, str]:
    """Words and unit of a key of test.toml."""
    for ending, measure in _OWN_UNITS.items():
        if key.name.endswith(ending):
            return label(key.name.removesuffix(ending)), measure
    return label(key.name), unit(unit_of(key.name))


def _head(key: Key) -> str:
    words, measure = _words_of(key)
    return f"{words}, {measure}" if measure else words


def _with_unit(key: Key, value: str) -> str:
    """A key with its value in a sentence."""
    words, measure = _words_of(key)
    gap = "" if measure == "°" else " "
    return f"{words.lower()} {value}{gap}{measure}".rstrip()


def _setting(found: SeveralFindings, group: Group, key: Key) -> str:
    """The value that a group's tests state, or the range of theirs."""
    values = [found.records[place].number(key.table, key.name) for place in group.members]
    if not np.isfinite(values).any():
        stated = found.records[group.members[0]].setting(key.table, key.name)
        return "not stated" if stated is None else str(stated)
    low, high = min(values), max(values)
    return brief(low) if low == high else f"{brief(low)} to {brief(high)}"


_LONGEST = 300  # characters of a test's notes beside those of others


def _notes(found: SeveralFindings) -> list[str]:
    grouping = found.grouping
    repeated = [group for group in grouping.groups if len(group.members) > 1]
    if not grouping.varying:
        said = ["All tests repeat each other." if repeated else "The settings of all tests are alike."]
    else:
        names = ", ".join(f"{key.table}.{key.name}" for key in grouping.varying)
        said = [f"Between groups differs: {names}."]
    if not repeated:
        said.append("No test repeats another: nothing can be said of repeatability.")
    same = [key for key in KEYS if key not in grouping.varying and _stated(found, key)]
    if same and grouping.groups:
        everyone = _everyone(grouping.groups)
        held = ", ".join(_with_unit(key, _setting(found, everyone, key)) for key in same)
        said.append(f"The same in all: {held}.")
    return said + _remarks(found)


def _remarks(found: SeveralFindings) -> list[str]:
    """What the tests' own notes say: those that are alike in one line, long ones cut."""
    named: dict[str, list[str]] = {}
    for name, test in zip(found.names, found.tests, strict=True):
        text = " ".join(str(test.setting("test", "notes") or "").split())
        if text:
            named.setdefault(text if len(text) <= _LONGEST else f"{text[:_LONGEST].rstrip()} …", []).append(
                name
            )
    return [f"{', '.join(names)}: {text}" for text, names in named.items()]


def _everyone(groups: tuple[Group, ...]) -> Group:
    return Group("", tuple(place for group in groups for place in group.members), {})


def _stated(found: SeveralFindings, key: Key) -> bool:
    return any(record.setting(key.table, key.name) is not None for record in found.records)


def _faults(found: SeveralFindings) -> list[str]:
    said = [
        f"{found.names[copy]} was measured from the same files as {found.names[first]}: they count as one "
        "test, and only the first takes part in scatter, depth and mean errors."
        for copy, first in found.grouping.copies.items()
    ]
    if found.grouping.model_rules:
        keys = ", ".join(f"model.{name}" for name in found.grouping.model_rules)
        said.append(
            f"The model was not run alike for all tests: {keys} differs. Mean errors mix its variants."
        )
    return said + [text for group in found.grouping.groups if (text := _travels(found, group))]


def _travels(found: SeveralFindings, group: Group) -> str:
    """What repeats over travels of different length do not show; nothing where they are alike."""
    known = [travel for place in group.members if (travel := travel_mm(found.tests[place])) is not None]
    if len(known) < 2 or max(known) <= (1 + _SAME_TRAVEL) * min(known):
        return ""
    travels = f"{brief(min(known), 3)} to {brief(max(known), 3)} mm"
    return (
        f"In group {group.label} the blade travels {travels}. Means, work, counts and what is read at the "
        "end are taken over each test's own travel: their scatter is not that of repeats."
    )
