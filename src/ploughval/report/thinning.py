"""Curves drawn by fewer rows: of every stretch the least and the greatest, so that no peak is lost."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOST_POINTS = 1000
CHART_PX = 720


def extremes(values: Floats, edges: Sequence[int]) -> set[int]:
    """Places of the least and the greatest of each stretch between edges; its first where none is finite."""
    keep: set[int] = set()
    for start, stop in pairwise(edges):
        part = values[start:stop]
        if np.isfinite(part).any():
            keep |= {start + int(np.nanargmin(part)), start + int(np.nanargmax(part))}
        elif stop > start:
            keep.add(start)
    return keep


def thin(table: pd.DataFrame, column: str, most: int = MOST_POINTS) -> pd.DataFrame:
    """At most so many rows that draw the same line: of every run of rows the least and the greatest.

    Parameters
    ----------
    table : DataFrame
        Rows in the order in which they are drawn.
    column : str
        What is drawn.
    most : int
        Rows to keep; shorter tables come back unchanged.
    """
    if len(table) <= most:
        return table
    values = table[column].to_numpy(float)
    edges = np.linspace(0, len(values), most // 2 + 1).astype(int).tolist()
    return table.iloc[sorted({0, len(values) - 1} | extremes(values, edges))]


def thinned_rows(u: Floats, values: Floats, pixels: int = CHART_PX) -> NDArray[np.int64]:
    """Rows that draw the same curve: in every pixel of u the least and the greatest, and the ends of pieces.

    Parameters
    ----------
    u, values : (N,) float
        In the order in which rows are joined; values may have gaps.
    pixels : int
        Across the range of u.
    """
    good = np.flatnonzero(np.isfinite(u) & np.isfinite(values))
    if len(good) <= 2 * pixels:
        return good
    low, high = float(u[good].min()), float(u[good].max())
    pixel = np.floor((u[good] - low) * (pixels / max(high - low, 1e-12))).astype(np.int64)
    piece = np.r_[True, np.diff(good) > 1]
    keep = {*np.flatnonzero(piece).tolist(), *(np.flatnonzero(np.r_[piece[1:], True])).tolist()}
    starts = np.flatnonzero(piece | np.r_[True, np.diff(pixel) != 0])
    keep |= extremes(values[good], [*starts.tolist(), len(good)])
    return np.asarray(good[sorted(keep)], dtype=np.int64)
