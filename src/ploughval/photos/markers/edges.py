"""A first circle through the edges about a marker, robust against a part that is covered or shines."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ploughval.photos.markers.rim import Floats

RAYS = 64
TURNS = 3
"""Times that edges are looked for, from ever better centres."""
MOST_LEFT_OUT = 40
"""Rays that may be left out in a row."""
_TURN = 2 * math.pi * (np.arange(RAYS) + 0.5) / RAYS
_DESIGN = np.column_stack([np.ones(RAYS), np.cos(_TURN), np.sin(_TURN), np.cos(2 * _TURN), np.sin(2 * _TURN)])
# A short arc fixes little: what it does not tell stays round, and near where it was thought to be.
_TRUST = np.diag([0.02, 0.02, 0.02, 6.0, 6.0])


@dataclass(frozen=True, slots=True)
class Circle:
    """Centre (2,), radius, px, and the rays (RAYS,) bool on which an edge lies on it, from +x towards +y."""

    centre_px: Floats
    radius_px: float
    on_rays: NDArray[np.bool_]


def first_circle(image: NDArray[np.generic], centre_px: Floats, radius_px: float, sign: float) -> Circle:
    """The circle that most edges about a centre lie on.

    Parameters
    ----------
    image : (H, W)
        Grey levels.
    centre_px : (2,) float
        About where.
    radius_px : float
        About how large.
    sign : float
        Positive where the marker is darker than what is about it.
    """
    centre, radius = centre_px.astype(float), radius_px
    on = np.ones(RAYS, bool)
    for _ in range(TURNS):
        far = _edges(image, centre, radius, sign)
        terms, on = _best_arc(far, radius)
        centre = centre + terms[1:3]
        radius = float(np.clip(terms[0], 0.5 * radius_px, 1.8 * radius_px))
    return Circle(centre, radius, on)


def _best_arc(far: Floats, radius: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Radius, shift (2) and stretch (2) of the rim by the arc of rays that most others agree with, and those.

    Arcs of many places and lengths are left out in turn, as what covers a marker covers an arc of it.
    """
    patience = max(0.04, 0.35 / radius)
    off = far / radius - 1
    terms = _arc_fits() @ off
    cost = np.sum(np.minimum(np.abs(off - terms @ _DESIGN.T) / patience, 1.0) ** 2, axis=1)
    best = terms[int(np.argmin(cost))]
    for _ in range(3):  # from the arc to all that agree with it
        apart = np.abs(off - _DESIGN @ best)
        weight = np.clip(1 - (apart / (2 * patience)) ** 2, 0.0, None)
        best = np.linalg.solve(_DESIGN.T @ (weight[:, None] * _DESIGN) + _TRUST, _DESIGN.T @ (weight * off))
    on = np.abs(off - _DESIGN @ best) < patience
    best[0] += 1.0
    return radius * best, on


@cache
def _arc_fits() -> Floats:
    """Least squares (A, 5, RAYS) of a rim's terms on its rays, with an arc left out in each."""
    start, length = (a.ravel() for a in np.meshgrid(np.arange(0, RAYS, 2), np.arange(0, MOST_LEFT_OUT, 3)))
    ray = (np.arange(RAYS)[None, :] - start[:, None]) % RAYS
    used = (ray >= length[:, None])[:, None, :] * _DESIGN.T
    return np.asarray(np.linalg.solve(used @ _DESIGN + _TRUST, used))


def _edges(image: NDArray[np.generic], centre: Floats, radius: float, sign: float) -> Floats:
    """Distance (RAYS,) px of the steepest place on each ray, of the wanted sign."""
    step = max(0.5, radius / 20)
    along = np.arange(max(0.4 * radius, 1.0), 1.7 * radius + 1.5, step)
    places = centre + along[None, :, None] * _DESIGN[:, None, 1:3]
    grey = _bilinear(image, places)
    smooth = (grey[:, :-2] + 2 * grey[:, 1:-1] + grey[:, 2:]) / 4
    rise = sign * np.diff(smooth, axis=1)
    middle = along[1:-2] + step / 2
    likely = rise * np.exp(-0.5 * ((middle - radius) / (0.35 * radius)) ** 2)
    best = np.argmax(likely, axis=1)
    inner = np.clip(best, 1, rise.shape[1] - 2)
    index = np.arange(RAYS)
    left, top, right = rise[index, inner - 1], rise[index, inner], rise[index, inner + 1]
    bend = left - 2 * top + right
    part = np.where(bend < 0, np.clip(0.5 * (left - right) / np.where(bend < 0, bend, -1.0), -1, 1), 0.0)
    return np.asarray(middle[inner] + step * part)


def _bilinear(image: NDArray[np.generic], places: Floats) -> Floats:
    """Grey levels between pixels; beyond the border those of the nearest pixel."""
    height, width = image.shape
    x = np.clip(places[..., 0], 0, width - 1.001)
    y = np.clip(places[..., 1], 0, height - 1.001)
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = x - column, y - row
    upper = image[row, column] * (1 - u) + image[row, column + 1] * u
    lower = image[row + 1, column] * (1 - u) + image[row + 1, column + 1] * u
    return np.asarray(upper * (1 - v) + lower * v)
