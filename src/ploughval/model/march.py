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
SOFTENING_STEPS = (
    8  # steps in which a band softens, unless that makes them shorter than 1/64 of the increment
)


class End(IntEnum):
    """Why a march ended."""

    DONE = 0
    NO_ROOM = 1
    LOCKED = 2


class Law(NamedTuple):
    """What the kernel must know: angles in radians, lengths in mm; all floats, ``rides`` 0 or 1."""

    peak: float
    residual: float
    mobilization: float
    wall: float
    repose: float
    rides: float


class March(NamedTuple):
    """Rows of a march and its surfaces in one pool."""

    rows: Floats  # (R, 7): u, du, P / unit weight, tan beta, outcrop x, outcrop y, band; the last has du = 0
    slips: Floats  # (R,) slip gathered at the start of the increment, mm
    ends: NDArray[np.int64]  # (R, 2): ends of the surface before and of the sheared one, in the pool
    pool: Floats  # (2, K)
    end: int


@njit(cache=True, nogil=True)  # type: ignore[misc]
def band_force(x: Floats, y: Floats, n: int, outcrop: float, tan_phi: float, tan_wall: float) -> float:
    """P / unit weight of the band from the tip at x[0] to a place on the surface."""
    reach = outcrop - x[0]
    if reach <= 0.0:
        return math.inf
    area = 0.0
    top = height_at(x, y, n, outcrop)
    i = 0
    while i + 1 < n and x[i + 1] < outcrop:
        area += 0.5 * (y[i] + y[i + 1]) * (x[i + 1] - x[i])
        i += 1
    area += 0.5 * (y[i] + top) * (outcrop - x[i]) - 0.5 * reach * top
    force: float = area * force_factor(top / reach, tan_phi, tan_wall)
    return force


@njit(cache=True, nogil=True)  # type: ignore[misc]
def advance(
    now: Floats, n: int, outcrop: float, du: float, repose: float, crowd: int, work: Floats, to: Floats
) -> tuple[int, int]:
    """One increment from ``now`` (2, room) into ``to``: rows 0, 1 at rest, 2, 3 sheared; both counts."""
    x, y = now[0], now[1]
    tan_beta = height_at(x, y, n, outcrop) / (outcrop - x[0])
    m = shear(x, y, n, outcrop, tan_beta, du, to[2], to[3])
    if m > crowd:
        deviation = 1e-9 * y[0]
        while m > crowd // 2:
            m = thin(to[2], to[3], m, deviation)
            deviation *= 2.0
    to[0, :m], to[1, :m] = to[2, :m], to[3, :m]
    return settle(to[0], to[1], m, repose, work), m


