"""Search far beyond the subset: coarse templates, turned where they must be; repeated texture is told."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.guess import Greys, carried_on, failed_points, retry, spread_by_neighbours
from ploughval.piv.subsets import Fit, Floats, Pair, centres_of, match
from ploughval.piv.validate import gather, judge_correlation, neighbours_of

SEEDS = 48
"""Templates searched in one round."""
COARSE = 16
"""Side of a template, coarse px."""
LEAST_SCORE = 0.4
"""Least correlation of a coarse template; chance reaches 0.25 of so many pixels."""
LEAD = 0.08
"""A template's best place leads every other one by this much: else the texture repeats."""
TURNS_DEG = (0.0, -10.0, 10.0, -20.0, 20.0)
WIDEST = 256
"""Farthest search, px; a third of the picture where that is less."""
REPEATS = 0.9
"""A subset that fits another place of its own picture this well is ambiguous."""
LIKELY = 0.8
"""The same where the picture is known to repeat itself."""
LEAST_FAR = 0.5
"""The same in the shrunk picture, whose pixels need not fall on the period."""
SHRUNK = 4
LEAST_SIDE = 11
"""Windows that are looked for elsewhere have at least this side, px."""
PROBED = 8
"""Points whose surroundings are looked through for repeated texture before all are."""


@dataclass(frozen=True, slots=True)
class Hit:
    """Best place of a template: displacement (2,) px, its correlation, its lead over the second best."""

    moved: Floats
    score: float
    lead: float
    second: Floats


def search_failed(pair: Pair, greys: Greys, fit: Fit, points: Floats, zncc_min: float) -> None:
    """Find some of the failed points by coarse templates; their neighbours follow. In place."""
    scale = 4 if min(greys.reference.shape) >= 320 else 2
    coarse = Greys(_shrunk(greys.reference, scale), _shrunk(greys.current, scale))
    if min(coarse.reference.shape) < 2 * COARSE:
        return
    for turns in (TURNS_DEG[:1], TURNS_DEG):
        failed = failed_points(fit)
        if failed.size == 0:
            return
        some = failed[np.linspace(0, failed.size - 1, min(SEEDS, failed.size)).astype(int)]
        seeds = _seeds(pair, coarse, greys, points[some], scale, turns)
        judge_correlation(seeds, zncc_min, pair.noise_variance)
        good = np.flatnonzero(seeds.status == Status.OK)
        if good.size == 0:
            continue
        fit.put(some[good], seeds.take(good))
        left = failed_points(fit)
        start = carried_on(points[some[good]], seeds.params[good], points[left], pair.recipe.half)
        retry(pair, fit, points, left, start, zncc_min)
        spread_by_neighbours(pair, fit, points, zncc_min)


