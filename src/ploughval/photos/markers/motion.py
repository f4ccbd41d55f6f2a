"""Shift, turn and scale that fixed markers tell together; a marker that goes its own way is left out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.photos.markers.rim import Floats

LEAST = 3
"""Markers that tell a turn and a scale, with something to spare."""
ASTRAY = 4.0
"""A marker whose place disagrees with the others by so many stds is left out."""
ASTRAY_PX = 0.06
"""Nothing less is."""
FLOOR_PX = 0.004
"""Added to every marker's std: paint and lens are not perfect."""


@dataclass(frozen=True, slots=True)
class Similarity:
    """now = pivot + linear (first - pivot) + shift (docs/markers.md, Eq. (2)).

    Attributes
    ----------
    pivot_px, shift_px : (2,) float
    linear : (2, 2) float
        Turn and scale.
    shift_std_px, turn_std : float
        Standard deviation of a coordinate of the shift, and of the turn (rad) and of the scale.
    used : (N,) bool
        Markers that agree.
    off_px : (N,) float
        How far each lies from where the others have it; NaN where it was not seen.
    """

    pivot_px: Floats
    shift_px: Floats
    linear: Floats
    shift_std_px: float
    turn_std: float
    used: NDArray[np.bool_]
    off_px: Floats


def fit_similarity(first_px: Floats, now_px: Floats, std_px: Floats) -> Similarity | None:
    """The movement of most markers.

    Parameters
    ----------
    first_px, now_px : (N, 2) float
        Places in the first photograph and in this one; NaN: not found.
    std_px : (N,) float
        Standard deviation of a coordinate of their difference.

    Returns
    -------
    Similarity or None
        None where fewer than LEAST markers agree.
    """
    used: NDArray[np.bool_] = np.asarray(np.isfinite(np.hstack([first_px, now_px])).all(axis=1))
    std = np.hypot(std_px, FLOOR_PX)
    while used.sum() >= LEAST:
        apart = _apart(first_px, now_px, std, used)
        limit = np.maximum(ASTRAY * apart[:, 1], ASTRAY_PX)
        excess = np.where(used, apart[:, 0] / limit, 0.0)
        worst = int(np.argmax(excess))
        if excess[worst] <= 1:
            return _told(first_px, now_px, std, used)
        if used.sum() == LEAST:  # two that agree with each other say nothing
            return None
        used = used & (np.arange(len(used)) != worst)
    return None


def _apart(first: Floats, now: Floats, std: Floats, used: NDArray[np.bool_]) -> Floats:
    """Distance of each used marker from where the others have it, and what noise makes of that: (N, 2) px.

    From the residual of the common fit and the marker's leverage: what a fit without it would give.
    """
    design, rest, _, covariance = _solve(first, now, std, used)
    own = np.einsum("nij,jk,nlk->nil", design, covariance, design)
    out = np.zeros((len(first), 2))
    for k in np.flatnonzero(used):
        left = np.eye(2) - own[k] / std[k] ** 2
        spare = float(np.linalg.eigvalsh(left)[0])
        if spare > 1e-6:
            off = np.linalg.solve(left, rest[k])
            out[k] = np.hypot(*off), std[k] / np.sqrt(spare)
    return out


def _solve(
    first: Floats, now: Floats, std: Floats, used: NDArray[np.bool_]
) -> tuple[Floats, Floats, Floats, Floats]:
    """Design (N, 2, 4), residuals (N, 2), terms (shift, scale - 1, turn) and their covariance."""
    arm = first - first[used].mean(axis=0)
    design = np.zeros((len(first), 2, 4))
    design[:, 0, 0] = design[:, 1, 1] = 1.0
    design[:, :, 2] = arm
    design[:, 0, 3], design[:, 1, 3] = arm[:, 1], -arm[:, 0]
    weighted = (design / std[:, None, None])[used].reshape(-1, 4)
    moved = now - first
    normal = weighted.T @ weighted
    terms = np.linalg.lstsq(weighted, (moved / std[:, None])[used].reshape(-1), rcond=None)[0]
    rest = moved - design @ terms
    return design, rest, np.asarray(terms), np.asarray(np.linalg.pinv(normal))


def _told(first: Floats, now: Floats, std: Floats, used: NDArray[np.bool_]) -> Similarity:
    _, rest, terms, covariance = _solve(first, now, std, used)
    scale, turn = terms[2:]
    spare = 2 * int(used.sum()) - 4
    excess = float(np.sum((rest[used] / std[used, None]) ** 2)) / spare
    spread = np.sqrt(np.diag(covariance) * max(excess, 1.0))
    return Similarity(
        pivot_px=first[used].mean(axis=0),
        shift_px=terms[:2],
        linear=np.array([[1 + scale, turn], [-turn, 1 + scale]]),
        shift_std_px=float(np.sqrt(np.mean(spread[:2] ** 2))),
        turn_std=float(np.sqrt(np.mean(spread[2:] ** 2))),
        used=used,
        off_px=np.hypot(*rest.T),
    )
