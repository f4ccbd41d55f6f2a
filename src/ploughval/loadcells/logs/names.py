"""Which columns of a log are meant: by their names in [loadcells.columns], units apart."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ploughval.errors import DataError
from ploughval.loadcells.logs.units import named_unit, stem_and_unit, unit_factor
from ploughval.scene import LogColumns

VALUE_COLUMNS = ("displacement_mm", "moment_upper", "moment_lower")
KINDS = {"time_s": "time", "displacement_mm": "length", "moment_upper": "moment", "moment_lower": "moment"}


@dataclass(frozen=True, slots=True)
class Wanted:
    """The columns to be read.

    Attributes
    ----------
    names : mapping of str
        What the log calls time_s, displacement_mm, moment_upper, moment_lower and, where set, date.
    optional : frozenset of str
        Those that may be missing.
    """

    names: Mapping[str, str]
    optional: frozenset[str]


def wanted_columns(columns: LogColumns, *, rate_hz: float | None) -> Wanted:
    """The columns that test.toml asks for; the time may be missing where the rate is known."""
    names = {
        "time_s": columns.time_s,
        "displacement_mm": columns.displacement_mm,
        "moment_upper": columns.moment_upper_Nm,
        "moment_lower": columns.moment_lower_Nm,
    }
    if columns.date is not None:
        names["date"] = columns.date
    return Wanted(names, frozenset() if rate_hz is None else frozenset({"time_s"}))


def matches(name: str, there: Sequence[str]) -> list[int]:
    """Places of the columns that a name means: as written, else whatever the case, else units apart."""
    if not name:
        return []
    exact = [k for k, other in enumerate(there) if other == name]
    folded = [k for k, other in enumerate(there) if other.casefold() == name.casefold()]
    if exact or folded:
        return exact or folded
    stem = stem_and_unit(name)[0].casefold()
    return [k for k, other in enumerate(there) if stem and stem_and_unit(other)[0].casefold() == stem]


def find_places(there: Sequence[str], wanted: Wanted, path: Path) -> dict[str, int]:
    """Place of every wanted column that is there.

    A whole number that names no column is a place, counted from 1.

    Raises
    ------
    DataError
        Columns are missing, or a name fits several.
    """
    places: dict[str, int] = {}
    missing: list[str] = []
    for key, name in wanted.names.items():
        found = matches(name, there)
        stem = stem_and_unit(name)[0]
        if not found and stem.isdecimal() and len(stem) < 6 and 0 < int(stem) <= len(there):
            found = [int(stem) - 1]
        if len(found) > 1:
            several = ", ".join(str(k + 1) for k in found)
            raise DataError(
                f"the name {name!r} fits the columns {several}: write the number of the right one "
                "in place of its name in [loadcells.columns] of test.toml",
                path=path,
            )
        if found:
            places[key] = found[0]
        elif key not in wanted.optional:
            missing.append(name)
    if missing:
        shown = ", ".join(name for name in there if name)
        hint = " Without a column of time, give rate_hz." if wanted.names["time_s"] in missing else ""
        raise DataError(
            f"no column {', '.join(map(repr, missing))}; the columns there are: {shown}. "
            f"Name the right ones in [loadcells.columns] of test.toml.{hint}",
            path=path,
        )
    return places


def column_unit(key: str, name: str, header: str, below: str, path: Path) -> str:
    """The unit of a column: from its header, the row of units below, or the name in test.toml; '' for none.

    Raises
    ------
    DataError
        Two of them name units that are not the same.
    """
    kind = KINDS[key]
    told = [unit for unit in (named_unit(header, kind), below.strip(), stem_and_unit(name)[1]) if unit]
    known = {unit: unit_factor(unit, kind) for unit in told}
    factors = {factor for factor in known.values() if factor is not None}
    if len(factors) > 1:
        raise DataError(
            f"column {header!r} is said to be in {' and in '.join(map(repr, known))}; expected one unit in "
            "its header, in the row of units and in [loadcells.columns]. Correct the wrong one",
            path=path,
        )
    # A unit that is known tells more than one that is not.
    return next((unit for unit, factor in known.items() if factor is not None), told[0] if told else "")
