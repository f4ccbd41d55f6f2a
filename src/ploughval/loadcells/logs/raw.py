"""One file's columns as they are written, before their times and units are understood."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.loadcells.logs.rows import FileRows


@dataclass(frozen=True, slots=True)
class RawLog:
    """Columns of one file.

    Attributes
    ----------
    path : Path
    time, date : (N,) Series or None
        Numbers, text or date-times as written; None where the file holds no such column.
    values : mapping of (N,) float
        displacement_mm, moment_upper, moment_lower in the file's own units; NaN where there is no number.
    headers, units : mapping of str
        What the file calls time_s and those, and their units as told; '' for none.
    rows : FileRows
    faults : tuple of str
    """

    path: Path
    time: pd.Series | None
    date: pd.Series | None
    values: Mapping[str, NDArray[np.float64]]
    headers: Mapping[str, str]
    units: Mapping[str, str]
    rows: FileRows
    faults: tuple[str, ...] = ()
