"""Lines as few bytes: corners that matter, whole numbers of a quantum, differences in a variable length.

A line keeps so few of its points that none of those left out lies further from the drawn line than a
tolerance (cone intersection, Williams, 1978; Imai & Iri, 1986). Numbers are written as in Protocol Buffers:
signs folded (zigzag), seven bits a byte, then base64.
"""

import base64
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
LEVELS = 64
_DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
_SHARE = 0.7  # of the tolerance that leaving points out may take; rounding takes up to 0.24 more
_QUANTA = 3.0  # in a tolerance


def quantum_of(tolerance: float) -> float:
    """The step to which places are rounded so that a thinned line stays within a tolerance."""
    return tolerance / _QUANTA


def thinned(points: Floats, tolerance: float) -> Floats:
    """The points of a line that keep the others within a tolerance of what is drawn.

    Parameters
    ----------
    points : (N, 2) float, mm
        Finite, in the order in which they are joined.
    tolerance : float, mm
        Greatest distance of a point left out from the line through those kept.

    Returns
    -------
    (M, 2) float, mm
        First and last among them.
    """
    if len(points) < 3:
        return points
    rows = points.tolist()
    kept, anchor, last = [0], 0, len(rows) - 1
    low, high, farthest = -math.inf, math.inf, 0.0
    axis, index = 0.0, 1
    while index <= last:
        dx, dy = rows[index][0] - rows[anchor][0], rows[index][1] - rows[anchor][1]
        reach = math.hypot(dx, dy)
        if farthest <= tolerance:  # all points since the anchor lie on it
            axis = math.atan2(dy, dx)
        turn = (math.atan2(dy, dx) - axis + math.pi) % (2 * math.pi) - math.pi
        if index > anchor + 1 and (reach < farthest or not low <= turn <= high):
            anchor = index - 1
            kept.append(anchor)
            low, high, farthest = -math.inf, math.inf, 0.0
            continue
        if reach > tolerance:
            width = math.asin(tolerance / reach)
            low, high = max(low, turn - width), min(high, turn + width)
        farthest = max(farthest, reach)
        index += 1
    kept.append(last)
    return points[kept]


def pieces(points: Floats) -> list[Floats]:
    """The parts of a line between its gaps (rows that are not finite), each of at least one point."""
    good = np.isfinite(points).all(axis=1)
    cuts = np.flatnonzero(np.diff(good)) + 1
    return [part for part, there in zip(np.split(points, cuts), np.split(good, cuts), strict=True)
            if len(there) and there[0]]  # fmt: skip


def pack_lines(lines: Iterable[tuple[int, Floats]], tolerance: float) -> str:
    """Lines with a tag each as text: tag, number of points, differences of places in quanta.

    Parameters
    ----------
    lines : iterable of (tag, (N, 2) float, mm)
        Finite points; the tag says what the line is.
    tolerance : float, mm
        How far what is drawn may be from what is given.
    """
    numbers: list[int] = []
    quantum, at = quantum_of(tolerance), np.zeros(2, dtype=np.int64)
    for tag, points in lines:
        places = np.round(thinned(points, _SHARE * tolerance) / quantum).astype(np.int64)
        if len(places) > 1:
            moved = np.concatenate([[True], (np.diff(places, axis=0) != 0).any(axis=1)])
            places = places[moved]
        steps = np.diff(places, axis=0, prepend=at[np.newaxis])
        at = places[-1]
        numbers += [tag, len(places), *zigzag(steps).ravel().tolist()]
    return pack(numbers)


def unpack_lines(text: str, tolerance: float) -> list[tuple[int, Floats]]:
    """Lines back from :func:`pack_lines`."""
    numbers, quantum, at = unpack(text), quantum_of(tolerance), np.zeros(2, dtype=np.int64)
    lines: list[tuple[int, Floats]] = []
    place = 0
    while place < len(numbers):
        tag, count = numbers[place : place + 2]
        folded = np.array(numbers[place + 2 : place + 2 + 2 * count], dtype=np.int64).reshape(-1, 2)
        places = at + np.cumsum((folded >> 1) ^ -(folded & 1), axis=0)
        lines.append((tag, np.asarray(places * quantum, dtype=np.float64)))
        at, place = places[-1], place + 2 + 2 * count
    return lines


def zigzag(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Signed numbers as unsigned ones, small where they are small: 0, -1, 1, -2 become 0, 1, 2, 3."""
    folded: NDArray[np.int64] = (values << 1) ^ (values >> 63)
    return folded


def pack(numbers: Sequence[int]) -> str:
    """Numbers from 0 as base64 of bytes that hold seven bits each and tell whether another follows.

    >>> pack([0, 1, 300]), unpack("AAGsAg==")
    ('AAGsAg==', [0, 1, 300])
    """
    data = bytearray()
    for value in numbers:
        while value > 127:
            data.append(value & 127 | 128)
            value >>= 7
        data.append(value)
    return base64.b64encode(data).decode("ascii")


def unpack(text: str) -> list[int]:
    """Numbers back from :func:`pack`."""
    numbers, value, shift = [], 0, 0
    for byte in base64.b64decode(text):
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            numbers.append(value)
            value, shift = 0, 0
    return numbers


def letters(values: Floats, top: float) -> str:
    """Values between 0 and a top in 63 steps, a letter each; A where there is none.

    >>> letters(np.array([0.0, 1.0, 2.0, np.nan]), 2.0)
    'Bg/A'
    """
    steps = np.clip(np.nan_to_num(values) / top, 0, 1) * (LEVELS - 2)
    codes = np.where(np.isfinite(values), 1 + np.round(steps).astype(int), 0)
    return "".join(_DIGITS[code] for code in codes)
