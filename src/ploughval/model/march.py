"""The compiled march through the increments (Kashizadeh et al. 2014, section 2.7).

The outcrop of a band stays where it is in the sand: docs/theory-model-outcrop.md, section 1.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.model.advance import advance, come_to_rest, tip_of
from ploughval.model.bent_motion import velocities
from ploughval.model.law import Band, Law
from ploughval.model.surface import height_at
from ploughval.model.weigh import weigh_fresh, weigh_old

Floats = NDArray[np.float64]

SAME_BAND = 0.05  # a fresh outcrop nearer than this share of the band's reach is the same band creeping on
SOFTENING_STEPS = 8  # steps in which a band softens ...
LEAST_STEP = 64.0  # ... unless that makes them shorter than this part of the increment
REACHED = 1e-6  # rise of the sand's last node, in heights of the face, that tells the heap has come so far
LEAST_LIFE = 8.0  # a band lives at least this part of the increment: two bands may alternate ever faster


class End(IntEnum):
    """Why a march ended."""

    DONE = 0
    NO_ROOM = 1
    LOCKED = 2


class Trial(NamedTuple):
    """After an increment: its band with its force, and the cheapest fresh one with its price."""

    du: float
    force: float
    band: Band
    price: float
    fresh: Band


class March(NamedTuple):
    """Rows of a march and its surfaces in one pool."""

    rows: Floats  # (R, 11): u, du, P / unit weight, tan beta, outcrop x, y, band, slip, joint x, y, forward
    ends: NDArray[np.int64]  # (R, 2): where the surface before and the sheared one end in the pool
    pool: Floats  # (2, K)
    end: int


@njit(cache=True, nogil=True, forceinline=True)
def lacking(wanted: Trial, edge: float) -> int:
    """Why the fresh band that is wanted cannot be had: it comes out where no sand is, or locks; else 0."""
    if not math.isfinite(wanted.price):
        return 2
    return 1 if wanted.fresh.outcrop > edge else 0


@njit(cache=True, nogil=True, forceinline=True)
def increment(step: float, law: Law, slip: float, cos_beta: float) -> float:
    """Increment that follows the softening: some steps over the mobilization length, one ends with it."""
    left = (law.mobilization - slip) * cos_beta
    if left <= 0.0:
        return step / LEAST_STEP if slip == 0.0 else step
    du = min(step, max(law.mobilization * cos_beta / SOFTENING_STEPS, step / LEAST_STEP))
    return left * (1.0 + 1e-12) if du > 0.999 * left else du


@njit(cache=True, nogil=True, forceinline=True)
def pace(now: Floats, n: int, law: Law, band: Band, tip: float) -> tuple[float, float, float]:
    """How far the block at the outcrop moves forward, and slips, for 1 of the blade; the outcrop's height.

    docs/theory-model.md, Eq. (10); docs/theory-model-blades.md, Eq. (3) before a face that leans.
    """
    top = height_at(now[0], now[1], n, band.outcrop)
    if law.bends is not None and band.joint_ahead > 0.0:
        joint, out = (tip + band.joint_ahead, band.joint_up), (band.outcrop, top)
        _, upper, forward = velocities(tip, now[1, 0], joint, out)
        return forward, forward * math.hypot(1.0, upper), top
    tan_beta = top / (band.outcrop - tip)
    forward = 1.0 / (1.0 - law.face * tan_beta)
    return forward, forward * math.hypot(1.0, tan_beta), top


@njit(cache=True, nogil=True)
def try_increment(
    now: Floats, n: int, law: Law, band: Band, du: float, crowd: int, work: Floats, to: Floats
) -> tuple[int, int, Trial]:
    """Advance by du with the band and weigh the bands after it; counts as in ``advance``."""
    forward, slip, _ = pace(now, n, law, band, tip_of(now, law))
    rest, sheared = advance(now, n, band, du, law, crowd, work, to)
    at = band.outcrop + du * forward * law.rides
    force, old = weigh_old(to, rest, law, at, band.slip + du * slip, work)
    price, fresh = weigh_fresh(to, rest, law, work)
    return rest, sheared, Trial(du, force, old, price, fresh)


@njit(cache=True, nogil=True)
def up_to_switch(
    now: Floats,
    n: int,
    law: Law,
    band: Band,
    limits: tuple[float, float],
    crowd: int,
    work: Floats,
    to: Floats,
) -> tuple[int, int, Trial, bool]:
    """The greatest increment, or less where a fresh band becomes as cheap as this one; and whether it does.

    ``limits``: least and greatest increment. At the least one the fresh band may be cheaper already.
    """
    least, du = limits
    rest, sheared, last = try_increment(now, n, law, band, du, crowd, work, to)
    if law.peak <= law.residual or last.force <= last.price or creeps_on(to, law, last):
        return rest, sheared, last, False
    low, high, whole = 0.0, du, du
    gap_low, gap_high = -math.inf, last.force - last.price
    for turn in range(60):
        du = 0.5 * (low + high)
        if turn % 3 != 2 and math.isfinite(gap_low) and math.isfinite(gap_high):
            du = low + (high - low) * gap_low / (gap_low - gap_high)
        rest, sheared, last = try_increment(now, n, law, band, du, crowd, work, to)
        gap = last.force - last.price
        if abs(gap) <= 1e-9 * last.price or high - low <= 1e-9 * whole:
            break
        if gap > 0.0:
            high, gap_high = du, gap
        else:
            low, gap_low = du, gap
    if last.du < least:
        rest, sheared, last = try_increment(now, n, law, band, min(least, whole), crowd, work, to)
        return rest, sheared, last, last.force > last.price
    return rest, sheared, last, True


@njit(cache=True, nogil=True, forceinline=True)
def creeps_on(surface: Floats, law: Law, trial: Trial) -> bool:
    """Whether the fresh band comes out so near the old one that it is the same creeping on."""
    near = SAME_BAND * (trial.band.outcrop - tip_of(surface, law))
    return bool(abs(trial.fresh.outcrop - trial.band.outcrop) <= near)


@njit(cache=True, nogil=True)
def march(surface: Floats, law: Law, travel: float, step: float, store: bool) -> March:
    """Push the blade through ``travel`` in increments of at most ``step`` (docs/theory-model-march.md).

    ``surface`` is (2, M), starting at the face at u = 0 with the tip at y = 0. No rows at all: no first band.
    """
    crowd = max(400, 2 * surface.shape[1])
    now, to, work = np.empty((2, 4 * crowd)), np.empty((4, 4 * crowd)), np.empty((4, 4 * crowd))
    n = _lay(surface, law, now, work)
    far = now[1, n - 1]
    rows, ends = np.empty((256, 11)), np.empty((256, 2), np.int64)
    pool = np.empty((2, 4096 if store else 1))
    count, filled, band, end = 0, 0, -1, 0
    u, born, switches = 0.0, 0.0, True
    price, fresh = weigh_fresh(now, n, law, work)
    last = Trial(0.0, price, fresh, price, fresh)
    while True:
        if switches or law.peak <= law.residual or last.price < last.force:
            end = lacking(last, now[0, n - 1] - step)  # room for the front of the block
            if end != 0 and band < 0:
                break
            if end == 0:
                jump = not creeps_on(now, law, last) and law.peak > law.residual
                band += 1 if band < 0 or jump else 0
                last = take(last, law)
                born = u
        if count == rows.shape[0]:
            rows, ends = np.concatenate((rows, rows)), np.concatenate((ends, ends))
        forward, slip, top = pace(now, n, law, last.band, u)
        rows[count] = row_of(u, float(band), last, top, forward)
        if store:
            pool, filled = _store(pool, filled, now, n)
        ends[count] = filled
        count += 1
        if is_full(now, n, law, last.band.outcrop + step, far):
            end = 1
        if end != 0 or u >= travel:
            break
        du = min(step, travel - u)
        if law.peak > law.residual:
            du = min(du, increment(step, law, last.band.slip, 1.0 / slip))
        limits = (born + step / LEAST_LIFE - u, du)
        rest, sheared, last, switches = up_to_switch(now, n, law, last.band, limits, crowd, work, to)
        if not math.isfinite(min(last.force, last.price)):
            end = 2
            break
        if store:
            pool, filled = _store(pool, filled, to[2:], sheared)
        ends[count - 1, 1] = filled
        rows[count - 1, 1] = last.du
        n = rest
        now[:, :n] = to[:2, :n]
        u = travel if abs(u + last.du - travel) < 1e-12 * travel else u + last.du
    return March(rows[:count].copy(), ends[:count].copy(), pool[:, :filled].copy(), end)


@njit(cache=True, nogil=True, forceinline=True)
def is_full(now: Floats, n: int, law: Law, front: float, far: float) -> bool:
    """Whether the block's front would pass the end of the box, or an oblique heap has come to it.

    The end is upright: in coordinates oblique with a face that leans no avalanche can be laid against it.
    ``far`` is the height of the last node at first.
    """
    heaped = abs(now[1, n - 1] - far) > REACHED * now[1, 0]
    return bool(front > now[0, n - 1] or (law.face != 0.0 and heaped))


@njit(cache=True, nogil=True)
def _lay(surface: Floats, law: Law, now: Floats, work: Floats) -> int:
    """Write the initial surface, at rest, into ``now``; the count of its nodes."""
    n = surface.shape[1]
    now[:, :n] = surface
    now[0, :n] -= law.face * now[1, :n]
    n = come_to_rest(now[0], now[1], n, law, work)
    now[0, :n] += law.face * now[1, :n]
    return n


@njit(cache=True, nogil=True, forceinline=True)
def take(last: Trial, law: Law) -> Trial:
    """The fresh band in force; sand that does not soften keeps its count of slip."""
    new, slip = last.fresh, 0.0 if law.peak > law.residual else last.band.slip
    taken = Band(new.outcrop, slip, new.joint_ahead, new.joint_up)
    return Trial(0.0, last.price, taken, last.price, taken)


@njit(cache=True, nogil=True, forceinline=True)
def row_of(u: float, number: float, last: Trial, top: float, forward: float) -> Floats:
    """Row of ``March.rows`` at the start of an increment whose band comes out at the height ``top``.

    The angle is that of the straight line from tip to outcrop; ``forward`` is how far the block at the
    outcrop moves along x for 1 of the blade's travel.
    """
    band = last.band
    head = (u, 0.0, last.force, top / (band.outcrop - u), band.outcrop, top, number)
    return np.array((*head, band.slip, u + band.joint_ahead, band.joint_up, forward))


@njit(cache=True, nogil=True)
def _store(pool: Floats, filled: int, surface: Floats, n: int) -> tuple[Floats, int]:
    """Write the first two rows of a surface behind what the pool holds; the pool grows as needed."""
    if filled + n > pool.shape[1]:
        grown = np.empty((2, 2 * (filled + n)))
        grown[:, :filled] = pool[:, :filled]
        pool = grown
    pool[:, filled : filled + n] = surface[:2, :n]
    return pool, filled + n
