"""Columns of text tables as numbers."""

import math
import re
import sys

import numpy as np
import pandas as pd
from numpy.typing import NDArray

_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*", re.ASCII)


def floats_of(column: pd.Series) -> NDArray[np.float64]:
    """A column as float64: NaN where there is no number, infinite where no float is so large.

    Parameters
    ----------
    column : (N,) Series
        Cells as read: numbers, text, whole numbers of any length.

    Returns
    -------
    (N,) float

    Examples
    --------
    >>> floats_of(pd.Series(["1.5", "x", "-1e400", 10**400], dtype=object)).tolist()
    [1.5, nan, -inf, inf]
    """
    try:
        found = pd.to_numeric(column, errors="coerce")
    except OverflowError:  # whole numbers of hundreds of digits
        found = pd.to_numeric(column.map(_in_range), errors="coerce")
    floats: NDArray[np.float64] = found.to_numpy(dtype=np.float64, copy=True)
    if not pd.api.types.is_numeric_dtype(column):
        missing = np.isnan(floats)
        floats[missing] = [_float_of(cell) for cell in column[missing].to_numpy(dtype=object)]
    return floats


def _in_range(cell: object) -> object:
    if not isinstance(cell, int) or abs(cell) <= sys.float_info.max:
        return cell
    return math.inf if cell > 0 else -math.inf


def _float_of(cell: object) -> float:
    """Of a text that is a number pandas has none for: before pandas 3 one that no float is so large as."""
    return float(cell) if isinstance(cell, str) and _NUMBER.fullmatch(cell) else math.nan
