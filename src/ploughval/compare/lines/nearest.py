"""Signed distance of points from a line that may be torn: along its normal, or to its nearest corner."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
SLACK = 1e-9  # share of a segment
_APART_MM = 1e6


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
    arc_mm : (N,) float
        Where along the line the nearest place lies; see ``arcs``.
    """

    distance_mm: Floats
    beyond: Flags
    past_tear_mm: Floats
    arc_mm: Floats


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
    start, end, joined, first = _segments(line_mm)
    if not len(start):
        nothing = np.zeros(len(points_mm))
        return Nearest(nothing * np.nan, np.ones(len(points_mm), dtype=bool), nothing, nothing * np.nan)
    points = np.ascontiguousarray(points_mm)
    distance, beyond, past, which, along = _search(points, start, end, joined, *_normals(start, end, joined))
    arc = arcs(line_mm)[np.flatnonzero(np.isfinite(line_mm).all(axis=1)).searchsorted(first)]
    return Nearest(distance, beyond, past, arc[which] + along)


def arcs(line_mm: Floats) -> Floats:
    """Place along a line of each of its finite vertices, mm; pieces are a long way apart."""
    known = np.flatnonzero(np.isfinite(line_mm).all(axis=1))
    step = np.hypot(*np.diff(line_mm[known], axis=0).T)
    return np.append(0.0, np.cumsum(np.where(np.diff(known) == 1, step, _APART_MM)))[: len(known)]


def _segments(line_mm: Floats) -> tuple[Floats, Floats, Flags, NDArray[np.int64]]:
    """Starts and ends (S, 2) of segments, whether each goes on from the one before it, and its first vertex.

    A vertex alone between tears is a segment without length.
    """
    known: Flags = np.asarray(np.isfinite(line_mm).all(axis=1))
    pair = known[:-1] & known[1:]
    alone = known & ~np.append(pair, False) & ~np.append(False, pair)
    first = np.flatnonzero(np.append(pair, False) | alone)
    follows = np.append(False, (np.diff(first) == 1) & ~alone[first[:-1]] & ~alone[first[1:]])[: len(first)]
    last = np.where(alone[first], first, first + 1)
    return np.ascontiguousarray(line_mm[first]), np.ascontiguousarray(line_mm[last]), follows, first


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


@njit(cache=True, nogil=True)
def _search(
    points: Floats,
    start: Floats,
    end: Floats,
    joined: Flags,
    normal: Floats,
    at_start: Floats,
    at_end: Floats,
) -> tuple[Floats, Flags, Floats, NDArray[np.int64], Floats]:
    """Signed distance of every point, whether beyond, way past a torn end, segment, and way on that."""
    count, last = len(points), len(start) - 1
    distance, beyond, past = np.zeros(count), np.zeros(count, np.bool_), np.zeros(count)
    nearest, along = np.zeros(count, np.int64), np.zeros(count)
    for k in range(count):
        x, y = points[k, 0], points[k, 1]
        best, which, share = np.inf, 0, 0.0
        for m in range(last + 1):
            ax, ay = end[m, 0] - start[m, 0], end[m, 1] - start[m, 1]
            dx, dy = x - start[m, 0], y - start[m, 1]
            square = ax * ax + ay * ay
            part = (dx * ax + dy * ay) / square if square > 0.0 else 0.0
            foot = min(max(part, 0.0), 1.0)
            gx, gy = dx - foot * ax, dy - foot * ay
            far = gx * gx + gy * gy
            if far < best:
                best, which, share = far, m, part
        ax, ay = end[which, 0] - start[which, 0], end[which, 1] - start[which, 1]
        foot = min(max(share, 0.0), 1.0)
        gx, gy = x - start[which, 0] - foot * ax, y - start[which, 1] - foot * ay
        if share <= SLACK:
            side = gx * at_start[which, 0] + gy * at_start[which, 1]
        elif share >= 1.0 - SLACK:
            side = gx * at_end[which, 0] + gy * at_end[which, 1]
        else:
            side = gx * normal[which, 0] + gy * normal[which, 1]
        distance[k] = -np.sqrt(best) if side < 0.0 else np.sqrt(best)
        length = np.hypot(ax, ay)
        nearest[k], along[k] = which, foot * length
        if share < -SLACK and not joined[which]:
            beyond[k] = which == 0
            past[k] = 0.0 if beyond[k] else -share * length
        elif share > 1.0 + SLACK and (which == last or not joined[which + 1]):
            beyond[k] = which == last
            past[k] = 0.0 if beyond[k] else (share - 1.0) * length
    return distance, beyond, past, nearest, along
