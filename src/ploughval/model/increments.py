"""The increments of a march as objects, and the surface within one."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

from ploughval.model.advance import advance
from ploughval.model.law import Band, Law
from ploughval.model.march import March

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Increment:
    """One increment: the block left of the outcrop, or two, move along the band; then the surface avalanches.

    The block moves by du (1, tan beta) before an upright face, by that over 1 - tan(inclination) tan beta
    before one that leans; docs/theory-model-two-blocks.md, section 3 has the motion of two.

    Attributes
    ----------
    u_mm, du_mm : float, mm
        Displacement of the blade at the start, when the tip stands at (u_mm, 0), and what it moves on.
    beta_deg : float, degrees
        Inclination of the line from tip to outcrop.
    outcrop_x_mm, outcrop_y_mm : float, mm
        Where the band meets the surface at the start.
    band : int
        Number of the band, from 0.
    force_N : float, N
        Force P at the start for the blade's width.
    sheared, surface : (M, 2) float64, mm
        World places from the blade's face at u_mm + du_mm on: after the block's motion, and after the
        avalanche.
    joint_x_mm, joint_y_mm : float, mm
        Where the band bends between two blocks; of one block the tip.
    """

    u_mm: float
    du_mm: float
    beta_deg: float
    outcrop_x_mm: float
    outcrop_y_mm: float
    band: int
    force_N: float
    sheared: Floats
    surface: Floats
    joint_x_mm: float
    joint_y_mm: float


class Increments(Sequence[Increment]):
    """The increments of a march, made when asked for."""

    __slots__ = ("_force_N", "_march")

    def __init__(self, marched: March, force_N: Floats) -> None:
        self._march, self._force_N = marched, force_N

    def __len__(self) -> int:
        return len(self._march.rows) - 1

    @overload
    def __getitem__(self, index: int) -> Increment: ...
    @overload
    def __getitem__(self, index: slice) -> list[Increment]: ...
    def __getitem__(self, index: int | slice) -> Increment | list[Increment]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        k = range(len(self))[index]
        u, du, _, tan_beta, x, y, band, _, *joint, _ = self._march.rows[k].tolist()
        beta, force = math.degrees(math.atan(tan_beta)), float(self._force_N[k])
        sheared, after = self.sheared(k), self.surface_before(k + 1)
        return Increment(u, du, beta, x, y, int(band), force, sheared, after, *joint)

    def __iter__(self) -> Iterator[Increment]:
        return (self[k] for k in range(len(self)))

    def surface_before(self, k: int) -> Floats:
        """Surface (M, 2) at the start of increment k; k = len: at the end."""
        start = self._march.ends[k - 1, 1] if k else 0
        return np.ascontiguousarray(self._march.pool[:, start : self._march.ends[k, 0]].T)

    def sheared(self, k: int) -> Floats:
        """Surface (M, 2) of increment k after the block's motion, before the avalanche."""
        return np.ascontiguousarray(self._march.pool[:, slice(*self._march.ends[k])].T)


def surface_within(before: Floats, row: Floats, du: float, law: Law) -> Floats:
    """Surface (K, 2) at rest after a part ``du`` of the increment of a row, which began with (M, 2)."""
    n = len(before)
    room = 6 * n + 20
    now, to, work = np.empty((2, room)), np.empty((4, room)), np.empty((4, room))
    now[:, :n] = before.T
    count, _ = advance(now, n, Band(row[4], row[7], row[8] - row[0], row[9]), du, law, room, work, to)
    return np.ascontiguousarray(to[:2, :count].T)