@njit(cache=True, nogil=True)  # type: ignore[misc]
def march(surface: Floats, law: Law, travel: float, step: float, store: bool) -> March:  # noqa: C901
    """Push the blade through ``travel`` in increments of at most ``step``; see docs/theory-model.md.

    ``surface`` is (2, M), starting at the face at u = 0 with the tip at y = 0.
    """
    tan_peak, tan_wall, repose = math.tan(law.peak), math.tan(law.wall), math.tan(law.repose)
    softens = law.peak > law.residual
    crowd = max(400, 2 * surface.shape[1])
    room = 3 * crowd + 16
    now, work = np.empty((2, room)), np.empty((4, room))
    x, y = now[0], now[1]
    n = surface.shape[1]
    x[:n], y[:n] = surface[0], surface[1]
    n = settle(x, y, n, repose, work)
    trial = np.empty((4, room))
    rows, slips = np.empty((256, 7)), np.empty(256)
    ends = np.empty((256, 2), np.int64)
    pool = np.empty((2, 4096 if store else 1))
    count, filled, band, end = 0, 0, -1, 0
    u, slip, outcrop, due = 0.0, 0.0, 0.0, True
    fresh, place = cheapest_band(x, y, n, tan_peak, tan_wall)
    force = fresh
    while True:
        if band < 0 or not softens or due or fresh < force:
            if not math.isfinite(fresh):
                end = 2
            elif place >= x[n - 1] - 1e-9 * (x[n - 1] - x[0]):
                end = 1  # the band wanted next would come out beyond the sand: the one before stays
            if end != 0 and band < 0:
                break
            if end == 0:
                if band < 0 or (softens and abs(place - outcrop) > SAME_BAND * (outcrop - x[0])):
                    band += 1
                slip = 0.0 if softens else slip
                force, outcrop, due = fresh, place, False
        if count == rows.shape[0]:
            rows, slips = _longer(rows), np.append(slips, slips)
            ends = np.append(ends, ends).reshape(-1, 2)
        top = height_at(x, y, n, outcrop)
        tan_beta = top / (outcrop - x[0]) if outcrop > x[0] else math.inf
        rows[count] = np.array((u, 0.0, force, tan_beta, outcrop, top, float(band)))
        slips[count] = slip
        if store:
            pool = _store(pool, filled, x, y, n)
            filled += n
        ends[count, 0], ends[count, 1] = filled, filled
        count += 1
        if end != 0 or u >= travel * (1.0 - 1e-13):
            break
        du = min(step, travel - u)
        cos_beta = 1.0 / math.sqrt(1.0 + tan_beta * tan_beta)
        if softens and slip < law.mobilization:
            du = min(du, max(law.mobilization * cos_beta / SOFTENING_STEPS, step / 64.0))
            left = (law.mobilization - slip) * cos_beta
            du = left * (1.0 + 1e-12) if du > 0.999 * left else du
            du = min(du, travel - u)
        elif softens and slip == 0.0:
            du = min(du, step / 64.0)
        # the increment ends where a fresh band becomes as cheap as this one
        low, high, gap_low, gap_high = 0.0, du, force - fresh, 0.0
        for turn in range(30):
            rest, sheared = advance(now, n, outcrop, du, repose, crowd, work, trial)
            new_slip = slip + du / cos_beta
            at = outcrop + du * law.rides
            fresh_new, place_new = cheapest_band(trial[0], trial[1], rest, tan_peak, tan_wall)
            tan_phi = tan_mobilised(new_slip, law.peak, law.residual, law.mobilization)
            force_new = band_force(trial[0], trial[1], rest, at, tan_phi, tan_wall)
            gap = force_new - fresh_new
            creeps = abs(place_new - at) <= SAME_BAND * (at - x[0])
            if not softens or (turn == 0 and (gap <= 0.0 or creeps)):
                break
            if abs(gap) <= 1e-9 * fresh_new or (turn > 0 and high - low <= 1e-9 * step):
                due = True
                break
            if gap > 0.0:
                high, gap_high = du, gap
            else:
                low, gap_low = du, gap
            du = 0.5 * (low + high)
            if math.isfinite(gap_high) and turn % 3 != 2 and gap_low < 0.0:
                du = low + (high - low) * gap_low / (gap_low - gap_high)
        if store:
            pool = _store(pool, filled, trial[2], trial[3], sheared)
            filled += sheared
            ends[count - 1, 1] = filled
        rows[count - 1, 1] = du
        n = rest
        x[:n], y[:n] = trial[0, :n], trial[1, :n]
        u += du
        if abs(u - travel) < 1e-12 * travel:
            u = travel
        slip, outcrop, fresh, place, force = new_slip, at, fresh_new, place_new, force_new
    return March(rows[:count].copy(), slips[:count].copy(), ends[:count].copy(), pool[:, :filled].copy(), end)


@njit(cache=True, nogil=True)  # type: ignore[misc]
def _longer(rows: Floats) -> Floats:
    """The rows with as much room again."""
    grown = np.empty((2 * rows.shape[0], rows.shape[1]))
    grown[: rows.shape[0]] = rows
    return grown


@njit(cache=True, nogil=True)  # type: ignore[misc]
def _store(pool: Floats, filled: int, x: Floats, y: Floats, n: int) -> Floats:
    """Write a surface behind what the pool holds; the pool grows as needed."""
    if filled + n > pool.shape[1]:
        grown = np.empty((2, 2 * (filled + n)))
        grown[:, :filled] = pool[:, :filled]
        pool = grown
    pool[0, filled : filled + n] = x[:n]
    pool[1, filled : filled + n] = y[:n]
    return pool
