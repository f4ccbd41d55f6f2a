"""Least force of two blocks on a bent band under any surface (docs/theory-model-two-blocks.md, section 2)."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ploughval.model.mechanism import band_force, cheapest_band
from ploughval.model.surface import height_at

Floats = NDArray[np.float64]

SHARES = (0.15, 0.3, 0.45, 0.6, 0.8)  # of the straight band's reach, and
DEPTHS = (
    0.001,
    0.004,
    0.016,
    0.05,
    0.12,
    0.25,
    0.5,
)  # of the face's height below it: joints from which to descend
SPREAD = 0.03  # first edges of the descent's triangle, in heights of the face
ALIKE = 1e-13  # relative difference of the triangle's forces at which the descent ends
TURNS = 200


class Shear(NamedTuple):
    """Friction on bands and interface, the blade's in radians, surcharge / unit weight, lowest joint."""

    tan_phi: float
    wall: float
    load: float
    lowest: float  # height of the joint above the tip: 0 where block 1 must not slide down the face


@njit(cache=True, nogil=True)
def bent_force(
    joint: tuple[float, float], x: Floats, y: Floats, n: int, shear: Shear, place: float, above: Floats
) -> tuple[float, float]:
    """P / unit weight of two blocks, and the outcrop: ``place``, or the cheapest where that is NaN.

    The tip stands at (x[0], 0) under an upright face, the joint so far from it. The interface from the joint
    to the top of the face is to block 2 what a rough, inclined blade is (docs/theory-model-two-blocks.md,
    Eqs (2) and (3)): its least force comes from the search for one block. ``above`` is room for heights over
    the joint. Infinite: no such mechanism.
    """
    ahead, up = joint[0], max(joint[1], shear.lowest)
    height = y[0] - up
    if ahead <= 0.0 or height <= 0.0 or _leaves_the_sand(ahead, up, x, y, n):
        return math.inf, place
    phi, lower, back = math.atan(shear.tan_phi), math.atan(up / ahead), math.atan(ahead / height)
    if lower + phi <= 0.0 or lower + phi + shear.wall >= 0.5 * math.pi:
        return math.inf, place
    above[:n] = y[:n] - up
    tan_interface = math.tan(phi - back)
    if math.isnan(place):
        pushed, place = cheapest_band(x, above, n, shear.tan_phi, tan_interface, shear.load, -ahead)
    else:
        pushed = band_force(x, above, n, place, shear.tan_phi, tan_interface, shear.load, -ahead)
    if not math.isfinite(pushed):
        return math.inf, place
    top = height_at(x, above, n, place)
    if top * ahead <= up * (place - x[0] - ahead):
        return math.inf, place  # bent the other way: block 2 would have to sink along the interface
    own = 0.5 * ahead * y[0] * math.sin(lower + phi)
    force = (own + pushed * math.cos(lower + 2.0 * phi - back)) / math.cos(lower + phi + shear.wall)
    return force, place


@njit(cache=True, nogil=True)
def _leaves_the_sand(ahead: float, up: float, x: Floats, y: Floats, n: int) -> bool:
    """Whether the interface from the top of the face to the joint comes out of the surface on its way."""
    fall = (y[0] - up) / ahead
    for i in range(1, n):
        if x[i] - x[0] >= ahead:
            share = (ahead - (x[i - 1] - x[0])) / (x[i] - x[i - 1])
            return bool(y[i - 1] + share * (y[i] - y[i - 1]) <= up)
        if y[i] < y[0] - fall * (x[i] - x[0]):
            return True
    return True


@njit(cache=True, nogil=True)
def least_bent(
    x: Floats,
    y: Floats,
    n: int,
    shear: Shear,
    straight: tuple[float, float],
    free: bool,
    above: Floats,
) -> tuple[float, float, tuple[float, float]]:
    """Least P / unit weight of one and two blocks, its outcrop, and the joint; (0, 0) for one block.

    ``straight``: force and outcrop of one block, which is never exceeded. ``free``: the outcrop is sought
    too. The descent begins at the best of a net of joints below the straight band.
    """
    reach, top = straight[1] - x[0], height_at(x, y, n, straight[1])
    place = math.nan if free else straight[1]
    start, best = (0.0, 0.0), straight[0]
    for share in SHARES:
        for depth in DEPTHS:
            tried = (share * reach, share * top - depth * y[0])
            found = bent_force(tried, x, y, n, shear, place, above)[0]
            if found < best:
                start, best = tried, found
    if start[0] == 0.0:
        return straight[0], straight[1], start
    joint = _descend(x, y, n, shear, place, start, above)
    force, outcrop = bent_force(joint, x, y, n, shear, place, above)
    if joint[1] <= shear.lowest:  # a triangle that has come to lie below it is blind to joints above
        raised = _descend(x, y, n, shear, place, (joint[0], shear.lowest + SPREAD * y[0]), above)
        other, other_outcrop = bent_force(raised, x, y, n, shear, place, above)
        if other < force:
            force, outcrop, joint = other, other_outcrop, raised
    if force >= straight[0]:
        return straight[0], straight[1], (0.0, 0.0)
    return force, outcrop, (joint[0], max(joint[1], shear.lowest))


@njit(cache=True, nogil=True)
def _descend(
    x: Floats, y: Floats, n: int, shear: Shear, place: float, start: tuple[float, float], above: Floats
) -> tuple[float, float]:
    """Joint of least force by a shrinking triangle (Nelder and Mead 1965) about a first joint."""
    edge = SPREAD * y[0]
    a = np.array((start[0], start[0] + edge, start[0]))
    b = np.array((start[1], start[1], start[1] - 0.5 * edge))
    p = np.empty(3)
    for k in range(3):
        p[k] = bent_force((a[k], b[k]), x, y, n, shear, place, above)[0]
    for _ in range(TURNS):
        low, high = int(np.argmin(p)), int(np.argmax(p))
        if p[high] - p[low] <= ALIKE * p[low] or low == high:
            break
        middle = 3 - low - high
        ca, cb = 0.5 * (a[low] + a[middle]), 0.5 * (b[low] + b[middle])
        ra, rb = 2.0 * ca - a[high], 2.0 * cb - b[high]
        rp = bent_force((ra, rb), x, y, n, shear, place, above)[0]
        if rp < p[low]:
            ea, eb = 3.0 * ca - 2.0 * a[high], 3.0 * cb - 2.0 * b[high]
            ep = bent_force((ea, eb), x, y, n, shear, place, above)[0]
            if ep < rp:
                ra, rb, rp = ea, eb, ep
        elif rp >= p[middle]:
            if rp < p[high]:
                a[high], b[high], p[high] = ra, rb, rp
            ra, rb = 0.5 * (ca + a[high]), 0.5 * (cb + b[high])
            rp = bent_force((ra, rb), x, y, n, shear, place, above)[0]
            if rp >= p[high]:
                for k in (middle, high):
                    a[k], b[k] = 0.5 * (a[k] + a[low]), 0.5 * (b[k] + b[low])
                    p[k] = bent_force((a[k], b[k]), x, y, n, shear, place, above)[0]
                continue
        a[high], b[high], p[high] = ra, rb, rp
    low = int(np.argmin(p))
    return a[low], b[low]
