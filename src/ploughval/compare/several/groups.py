"""Which tests repeat each other: by rule, from what their settings state."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ploughval.compare.several.record import Record


class Key(NamedTuple):
    """A setting that parts tests: values this close, or within twice their stated uncertainty, are equal."""

    table: str
    name: str
    relative: float
    absolute: float = 0.0

    @property
    def std_name(self) -> str:
        """The setting that states its standard uncertainty."""
        for ending in ("_kN_m3", "_mm", "_deg", "_kPa"):
            if self.name.endswith(ending):
                return f"{self.name.removesuffix(ending)}_std{ending}"
        return ""


LENGTHS, SPEEDS, ANGLES_DEG = 0.01, 0.1, 0.5
DEPTH = Key("blade", "depth_mm", LENGTHS)
KEYS = (
    DEPTH,
    Key("blade", "width_mm", LENGTHS),
    Key("blade", "thickness_mm", LENGTHS),
    Key("blade", "inclination_deg", 0.0, ANGLES_DEG),
    Key("blade", "speed_mm_s", SPEEDS),
    Key("soil", "unit_weight_kN_m3", LENGTHS),
    Key("soil", "peak_friction_deg", 0.0, ANGLES_DEG),
    Key("soil", "residual_friction_deg", 0.0, ANGLES_DEG),
    Key("soil", "mobilization_length_mm", LENGTHS),
    Key("soil", "wall_friction_deg", 0.0, ANGLES_DEG),
    Key("soil", "repose_deg", 0.0, ANGLES_DEG),
    Key("soil", "surcharge_kPa", LENGTHS),
    Key("model", "initial_surface_mm", 0.0),
)
RULE = (
    f"lengths, unit weights and surcharges within {LENGTHS:.0%}, angles within {ANGLES_DEG:g}°, speeds "
    f"within {SPEEDS:.0%}, or any of them within twice the stated standard uncertainty of their difference, "
    "count as equal"
)
_MODEL_RULES = ("outcrop", "direction", "tolerance")


@dataclass(frozen=True, slots=True)
class Group:
    """Tests that repeat each other.

    Attributes
    ----------
    label : str
        Letter on the page.
    members : tuple of int
        Places of the tests.
    levels : mapping of Key to int
        Which level of every key the tests have.
    """

    label: str
    members: tuple[int, ...]
    levels: Mapping[Key, int]


@dataclass(frozen=True, slots=True)
class Grouping:
    """How tests part into groups.

    Attributes
    ----------
    groups : tuple of Group
        In the order of their levels; each test in one.
    varying : tuple of Key
        What differs between groups.
    copies : mapping of int to int
        Tests measured from the same files as an earlier one; they are in no group.
    model_rules : tuple of str
        Keys of [model] that differ between tests: repeats of a measurement, not of its model.
    """

    groups: tuple[Group, ...]
    varying: tuple[Key, ...]
    copies: Mapping[int, int]
    model_rules: tuple[str, ...]

    def group_of(self, place: int) -> Group | None:
        """The group of a test, None for a copy."""
        return next((group for group in self.groups if place in group.members), None)

    def along(self, key: Key) -> tuple[tuple[Group, ...], ...]:
        """Series of groups that differ in one key alone, each with two levels of it at least."""
        series: dict[Hashable, list[Group]] = {}
        for group in self.groups:
            others = tuple(level for other, level in group.levels.items() if other != key)
            series.setdefault(others, []).append(group)
        return tuple(tuple(groups) for groups in series.values() if len(groups) > 1)


def group_tests(records: Sequence[Record]) -> Grouping:
    """Part tests into groups of repeats.

    Parameters
    ----------
    records : sequence of Record
        Tests; what a test does not state is a level of its own.

    Returns
    -------
    Grouping
        The same parting in whatever order the tests come.
    """
    copies = _copies(records)
    places = [place for place in range(len(records)) if place not in copies]
    levels = {key: _levels([records[place] for place in places], key) for key in KEYS}
    found: dict[tuple[int, ...], list[int]] = {}
    for row, place in enumerate(places):
        found.setdefault(tuple(levels[key][row] for key in KEYS), []).append(place)
    groups = tuple(
        Group(_letters(number), tuple(found[signature]), dict(zip(KEYS, signature, strict=True)))
        for number, signature in enumerate(sorted(found))
    )
    varying = tuple(key for key in KEYS if len({group.levels[key] for group in groups}) > 1)
    rules = tuple(
        name for name in _MODEL_RULES if len({repr(record.setting("model", name)) for record in records}) > 1
    )
    return Grouping(groups, varying, copies, rules)


def _copies(records: Sequence[Record]) -> dict[int, int]:
    """Tests whose measured inputs are those of an earlier one: counted once."""
    first: dict[Hashable, int] = {}
    copies = {}
    for place, record in enumerate(records):
        measured = frozenset(record.inputs.values())
        if measured and first.setdefault(measured, place) != place:
            copies[place] = first[measured]
    return copies


def _levels(records: Sequence[Record], key: Key) -> list[int]:
    """Level of each test: sorted values, a new level where one is beyond the first of the level before."""
    values = [record.number(key.table, key.name) for record in records]
    if not np.isfinite(values).any():
        texts = [repr(record.setting(key.table, key.name)) for record in records]
        order = sorted(set(texts))
        return [order.index(text) for text in texts]
    stds = [np.nan_to_num(record.number(key.table, key.std_name)) for record in records]
    levels = [-1] * len(records)  # not stated
    level, first = -1, (np.nan, 0.0)
    stated = [place for place, value in enumerate(values) if np.isfinite(value)]
    for place in sorted(stated, key=lambda p: (values[p], stds[p])):
        value, std = values[place], float(stds[place])
        reach = max(key.relative * abs(value), key.absolute, 2 * float(np.hypot(std, first[1])))
        if level < 0 or value - first[0] > reach * (1 + 1e-9):
            level, first = level + 1, (value, std)
        levels[place] = level
    return levels


def _letters(number: int) -> str:
    """A to Z, AA, AB."""
    letter = chr(ord("A") + number % 26)
    return letter if number < 26 else _letters(number // 26 - 1) + letter
