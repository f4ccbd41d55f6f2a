"""Signed distance of points from a line that may be torn: along its normal, or to its nearest corner."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
_SLACK = 1e-9  # share of a segment


@dataclass(frozen=True, slots=True, eq=False)
class Nearest:
    """Where points lie from a line.

    Attributes
    ----------
    distance_mm : (N,) float
        Positive on the line's left, which is above for one that runs along x; NaN without a segment.
    beyond : (N,) bool
        The nearest place lies past one of the line's outermost ends: there is nothing to compare with.
    past_tear_mm : (N,) float
        How far along the line a point lies past the end of a piece at a tear; 0 where it has a normal.
    """

    distance_mm: Floats
    beyond: Flags
    past_tear_mm: Floats


def nearest_on_line(points_mm: Floats, line_mm: Floats) -> Nearest:
    """Distances of points from the pieces of a line.

    Parameters
    ----------
    points_mm : (N, 2) float, mm
        All finite.
    line_mm : (M, 2) float, mm
        In order along the line; rows of NaN tear it: no segment spans them.

    Returns
    -------
    Nearest
    """
    start, end, joined = _segments(line_mm)
    if not len(start):
        nothing = np.zeros(len(points_mm))
        return Nearest(nothing * np.nan, np.ones(len(points_mm), dtype=bool), nothing)
    which, share = _search(np.ascontiguousarray(points_mm), start, end)
    along = (end - start)[which]
    length = np.hypot(*along.T)
    at = start[which] + np.clip(share, 0.0, 1.0)[:, None] * along
    offset = points_mm - at
    before, after = share < -_SLACK, share > 1.0 + _SLACK
    normal = _normals(start, end, joined)
    own = normal[0][which]
    own = np.where((share <= _SLACK)[:, None], normal[1][which], own)
    own = np.where((share >= 1.0 - _SLACK)[:, None], normal[2][which], own)
    side = np.where((offset * own).sum(axis=1) < 0.0, -1.0, 1.0)
    beyond = (before & (which == 0)) | (after & (which == len(start) - 1))
    free_start, free_end = ~joined, ~np.append(joined[1:], False)
    over = np.where(before & free_start[which], -share, 0.0) + np.where(
        after & free_end[which], share - 1.0, 0.0
    )
    return Nearest(side * np.hypot(*offset.T), beyond, np.where(beyond, 0.0, over * length))


def _segments(line_mm: Floats) -> tuple[Floats, Floats, Flags]:
    """Starts and ends (S, 2) of segments, and whether each goes on from the one before it.

    A vertex alone between tears is a segment without length.
    """
    known: Flags = np.asarray(np.isfinite(line_mm).all(axis=1))
    pair = known[:-1] & known[1:]
    alone = known & ~np.append(pair, False) & ~np.append(False, pair)
    first = np.flatnonzero(np.append(pair, False) | alone)
    follows = np.append(False, (np.diff(first) == 1) & ~alone[first[:-1]] & ~alone[first[1:]])[: len(first)]
    last = np.where(alone[first], first, first + 1)
    return np.ascontiguousarray(line_mm[first]), np.ascontiguousarray(line_mm[last]), follows


def _normals(start: Floats, end: Floats, joined: Flags) -> tuple[Floats, Floats, Floats]:
    """Left normals (S, 2) of segments, and of their two corners: between neighbours the mean of both."""
    along = end - start
    length = np.hypot(*along.T)[:, None]
    safe = np.where(length > 0, length, 1.0)
    normal = np.where(length > 0, np.column_stack([-along[:, 1], along[:, 0]]) / safe, [0.0, 1.0])
    at_start = np.where(joined[:, None], normal + np.roll(normal, 1, axis=0), normal)
    goes_on = np.append(joined[1:], False)[:, None]
    at_end = np.where(goes_on, normal + np.roll(normal, -1, axis=0), normal)
    return normal, at_start, at_end


@njit(cache=True, nogil=True)  # type: ignore[misc]
def _search(points: Floats, start: Floats, end: Floats) -> tuple[NDArray[np.int64], Floats]:
    """Nearest segment of every point, and the foot's share of it (outside 0 to 1: past an end)."""
    which, share = np.zeros(len(points), np.int64), np.zeros(len(points))
    for k in range(len(points)):
        best = np.inf
        for m in range(len(start)):
            ax, ay = end[m, 0] - start[m, 0], end[m, 1] - start[m, 1]
            dx, dy = points[k, 0] - start[m, 0], points[k, 1] - start[m, 1]
            square = ax * ax + ay * ay
            part = (dx * ax + dy * ay) / square if square > 0.0 else 0.0
            inside = min(max(part, 0.0), 1.0)
            gx, gy = dx - inside * ax, dy - inside * ay
            far = gx * gx + gy * gy
            if far < best:
                best, which[k], share[k] = far, m, part
    return which, share
