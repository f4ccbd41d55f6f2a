"""Regions of a photograph: sand, air, blade, and the trench behind it."""

import numpy as np
from numba import njit

from ploughval.axes import Region
from ploughval.tracers.view import Bytes, Floats

_AIR, _SAND, _BLADE, _TRENCH = (int(r) for r in (Region.AIR, Region.SAND, Region.BLADE, Region.TRENCH))


def regions(shape: tuple[int, int], top_row: Floats, tip_row: float, blade: tuple[float, float]) -> Bytes:
    """What each pixel of the grid shows.

    Sand lies ahead of the face under the surface, and everywhere below the tip's level.

    Parameters
    ----------
    shape : (int, int)
        Of the grid.
    top_row : (w,) float
        Row of the surface in each column; NaN: none above the tip's level.
    tip_row : float
        Row of the tip.
    blade : (float, float)
        Columns of the blade's back and of its face; NaN: no sand above the tip's level.

    Returns
    -------
    (h, w) uint8, codes of :class:`ploughval.axes.Region`
    """
    back, face = blade
    column = np.arange(shape[1])
    above = np.full(shape[1], _TRENCH, np.uint8)
    above[column >= back - 0.5] = _BLADE
    above[column > face + 0.5] = _AIR
    if not np.isfinite(face):
        above[:] = _AIR
    floor = np.floor(tip_row) + 1
    border = np.full(shape[1], floor)
    border[above == _BLADE] = np.floor(tip_row + 0.5) + 1
    ahead = (column > face + 0.5) & np.isfinite(top_row)
    border[ahead] = np.minimum(np.floor(top_row[ahead]) + 1, floor)
    out = np.empty(shape, np.uint8)
    fill(above, np.clip(border, 0, shape[0]).astype(np.int64), out)
    return out


@njit(cache=True, nogil=True)
def fill(above, border, out):  # type: ignore[no-untyped-def]
    """One code above each column's border row, sand from there on: written into out (h, w) uint8."""
    highest, lowest = border.min(), border.max()
    for row in range(out.shape[0]):
        if row < highest:
            out[row] = above
        elif row >= lowest:
            out[row] = _SAND
        else:
            for column in range(out.shape[1]):
                out[row, column] = above[column] if row < border[column] else _SAND
