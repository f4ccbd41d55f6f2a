"""Finds what is round and of a marker's size near a place: the share of its rim that has a matching edge.

Edges vote by their direction, not by their strength (Loy and Zelinsky, 2003), so that a dot half covered, or
beside something brighter, still has the best place.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.photos.markers.rim import Floats

RADII = np.geomspace(0.73, 1.37, 6)
"""Radii that are tried, over the stated one."""
FINE_PX = 8.0
"""Larger markers are searched for in a picture that is made smaller."""
PIECES = 6
"""A rim votes in so many pieces; one whose edges run the other way is not counted."""
CANDIDATES = 12
LEAST_VOTES = 0.25
"""Share of a rim that must have an edge of the right direction."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """Something round: centre (2,) px, radius, px, share of the rim that votes; negative: paler inside."""

    centre_px: Floats
    radius_px: float
    votes: float


def search(
    image: NDArray[np.generic],
    place_px: Floats,
    radius_px: float,
    reach_px: float,
    *,
    contrast: float | None = None,
) -> list[Candidate]:
    """Round things near a place, the best first.

    Parameters
    ----------
    image : (H, W)
        Grey levels.
    place_px : (2,) float
        Right and down.
    radius_px : float
        Stated radius.
    reach_px : float
        How far from the place a centre may be.
    contrast : float, optional
        Negative for markers darker than what is about them, positive for paler ones; not given: either.
    """
    half = math.ceil(reach_px + 1.5 * radius_px + 4)
    x, y = (round(float(c)) for c in place_px)
    height, width = image.shape
    left, right = max(x - half, 0), min(x + half + 1, width)
    top, bottom = max(y - half, 0), min(y + half + 1, height)
    coarse = max(1, round(radius_px / FINE_PX))
    if min(right - left, bottom - top) < max(8, coarse):
        return []
    patch = _smaller(image[top:bottom, left:right].astype(np.float32), coarse)
    votes, radii = _votes(patch, radius_px / coarse)
    rows, columns = np.mgrid[: patch.shape[0], : patch.shape[1]]
    place = (np.asarray(place_px) - (left, top) + 0.5) / coarse - 0.5
    votes[np.hypot(columns - place[0], rows - place[1]) > reach_px / coarse + 1] = 0.0
    if contrast is not None:
        votes[votes * contrast > 0] = 0.0
    found = []
    for _ in range(CANDIDATES):
        row, column = np.unravel_index(int(np.argmax(np.abs(votes))), votes.shape)
        best = float(votes[row, column])
        if abs(best) < LEAST_VOTES:
            break
        radius = float(radii[row, column])
        centre = (np.array([column, row]) + 0.5) * coarse - 0.5 + (left, top)
        found.append(Candidate(centre, radius * coarse, best))
        votes[np.hypot(columns - column, rows - row) < max(0.35 * radius, 1.5)] = 0.0
    return found


def _smaller(patch: NDArray[np.float32], factor: int) -> NDArray[np.float32]:
    if factor == 1:
        return patch
    height, width = (n // factor * factor for n in patch.shape)
    size = (width // factor, height // factor)
    return np.asarray(cv2.resize(patch[:height, :width], size, interpolation=cv2.INTER_AREA), np.float32)


def _votes(patch: NDArray[np.float32], radius: float) -> tuple[Floats, Floats]:
    """At each pixel the largest share of a rim about it that has a matching edge, signed, and its radius."""
    smooth = cv2.GaussianBlur(patch, (0, 0), max(0.8, radius / 8))
    gx = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 8)
    gy = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3, scale=1 / 8)
    steep = np.hypot(gx, gy)
    floor = max(float(np.percentile(steep, 95)) / 4, 1e-6)
    gx, gy = gx / (steep + floor), gy / (steep + floor)
    dark, pale = np.zeros(patch.shape, np.float32), np.zeros(patch.shape, np.float32)
    best, which = np.zeros(patch.shape), np.full(patch.shape, radius)
    for share in RADII:
        dark[:], pale[:] = 0.0, 0.0
        for across, down in _rim_kernels(radius * share):
            votes = cv2.filter2D(gx, cv2.CV_32F, across, borderType=cv2.BORDER_CONSTANT)
            votes = votes + cv2.filter2D(gy, cv2.CV_32F, down, borderType=cv2.BORDER_CONSTANT)
            dark += np.maximum(votes, 0.0)
            pale += np.maximum(-votes, 0.0)
        signed = np.where(dark >= pale, dark, -pale)
        better = np.abs(signed) > np.abs(best)
        best[better], which[better] = signed[better], radius * share
    return best, which


def _rim_kernels(radius: float) -> list[tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """Direction across and down of a thin rim, piece by piece; weights of all pieces add up to one."""
    half = math.ceil(radius + 2)
    y, x = np.mgrid[-half : half + 1, -half : half + 1].astype(np.float32)
    far = np.maximum(np.hypot(x, y), 1e-6)
    weight = np.exp(-0.5 * ((far - radius) / 0.8) ** 2)
    weight /= weight.sum()
    piece = np.minimum((np.arctan2(y, x) / (2 * np.pi) % 1.0 * PIECES).astype(int), PIECES - 1)
    return [
        (np.asarray(w * x / far, np.float32), np.asarray(w * y / far, np.float32))
        for w in (np.where(piece == k, weight, 0.0) for k in range(PIECES))
    ]
