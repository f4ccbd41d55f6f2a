"""Numbers in texts of one form, as hours and minutes in a time: read for many rows at a time.

Rows whose digits stand in the same places as in one row that a pattern matched are read by arithmetic on
their bytes; rows in forms that are too many for this are matched one by one.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

_WIDTH = 40  # letters; no time is as long
_BLOCK = 1 << 18
_FORMS = 64  # looked for in each block of rows
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")


@dataclass(frozen=True, slots=True)
class Fields:
    """Named numbers of each row: (N,) int, -1 where a row's form has not the field; ``matched`` (N,) bool."""

    numbers: Mapping[str, NDArray[np.int32]]
    matched: NDArray[np.bool_]


def read_fields(column: pd.Series, pattern: re.Pattern[str]) -> Fields:
    """The named groups of a pattern in each row, as whole numbers.

    Parameters
    ----------
    column : (N,) Series
        Text. What the pattern does not match is not matched.
    pattern : Pattern
        Groups of digits give their number; ``f`` decimals of a second, in microseconds; ``ap`` 0 for AM and
        12 for PM; ``z`` the zone's minutes; three or more letters the month of that name.

    Returns
    -------
    Fields
        Beside the groups, ``group_digits`` holds how many digits the group has.
    """
    words = column.to_numpy(dtype=object)
    names = [key for group in pattern.groupindex for key in (group, f"{group}_digits")]
    numbers = {name: np.full(words.size, -1, dtype=np.int32) for name in names}
    matched = np.zeros(words.size, dtype=bool)
    for start in range(0, words.size, _BLOCK):
        block = slice(start, min(start + _BLOCK, words.size))
        _read_block(
            _as_bytes(words[block]), pattern, {k: v[block] for k, v in numbers.items()}, matched[block]
        )
    return Fields(numbers, matched)


def _as_bytes(words: NDArray[np.object_]) -> NDArray[np.bytes_]:
    try:
        return np.array(words, dtype=f"S{_WIDTH}")
    except UnicodeEncodeError:
        return np.array([str(word).encode("ascii", "replace") for word in words], dtype=f"S{_WIDTH}")


def _read_block(
    cells: NDArray[np.bytes_],
    pattern: re.Pattern[str],
    numbers: Mapping[str, NDArray[np.int32]],
    matched: NDArray[np.bool_],
) -> None:
    letters = np.ascontiguousarray(cells.view(np.uint8).reshape(-1, _WIDTH).T)
    left = np.arange(cells.size)
    for _ in range(_FORMS):
        if left.size == 0:
            return
        found = pattern.fullmatch(cells[left[0]].decode())
        if found is None:
            left = left[1:]
            continue
        part = letters if left.size == cells.size else letters[:, left]
        alike = _alike(part, found)
        rows = left[alike]
        part = part if alike.all() else part[:, alike]
        for name, value in _values(found, part).items():
            numbers[name][rows] = value
        matched[rows] = True
        left = left[~alike]
    for row in left.tolist():
        found = pattern.fullmatch(cells[row].decode())
        if found is not None:
            matched[row] = True
            for name, value in _values(found, letters[:, row : row + 1]).items():
                numbers[name][row : row + 1] = value


def _number_spans(found: re.Match[str]) -> dict[str, tuple[int, int]]:
    """First letter and letter after the last of each group of digits."""
    return {
        name: found.span(name)
        for name, text in found.groupdict().items()
        if text is not None and text.isdecimal() and name not in ("ap", "z")
    }


def _alike(letters: NDArray[np.uint8], found: re.Match[str]) -> NDArray[np.bool_]:
    """Which rows have digits where this one has numbers, and the same letters elsewhere."""
    text = found[0].encode()
    digits = {k for start, end in _number_spans(found).values() for k in range(start, end)}
    alike = np.ones(letters.shape[1], dtype=bool)
    for k in range(min(len(text) + 1, _WIDTH)):
        if k in digits:
            alike &= (letters[k] >= 48) & (letters[k] <= 57)
        else:
            alike &= letters[k] == (text[k] if k < len(text) else 0)
    return alike


def _values(found: re.Match[str], letters: NDArray[np.uint8]) -> dict[str, NDArray[np.int32] | int]:
    """The fields of rows that are alike."""
    values: dict[str, NDArray[np.int32] | int] = {}
    for name, (start, end) in _number_spans(found).items():
        end = min(end, start + (6 if name == "f" else 9))
        value = np.zeros(letters.shape[1], dtype=np.int32)
        for k in range(start, end):
            value = 10 * value + (letters[k].astype(np.int32) - 48)
        values[name] = value * 10 ** (6 - (end - start)) if name == "f" else value
        values[f"{name}_digits"] = end - start
    for name, text in found.groupdict().items():
        if text is None or name in values:
            continue
        if name == "ap":
            values[name] = 12 * (text.strip().lower() == "pm")
        elif name == "z":
            plain = re.sub(r"[\s:]", "", text)
            minutes = 0 if plain == "Z" else 60 * int(plain[1:3]) + int(plain[3:5])
            # -1 stands for no zone: shifted so that none of them is.
            values[name] = 1440 + (-minutes if plain.startswith("-") else minutes)
        else:
            month = text[:3].lower()
            values[name] = _MONTHS.index(month) + 1 if month in _MONTHS else 0
            values[f"{name}_digits"] = 0
    return values