def _shrunk(image: NDArray[np.uint8], scale: int) -> NDArray[np.float32]:
    size = (image.shape[1] // scale, image.shape[0] // scale)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.float32)


def _seeds(
    pair: Pair, coarse: Greys, greys: Greys, points: Floats, scale: int, turns: tuple[float, ...]
) -> Fit:
    """Points found by coarse templates, then by fine ones, then matched; unmatched ones are NOT_CONVERGED."""
    start = np.full((len(points), 2, pair.recipe.terms), np.nan)
    widest = min(WIDEST, min(greys.reference.shape) // 3)
    for n, point in enumerate(points):
        found: tuple[Hit, float] | None = None
        for turn in turns:
            hit = search_template(
                coarse, point / scale - 0.5 + 0.5 / scale, np.zeros(2), COARSE, widest // scale, turn
            )
            if hit is not None and (found is None or hit.score > found[0].score):
                found = hit, turn
        if found is None or found[0].score < LEAST_SCORE or found[0].lead < LEAD:
            continue
        fine = search_template(greys, point, found[0].moved * scale, pair.recipe.subset, 2 * scale, found[1])
        if fine is None:
            continue
        start[n] = 0.0
        start[n, :, 0] = fine.moved
        if pair.recipe.terms >= 3:
            start[n, :, 1:3] = (rotation(found[1]) - np.eye(2)) * pair.recipe.half
    known = np.flatnonzero(np.isfinite(start[:, 0, 0]))
    out = Fit.empty(len(points), pair.recipe.terms, Status.NOT_CONVERGED)
    out.put(known, match(pair, points[known], start[known]))
    return out


@lru_cache(maxsize=16)
def rotation(turn_deg: float) -> Floats:
    """Matrix (2, 2) of a rotation in image axes."""
    c, s = np.cos(np.deg2rad(turn_deg)), np.sin(np.deg2rad(turn_deg))
    return np.array([[c, -s], [s, c]])


def search_template(
    greys: Greys, point: Floats, prior: Floats, side: int, radius: int, turn_deg: float = 0.0
) -> Hit | None:
    """Best displacement of a square template in whole px by zero-mean normalised correlation.

    Parameters
    ----------
    greys : Greys
        Pictures.
    point : (2,) float, px
        Middle of the template in the reference.
    prior : (2,) float, px
        Middle of the search.
    side, radius : int, px
        Side of the template; how far the search reaches.
    turn_deg : float
        The template is turned by this angle before.

    Returns
    -------
    Hit, or None where template or window leave the picture, or the template is flat
    """
    height, width = greys.reference.shape
    cx, cy = centres_of(point[None])[0]
    half = side // 2
    x1, y1 = cx - half + side, cy - half + side
    if cx < half or cy < half or x1 > width or y1 > height:
        return None
    if turn_deg == 0.0:
        template = greys.reference[cy - half : y1, cx - half : x1]
    else:
        back = rotation(-turn_deg)
        centre = np.array([side // 2, side // 2], float)
        warp = np.column_stack([back, np.array([cx, cy]) - back @ centre])
        template = cv2.warpAffine(
            greys.reference, warp, (side, side), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REFLECT_101,
        )  # fmt: skip
    left, top = (np.array([cx, cy]) + np.round(prior).astype(int) - half - radius).tolist()
    right, bottom = min(left + side + 2 * radius, width), min(top + side + 2 * radius, height)
    left, top = max(left, 0), max(top, 0)
    if right - left < side or bottom - top < side or np.ptp(template) == 0:
        return None
    scores = cv2.matchTemplate(greys.current[top:bottom, left:right], template, cv2.TM_CCOEFF_NORMED)
    scores = np.nan_to_num(scores, posinf=0.0, neginf=0.0)
    _, best, _, (bx, by) = cv2.minMaxLoc(scores)
    rest = scores.copy()
    rest[
        max(by - side // 5 - 1, 0) : by + side // 5 + 2, max(bx - side // 5 - 1, 0) : bx + side // 5 + 2
    ] = -1.0
    moved = np.array([left + bx + half - cx, top + by + half - cy], float)
    _, other, _, (ox, oy) = cv2.minMaxLoc(rest)
    second = np.array([left + ox + half - cx, top + oy + half - cy], float)
    return Hit(moved, float(best), float(best - other), second)


def repeats(greys: Greys, points: Floats, side: int) -> bool:
    """Whether the texture about any of some points fits another place of its own picture as well."""
    itself, coarse = _itself(greys)
    probed = points[np.linspace(0, len(points) - 1, min(PROBED, len(points))).astype(int)]
    return any(_recurs(itself, coarse, point, max(side, LEAST_SIDE)) for point in probed)


def _itself(greys: Greys) -> tuple[Greys, Greys]:
    """The reference beside itself, as it is and shrunk."""
    small = _shrunk(greys.reference, SHRUNK)
    return Greys(greys.reference, greys.reference), Greys(small, small)


def mark_ambiguous(greys: Greys, fit: Fit, points: Floats, side: int) -> None:
    """Mark valid vectors whose subset, and a window three times as wide, recur within reach. In place.

    Exactly repeated texture fits as well a period further on; no correlation can tell which it is.
    """
    valid = np.flatnonzero(fit.status == Status.OK)
    if valid.size == 0:
        return
    itself, coarse = _itself(greys)
    side = max(side, LEAST_SIDE)
    for n in valid:
        if all(_recurs(itself, coarse, points[n], window, LIKELY) for window in (side, 3 * side)):
            fit.status[n] = Status.AMBIGUOUS
    # A window may by chance miss its own repetition: what stands among ambiguous points is ambiguous.
    ambiguous = (fit.status[valid] == Status.AMBIGUOUS).astype(float)
    near = gather(ambiguous, neighbours_of(points[valid]))
    fit.status[valid[np.nanmean(np.column_stack([ambiguous, near]), axis=1) > 0.5]] = Status.AMBIGUOUS


def _recurs(itself: Greys, coarse: Greys, point: Floats, side: int, least: float = REPEATS) -> bool:
    """Whether a window fits its own picture elsewhere about as well as where it is.

    Near by it is looked for at full scale, further on in a shrunk picture and then about what was found.
    """
    height, width = itself.reference.shape
    side = min(side, min(height, width) // 2 // 2 * 2 - 1)
    if side < LEAST_SIDE:
        return False
    half = side // 2 + 1
    point = np.clip(point, half, [width - 1 - half, height - 1 - half])  # windows stay in the picture
    hit = search_template(itself, point, np.zeros(2), side, max(side // 2, 16))
    if hit is not None and hit.lead < 1.0 - least:
        return True
    window = max(side // SHRUNK, COARSE // 2)
    reach = min(WIDEST, min(height, width) // 3) // SHRUNK
    far = search_template(coarse, (point + 0.5) / SHRUNK - 0.5, np.zeros(2), window, reach)
    if far is None or far.lead > 1.0 - LEAST_FAR:
        return False
    fine = search_template(itself, point, far.second * SHRUNK, side, 2 * SHRUNK)
    return fine is not None and fine.score > least and bool(np.abs(fine.moved).max() > 2)
