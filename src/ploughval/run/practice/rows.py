"""A row of the good-practice table, and the table."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import pandas as pd

from ploughval.axes import PRACTICE_COLUMNS

NAN = float("nan")


class Group(StrEnum):
    """Chapters of the table."""

    CAMERA = "camera and photographs"
    PATTERN = "pattern"
    CORRELATION = "correlation"
    STRAIN = "strain"
    FLOORS = "noise floors"


class Source(StrEnum):
    """Where a value comes from."""

    SETTING = "setting"
    EXIF = "exif"
    MEASURED = "measured"
    PREDICTED = "predicted"
    PROGRAM = "program"
    BENCHMARK = "benchmark"
    UNTOLD = "not told"


@dataclass(frozen=True, slots=True)
class Row:
    """One thing to report.

    Attributes
    ----------
    group, item : what it is
    source : where it comes from
    value, std : number and its standard uncertainty, in ``unit``; NaN: none
    text : words in place of a number
    predicted : what the project's own uncertainties say of the same, in ``unit``
    note : how it was had; for what is not told, how to tell it
    """

    group: Group
    item: str
    source: Source
    value: float = NAN
    std: float = NAN
    unit: str = ""
    text: str = ""
    predicted: float = NAN
    note: str = ""


def plain(value: float, digits: int = 2) -> str:
    """A number in words, without powers of ten.

    >>> plain(-3.14e-05), plain(0.527)
    ('-0.000031', '0.53')
    """
    return np.format_float_positional(value, digits, unique=False, fractional=False, trim="-")


def untold(group: Group, item: str, remedy: str, unit: str = "") -> Row:
    """A row without a value, and how it can be had."""
    return Row(group, item, Source.UNTOLD, unit=unit, note=remedy)


def told(group: Group, item: str, text: str, remedy: str) -> Row:
    """A row of words from the settings; untold where these are empty."""
    if not text:
        return untold(group, item, remedy)
    return Row(group, item, Source.SETTING, text=text)


def to_table(rows: Iterable[Row]) -> pd.DataFrame:
    """The rows as PRACTICE_COLUMNS."""
    records = [
        (
            row.group.value,
            row.item,
            row.value,
            row.std,
            row.unit,
            row.text,
            row.source.value,
            row.predicted,
            row.note,
        )
        for row in rows
    ]
    return pd.DataFrame(records, columns=PRACTICE_COLUMNS)
