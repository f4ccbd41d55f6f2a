"""One increment: the motion of the block, or of two, and the avalanche (Kashizadeh et al. 2014, 2.3, 2.4)."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.model.bent_motion import shear_bent
from ploughval.model.law import Band, Law
from ploughval.model.surface import height_at, settle, shear, thin

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, forceinline=True)
def advance(
    now: Floats, n: int, band: Band, du: float, law: Law, crowd: int, work: Floats, to: Floats
) -> tuple[int, int]:
    """One increment from ``now`` (2, room) into ``to``: rows 0, 1 at rest, 2, 3 sheared; both counts.

    In the oblique coordinates x - y tan(inclination) the face is upright and the block moves by du with it,
    as before a vertical blade (docs/theory-model-blades.md, Eqs (4) and (5)).
    """
    across, y = now[0], now[1]
    if law.face != 0.0:
        across = work[0]
        across[:n] = now[0, :n] - law.face * y[:n]
    if law.bends is not None and band.joint_ahead > 0.0:
        m = shear_bent(now, n, band, du, work, to[2:])
    else:
        top = height_at(now[0], y, n, band.outcrop)
        foot = band.outcrop - law.face * top
        m = shear(across, y, n, foot, top / (foot - across[0]), du, to[2], to[3])
    if m > crowd:
        deviation = 1e-9 * y[0]
        while m > crowd // 2:
            m = thin(to[2], to[3], m, deviation)
            deviation *= 2.0
    to[0, :m], to[1, :m] = to[2, :m], to[3, :m]
    rest = come_to_rest(to[0], to[1], m, law, work)
    if law.face != 0.0:
        to[0, :rest] += law.face * to[1, :rest]
        to[2, :m] += law.face * to[3, :m]
    return rest, m


@njit(cache=True, nogil=True, forceinline=True)
def come_to_rest(across: Floats, y: Floats, n: int, law: Law, work: Floats) -> int:
    """Avalanche in oblique coordinates, where rises and falls at the slope of repose are not alike.

    docs/theory-model-blades.md, Eq. (6).
    """
    repose = math.tan(law.repose)
    fall, rise = repose / (1.0 + law.face * repose), repose / (1.0 - law.face * repose)
    count: int = settle(across, y, n, fall, rise, work)
    return count


@njit(cache=True, nogil=True, forceinline=True)
def tip_of(surface: Floats, law: Law) -> float:
    """Where the tip stands, from where the surface meets the face."""
    return float(surface[0, 0] - law.face * surface[1, 0])
