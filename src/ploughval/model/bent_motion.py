"""Motion of two blocks on a bent band and the area ahead (docs/theory-model-two-blocks.md, section 3)."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.model.law import Band
from ploughval.model.surface import height_at, shear

Floats = NDArray[np.float64]
Point = tuple[float, float]


@njit(cache=True, nogil=True)
def velocities(tip: float, face_top: float, joint: Point, outcrop: Point) -> tuple[float, float, float]:
    """Slopes of the lower and the upper band, and how far block 2 moves forward for 1 of the blade.

    docs/theory-model-two-blocks.md, Eq. (4). One block, whose joint is the tip, has both slopes alike and
    moves as far as the blade.
    """
    upper = (outcrop[1] - joint[1]) / (outcrop[0] - joint[0])
    ahead = joint[0] - tip
    if ahead <= 0.0:
        return upper, upper, 1.0
    return joint[1] / ahead, upper, face_top / (face_top - joint[1] + ahead * upper)


@njit(cache=True, nogil=True)
def shear_bent(now: Floats, n: int, band: Band, du: float, work: Floats, out: Floats) -> int:
    """Move both blocks by ``du`` of the blade: surface ``now`` (2, room) into ``out``; the new node count.

    The surface belongs to block 2, and the face overtakes some of it: of that sand, of second order in du, as
    much is spread beside the face, past the joint, as keeps the area but for what the tip leaves behind,
    du^2 tan(lambda) / 2 (docs/theory-model-two-blocks.md, Eq. (5)). (Left in a corner one increment wide it
    would hide the interface from the search.)
    """
    x, y, tip, outcrop = now[0], now[1], now[0, 0], band.outcrop
    joint = (tip + band.joint_ahead, band.joint_up)
    lower, upper, forward = velocities(tip, y[0], joint, (outcrop, height_at(x, y, n, outcrop)))
    foot = band.joint_up - band.joint_ahead * upper
    work[0, :n] = y[:n] - foot
    m = shear(x, work[0], n, outcrop, upper, forward * du, work[1], work[2])
    work[2, :m] += foot
    wanted = _area(x, y, n) - 0.5 * du * du * lower
    m = _cut(work[1], work[2], m, tip + du, out)
    _raise(out[0], out[1], m, tip + band.joint_ahead, wanted)
    return m


@njit(cache=True, nogil=True)
def _cut(x: Floats, y: Floats, n: int, face: float, out: Floats) -> int:
    """Let a surface begin at the face; the new node count."""
    out[0, 0], out[1, 0] = face, height_at(x, y, n, face)
    m, tiny = 1, 1e-12 * (x[n - 1] - x[0])
    for i in range(n):
        if x[i] > face + tiny:
            out[0, m], out[1, m] = x[i], y[i]
            m += 1
    return m


@njit(cache=True, nogil=True)
def _raise(x: Floats, y: Floats, n: int, past: float, wanted: float) -> None:
    """Raise a surface to a wanted area: most at the face, not at the first node past a place and beyond."""
    end = 1
    while end < n - 1 and x[end] < past:
        end += 1
    lift = 2.0 * (wanted - _area(x, y, n)) / (x[end] - x[0])
    for i in range(end - 1, -1, -1):
        y[i] += lift * (x[end] - x[i]) / (x[end] - x[0])


@njit(cache=True, nogil=True)
def _area(x: Floats, y: Floats, n: int) -> float:
    """Area under the surface down to the level of the tip."""
    area = 0.0
    for i in range(n - 1):
        area += 0.5 * (y[i] + y[i + 1]) * (x[i + 1] - x[i])
    return area
