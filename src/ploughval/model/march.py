"""The compiled march through the increments (Kashizadeh et al., section 2.7)."""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.model.mechanism import cheapest_band, force_factor
from ploughval.model.softening import tan_mobilised
from ploughval.model.surface import height_at, settle, shear, thin

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


class Law(NamedTuple):
    """What the kernel must know: angles in radians, lengths in mm; ``rides``, ``softened`` are 0 or 1."""

    peak: float
    residual: float
    mobilization: float
    wall: float
    repose: float
    rides: float
    softened: float = 0.0  # 1: a fresh band leaves in the direction that is cheapest once it has softened
    load: float = 0.0  # surcharge / unit weight
    face: float = 0.0  # tangent of the face's inclination, which ``wall`` includes (Eq. 16)


class Trial(NamedTuple):
    """After an increment: the force of its band, of the cheapest fresh one, and where that comes out."""

    du: float
    at: float
    slip: float
    force: float
    fresh: float
    place: float


class March(NamedTuple):
    """Rows of a march and its surfaces in one pool."""

    rows: Floats  # (R, 8): u, du, P / unit weight, tan beta, outcrop x, outcrop y, band, slip; last du = 0
    ends: NDArray[np.int64]  # (R, 2): where the surface before and the sheared one end in the pool
    pool: Floats  # (2, K)
    end: int


@njit(cache=True, nogil=True)  # type: ignore[misc]
def band_force(
    x: Floats,
    y: Floats,
    n: int,
    outcrop: float,
    tan_phi: float,
    tan_wall: float,
    load: float = 0.0,
    lean: float = 0.0,
) -> float:
    """P / unit weight of the band from the tip at x[0] - lean to a place; see ``cheapest_band``."""
    reach = outcrop - (x[0] - lean)
    if reach <= 0.0:
        return math.inf
    area = 0.0
    top = height_at(x, y, n, outcrop)
    i = 0
    while i + 1 < n and x[i + 1] < outcrop:
        area += 0.5 * (y[i] + y[i + 1]) * (x[i + 1] - x[i])
        i += 1
    area += 0.5 * (y[i] + top) * (outcrop - x[i]) - 0.5 * reach * top
    weight = area + 0.5 * lean * y[0] + load * (outcrop - x[0])
    force: float = weight * force_factor(top / reach, tan_phi, tan_wall)
    return force


@njit(cache=True, nogil=True)  # type: ignore[misc]
def advance(
    now: Floats, n: int, outcrop: float, du: float, law: Law, crowd: int, work: Floats, to: Floats
) -> tuple[int, int]:
    """One increment from ``now`` (2, room) into ``to``: rows 0, 1 at rest, 2, 3 sheared; both counts.

    In the oblique coordinates x - y tan(inclination) the face is upright and the block moves by du with it,
    as before a vertical blade (docs/theory-model.md, section 8).
    """
    across, y = now[0], now[1]
    top = height_at(across, y, n, outcrop)
    if law.face != 0.0:
        across = work[0]
        across[:n] = now[0, :n] - law.face * y[:n]
    foot = outcrop - law.face * top
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


@njit(cache=True, nogil=True)  # type: ignore[misc]
def come_to_rest(across: Floats, y: Floats, n: int, law: Law, work: Floats) -> int:
    """Avalanche in oblique coordinates, where rises and falls at the slope of repose are not alike."""
    repose = math.tan(law.repose)
    count: int = settle(
        across, y, n, repose / (1.0 + law.face * repose), repose / (1.0 - law.face * repose), work
    )
    return count


@njit(cache=True, nogil=True)  # type: ignore[misc]
def fresh_band(x: Floats, y: Floats, n: int, law: Law) -> tuple[float, float]:
    """P / unit weight of a fresh band, and its outcrop; beyond the last node: sand is missing."""
    x[n], y[n] = x[n - 1] + 1e3 * y[0], y[n - 1]
    tan_peak, tan_wall, lean = math.tan(law.peak), math.tan(law.wall), law.face * y[0]
    if law.softened > 0.0 and law.peak > law.residual:
        force, place = cheapest_band(x, y, n + 1, math.tan(law.residual), tan_wall, law.load, lean)
        if math.isfinite(force):
            force = band_force(x, y, n + 1, place, tan_peak, tan_wall, law.load, lean)
    else:
        force, place = cheapest_band(x, y, n + 1, tan_peak, tan_wall, law.load, lean)
    return force, place


@njit(cache=True, nogil=True)  # type: ignore[misc]
def lacking(wanted: Trial, edge: float) -> int:
    """Why the fresh band that is wanted cannot be had: it comes out where no sand is, or locks; else 0."""
    if not math.isfinite(wanted.fresh):
        return 2
    return 1 if wanted.place > edge else 0


@njit(cache=True, nogil=True)  # type: ignore[misc]
def increment(step: float, law: Law, slip: float, cos_beta: float) -> float:
    """Increment that follows the softening: some steps over the mobilization length, one ends with it."""
    left = (law.mobilization - slip) * cos_beta
    if left <= 0.0:
        return step / LEAST_STEP if slip == 0.0 else step
    du = min(step, max(law.mobilization * cos_beta / SOFTENING_STEPS, step / LEAST_STEP))
    return left * (1.0 + 1e-12) if du > 0.999 * left else du


