"""Free surface as a polyline: area, the block's motion, thinning that conserves area, avalanche.

The pairwise avalanche, Eqs (4) and (5) of the paper, swept to rest is an equal-area cut at the slope of
repose; here the cut is found directly by pooling (Ayer et al. 1955). docs/theory-model-avalanche.md,
section 3 proves it; docs/theory-model-nodes.md, section 1 says why nodes are not the error.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def area_ahead(surface: ArrayLike) -> float:
    """Area between a surface (M, 2) in mm and the level of the tip, mm2."""
    x, y = np.asarray(surface, float).T
    return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)))


def avalanche(surface: ArrayLike, repose_deg: float) -> Floats:
    """Bring a surface to rest: slopes steeper than repose become equal-area cuts at that slope.

    docs/theory-model-avalanche.md, Eq. (7).

    Parameters
    ----------
    surface : (M, 2) float, mm
        Nodes with increasing x.
    repose_deg : float, degrees
        Slope of repose, in both directions.

    Returns
    -------
    (K, 2) float, mm
        Nodes of the surface at rest; the area is the same to rounding. The ends act as walls.
    """
    nodes = np.asarray(surface, float)
    room = 3 * len(nodes) + 4
    x, y = np.empty(room), np.empty(room)
    x[: len(nodes)], y[: len(nodes)] = nodes.T
    repose = math.tan(math.radians(repose_deg))
    n = settle(x, y, len(nodes), repose, repose, np.empty((4, room)))
    return np.column_stack([x[:n], y[:n]])


def move_block(surface: ArrayLike, outcrop_x: float, tan_beta: float, du: float) -> Floats:
    """Surface (K, 2) after the block left of the outcrop has moved by du (1, tan beta).

    Where the front of the block comes to lie over sand ahead, its columns settle on it, so that the area
    ahead of the blade changes by exactly - du^2 tan(beta) / 2, what the tip leaves behind
    (docs/theory-model-avalanche.md, Eqs (1) and (2)).
    """
    nodes = np.ascontiguousarray(np.asarray(surface, float).T)
    room = 2 * nodes.shape[1] + 4
    x, y = np.empty(room), np.empty(room)
    n = shear(nodes[0], nodes[1], nodes.shape[1], outcrop_x, tan_beta, du, x, y)
    return np.column_stack([x[:n], y[:n]])


@njit(cache=True, nogil=True)
def height_at(x: Floats, y: Floats, n: int, place: float) -> float:
    """Height of the polyline at a place, level beyond its ends."""
    if place <= x[0]:
        return float(y[0])
    if place >= x[n - 1]:
        return float(y[n - 1])
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if x[middle] <= place:
            low = middle
        else:
            high = middle
    share = (place - x[low]) / (x[high] - x[low])
    return float(y[low] + share * (y[high] - y[low]))


@njit(cache=True, nogil=True)
def shear(
    x: Floats, y: Floats, n: int, outcrop: float, tan_beta: float, du: float, out_x: Floats, out_y: Floats
) -> int:
    """Move the block left of the outcrop; returns the number of nodes written to out_x, out_y.

    docs/theory-model-avalanche.md, Eq. (1); the nodes are those of docs/theory-model-nodes.md, Eq. (1).
    """
    tiny = 1e-12 * (x[n - 1] - x[0])
    m, i = 0, 0
    while i < n and x[i] < outcrop - du - tiny:
        out_x[m], out_y[m] = x[i] + du, y[i] + du * tan_beta
        m, i = m + 1, i + 1
    if outcrop - du > x[0] + tiny:
        out_x[m], out_y[m] = outcrop, height_at(x, y, n, outcrop - du) + du * tan_beta
        m += 1
    j = i
    while j < n and x[j] <= outcrop + tiny:
        j += 1
    # from the outcrop to du ahead of it columns of the block stand on the sand ahead: nodes of both
    while True:
        moved = x[i] + du if i < n and x[i] < outcrop - tiny else math.inf
        rest = x[j] if j < n else math.inf
        place = min(moved, rest)
        if place >= outcrop + du - tiny:
            break
        if m == 0 or place > out_x[m - 1] + tiny:
            thick = height_at(x, y, n, place - du) - tan_beta * (place - du - x[0])
            out_x[m], out_y[m] = place, height_at(x, y, n, place) + thick
            m += 1
        if moved <= rest:
            i += 1
        if rest <= moved:
            j += 1
    if outcrop + du < x[n - 1] - tiny:
        out_x[m], out_y[m] = outcrop + du, height_at(x, y, n, outcrop + du)
        m += 1
    while j < n:
        if x[j] > out_x[m - 1] + tiny:
            out_x[m], out_y[m] = x[j], y[j]
            m += 1
        j += 1
    return m


@njit(cache=True, nogil=True)
def settle(x: Floats, y: Floats, n: int, fall: float, rise: float, work: Floats) -> int:
    """Avalanche in place, forwards and then backwards; ``work`` is (4, room). Returns the new count.

    ``fall`` and ``rise`` are the greatest slopes of either kind; they differ in oblique coordinates only.
    """
    for way in (1.0, -1.0):
        steep, repose = False, fall if way > 0.0 else rise
        for i in range(n - 1):
            if way * (y[i] - y[i + 1]) > (repose * (1.0 + 1e-12)) * (x[i + 1] - x[i]):
                steep = True
                break
        if not steep:
            continue
        px, pg, sx, sg = work[0], work[1], work[2], work[3]
        origin = x[0] if way > 0.0 else x[n - 1]
        for i in range(n):
            k = i if way > 0.0 else n - 1 - i
            px[i] = way * (x[k] - origin)
            pg[i] = y[k] + repose * px[i]
        m = pool(px, pg, n, sx, sg)
        for i in range(m):
            k = i if way > 0.0 else m - 1 - i
            x[i] = origin + way * sx[k]
            y[i] = sg[k] - repose * sx[k]
        n = m
    return n


@njit(cache=True, nogil=True)
def pool(px: Floats, pg: Floats, n: int, sx: Floats, sg: Floats) -> int:
    """Isotonic regression of a continuous polyline g(x): falling stretches become level, area kept.

    The nodes so far, (sx, sg), never fall. A fall opens a level from ``a`` (where the risen part meets it) to
    the end of what has been read; every further segment lowers it, until a rising segment meets it and
    closes it.
    """
    tiny = 1e-13 * (px[n - 1] - px[0])
    sx[0], sg[0] = px[0], pg[0]
    m = 1
    is_open = False
    level, a = 0.0, 0.0
    for k in range(n - 1):
        x0, g0, x1, g1 = px[k], pg[k], px[k + 1], pg[k + 1]
        if not is_open:
            if g1 >= sg[m - 1]:
                sx[m], sg[m] = x1, g1
                m += 1
                continue
            is_open, level, a = True, sg[m - 1], sx[m - 1]
            m -= 1
        level, a, m, closes = _lower(sx, sg, m, level, a, (x0, g0, x1, g1))
        if closes:
            b = x0 + (level - g0) * (x1 - x0) / (g1 - g0)
            m = _close(sx, sg, m, a, b, level, tiny)
            is_open = False
            if x1 > sx[m - 1] + tiny:
                sx[m], sg[m] = x1, g1
                m += 1
    if is_open:
        m = _close(sx, sg, m, a, px[n - 1], level, tiny)
    return m


@njit(cache=True, nogil=True)
def _lower(
    sx: Floats, sg: Floats, m: int, level: float, a: float, segment: tuple[float, float, float, float]
) -> tuple[float, float, int, bool]:
    """Lower an open level until what it loses fills the next segment up to it, or up to where they meet.

    Between two nodes of the risen part the loss is quadratic in the fall (span t + bend t^2) and so is the
    filling: each stretch has a closed form (docs/theory-model-avalanche.md, Eqs (9) and (10)). Returns the
    level, its start, the nodes left, and whether the segment meets it.
    """
    x0, g0, x1, g1 = segment
    width, mean, span = x1 - x0, 0.5 * (g0 + g1), x0 - a
    lost = 0.0
    while True:
        whole = g1 < level or g1 <= g0
        below = sg[m - 1] if m > 0 else -math.inf
        bend = 0.5 * (a - sx[m - 1]) / (level - below) if m > 0 and below < level else 0.0
        fall = level - below
        if whole:
            need, linear, square = (level - mean) * width - lost, span + width, bend
            if g1 > g0:
                fall = min(fall, level - g1)
        else:
            half = 0.5 * width / (g1 - g0)
            need = half * (level - g0) ** 2 - lost
            linear, square = span + 2.0 * half * (level - g0), bend - half
        drop = 0.0
        if need > 0.0:
            drop = 2.0 * need / (linear + math.sqrt(max(linear * linear + 4.0 * square * need, 0.0)))
        if drop <= fall:
            return level - drop, a - 2.0 * bend * drop, m, not whole
        lost += (span + bend * fall) * fall
        if fall >= level - below:
            level, a = below, sx[m - 1]
            m -= 1
        else:
            level, a = g1, a - 2.0 * bend * fall
        span = x0 - a


@njit(cache=True, nogil=True)
def _close(sx: Floats, sg: Floats, m: int, a: float, b: float, level: float, tiny: float) -> int:
    """Write a level from a to b behind the nodes so far."""
    if m > 0 and a <= sx[m - 1] + tiny:
        m -= 1
    sx[m], sg[m] = a, level
    sx[m + 1], sg[m + 1] = b, level
    return m + 2


@njit(cache=True, nogil=True)
def thin(x: Floats, y: Floats, n: int, deviation: float) -> int:
    """Drop nodes within ``deviation`` of their neighbours' chord; the neighbours take up the area.

    docs/theory-model-nodes.md, Eq. (2).
    """
    i = 1
    kept = 1  # nodes written so far
    while i < n - 1:
        left, right = kept - 1, i + 1
        chord = x[right] - x[left]
        above = y[i] - (y[left] + (y[right] - y[left]) * (x[i] - x[left]) / chord)
        if abs(above) <= deviation:
            before = x[left] - x[left - 1] if left > 0 else 0.0
            after = x[right + 1] - x[right] if right + 1 < n else 0.0
            lift = chord * above / (2.0 * chord + before + after)
            y[left] += lift
            y[right] += lift
            # the right neighbour is kept, so that deviations do not gather unseen
            x[kept], y[kept] = x[right], y[right]
            kept += 1
            i += 2
        else:
            x[kept], y[kept] = x[i], y[i]
            kept += 1
            i += 1
    if i == n - 1:
        x[kept], y[kept] = x[n - 1], y[n - 1]
        kept += 1
    return kept