@njit(cache=True, nogil=True)  # type: ignore[misc]
def try_increment(
    now: Floats, n: int, law: Law, band: tuple[float, float], du: float, crowd: int, work: Floats, to: Floats
) -> tuple[int, int, Trial]:
    """Advance by du with the band (outcrop, slip) and weigh the bands after it; counts as in ``advance``."""
    outcrop, slip = band
    tan_beta = height_at(now[0], now[1], n, outcrop) / (outcrop - tip_of(now, law))
    forward = 1.0 / (1.0 - law.face * tan_beta)
    rest, sheared = advance(now, n, outcrop, du, law, crowd, work, to)
    at, slip = outcrop + du * forward * law.rides, slip + du * forward * math.hypot(1.0, tan_beta)
    tan_phi, lean = tan_mobilised(slip, law.peak, law.residual, law.mobilization), law.face * to[1, 0]
    force = band_force(to[0], to[1], rest, at, tan_phi, math.tan(law.wall), law.load, lean)
    fresh, place = fresh_band(to[0], to[1], rest, law)
    return rest, sheared, Trial(du, at, slip, force, fresh, place)


@njit(cache=True, nogil=True)  # type: ignore[misc]
def tip_of(surface: Floats, law: Law) -> float:
    """Where the tip stands, from where the surface meets the face."""
    return float(surface[0, 0] - law.face * surface[1, 0])


@njit(cache=True, nogil=True)  # type: ignore[misc]
def up_to_switch(
    now: Floats,
    n: int,
    law: Law,
    band: tuple[float, float],
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
    creeps = abs(last.place - last.at) <= SAME_BAND * (last.at - tip_of(to, law))
    if law.peak <= law.residual or last.force <= last.fresh or creeps:
        return rest, sheared, last, False
    low, high, whole = 0.0, du, du
    gap_low, gap_high = -math.inf, last.force - last.fresh
    for turn in range(60):
        du = 0.5 * (low + high)
        if turn % 3 != 2 and math.isfinite(gap_low) and math.isfinite(gap_high):
            du = low + (high - low) * gap_low / (gap_low - gap_high)
        rest, sheared, last = try_increment(now, n, law, band, du, crowd, work, to)
        gap = last.force - last.fresh
        if abs(gap) <= 1e-9 * last.fresh or high - low <= 1e-9 * whole:
            break
        if gap > 0.0:
            high, gap_high = du, gap
        else:
            low, gap_low = du, gap
    if last.du < least:
        rest, sheared, last = try_increment(now, n, law, band, min(least, whole), crowd, work, to)
        return rest, sheared, last, last.force > last.fresh
    return rest, sheared, last, True


@njit(cache=True, nogil=True)  # type: ignore[misc]
def march(surface: Floats, law: Law, travel: float, step: float, store: bool) -> March:
    """Push the blade through ``travel`` in increments of at most ``step`` (docs/theory-model.md, section 5).

    ``surface`` is (2, M), starting at the face at u = 0 with the tip at y = 0. No rows at all: no first band.
    """
    crowd = max(400, 2 * surface.shape[1])
    now, to, work = np.empty((2, 4 * crowd)), np.empty((4, 4 * crowd)), np.empty((4, 4 * crowd))
    n = surface.shape[1]
    now[:, :n] = surface
    now[0, :n] -= law.face * now[1, :n]
    n = come_to_rest(now[0], now[1], n, law, work)
    now[0, :n] += law.face * now[1, :n]
    far = now[1, n - 1]
    rows, ends = np.empty((256, 8)), np.empty((256, 2), np.int64)
    pool = np.empty((2, 4096 if store else 1))
    count, filled, band, end = 0, 0, -1, 0
    u, born, switches = 0.0, 0.0, True
    fresh, place = fresh_band(now[0], now[1], n, law)
    last = Trial(0.0, place, 0.0, fresh, fresh, place)
    while True:
        if switches or law.peak <= law.residual or last.fresh < last.force:
            end = lacking(last, now[0, n - 1])
            if end != 0 and band < 0:
                break
            if end == 0:
                jump = abs(last.place - last.at) > SAME_BAND * (last.at - tip_of(now, law))
                band += 1 if band < 0 or (jump and law.peak > law.residual) else 0
                slip = 0.0 if law.peak > law.residual else last.slip
                last = Trial(0.0, last.place, slip, last.fresh, last.fresh, last.place)
                born = u
        if count == rows.shape[0]:
            rows, ends = np.concatenate((rows, rows)), np.concatenate((ends, ends))
        top = height_at(now[0], now[1], n, last.at)
        tan_beta = top / (last.at - u)
        rows[count] = np.array((u, 0.0, last.force, tan_beta, last.at, top, float(band), last.slip))
        if store:
            pool, filled = _store(pool, filled, now, n)
        ends[count] = filled
        count += 1
        if law.face != 0.0 and abs(now[1, n - 1] - far) > REACHED * now[1, 0]:
            end = 1  # the end of the box is upright, not oblique: no avalanche against it
        if end != 0 or u >= travel:
            break
        du = min(step, travel - u)
        if law.peak > law.residual:
            rate = math.hypot(1.0, tan_beta) / (1.0 - law.face * tan_beta)
            du = min(du, increment(step, law, last.slip, 1.0 / rate))
        active = (last.at, last.slip)
        limits = (born + step / LEAST_LIFE - u, du)
        rest, sheared, last, switches = up_to_switch(now, n, law, active, limits, crowd, work, to)
        if not math.isfinite(min(last.force, last.fresh)):
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


@njit(cache=True, nogil=True)  # type: ignore[misc]
def _store(pool: Floats, filled: int, surface: Floats, n: int) -> tuple[Floats, int]:
    """Write the first two rows of a surface behind what the pool holds; the pool grows as needed."""
    if filled + n > pool.shape[1]:
        grown = np.empty((2, 2 * (filled + n)))
        grown[:, :filled] = pool[:, :filled]
        pool = grown
    pool[:, filled : filled + n] = surface[:2, :n]
    return pool, filled + n
