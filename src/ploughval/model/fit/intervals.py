"""Intervals by profile likelihood."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.model.fit.objective import Objective
from ploughval.model.fit.search import local_search

Floats = NDArray[np.float64]

PROFILE_TOLERANCE = 5e-4  # of the model: profiles compare runs of one tolerance with each other
LEVELS = (0.68, 0.95)
POINTS = 9  # of a profile on either side, at most
WIDTH = 0.1  # degrees, of differences
SEARCH = 12  # evaluations of a search on a profile
SUDDEN = (
    4.0  # times the rise at the end of the widest interval: after so high a step a search may have strayed
)
HALVINGS = 4  # of steps on either side


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """Least cost against one fitted parameter.

    Attributes
    ----------
    parameter : str
        Its name.
    values : (M,) float
        Values held, ascending, on the searched scale.
    rises : (M,) float
        Least cost there above the least of all.
    unknowns : (M, V) float
        All unknowns there.
    limits : dict of level to (low, high)
        On the searched scale; infinite where the range searched ends before.
    """

    parameter: str
    values: Floats
    rises: Floats
    unknowns: Floats
    limits: dict[float, tuple[float, float]]


def quantiles(freedom: float) -> dict[float, float]:
    """Rise of the cost at the ends of each interval: the square of Student's quantile."""
    from scipy.stats import t  # slow to import, not needed before a fit is asked for

    return {level: float(t.ppf(0.5 + 0.5 * level, freedom)) ** 2 for level in LEVELS}


def profile(objective: Objective, best: Floats, index: int, std: float, rises: dict[float, float]) -> Profile:
    """The profile of one fitted parameter around the best unknowns (docs/theory-fit.md, Eq. (6)).

    Parameters
    ----------
    objective : Objective
        At the tolerance at which ``best`` is the best.
    best : (V,) float
        The unknowns of least cost.
    index : int
        Which of them is held.
    std : float
        First step.
    rises : dict of level to float
        Rise of the cost at the ends of the intervals.
    """
    base = objective.cost(best)
    low, high = objective.space.low[index], objective.space.high[index]
    lower = _walk(objective, best, index, (low, -std), (base, max(rises.values())))
    upper = _walk(objective, best, index, (high, std), (base, max(rises.values())))
    points = [*lower[::-1], (best[index], 0.0, best), *upper]
    values, cost, unknowns = (np.array([point[k] for point in points]) for k in range(3))
    middle = len(lower)
    limits = {
        level: (
            _crossing(values[middle::-1], cost[middle::-1], rise, -np.inf),
            _crossing(values[middle:], cost[middle:], rise, np.inf),
        )
        for level, rise in rises.items()
    }
    return Profile(objective.space.fitted[index], values, cost, unknowns, limits)


def _walk(
    objective: Objective, best: Floats, index: int, way: tuple[float, float], costs: tuple[float, float]
) -> list[tuple[float, float, Floats]]:
    """Points of a profile from the best one to where its cost has risen enough, or the range ends."""
    (bound, step), (base, enough) = way, costs
    sign, room = np.sign(step), abs(bound - best[index])
    points: list[tuple[float, float, Floats]] = []
    last, root, distance = best, 0.0, 0.0
    following, halvings = min(abs(step), 0.5 * room), HALVINGS
    while len(points) < POINTS and room > 1e-12:
        behind = abs(points[-1][0] - best[index]) if points else 0.0
        distance = min(following, room)
        held = last.copy()
        if points:  # the other unknowns go on as they went
            before = best if len(points) == 1 else points[-2][2]
            gone = abs(last[index] - before[index])
            held = last + (last - before) * (distance - abs(last[index] - best[index])) / max(gone, 1e-300)
            held = np.clip(held, *objective.bounds(last))
        held[index] = best[index] + sign * distance
        found = local_search(objective, held, WIDTH, held=index, limit=SEARCH)
        rise = objective.cost(found) - base
        if halvings and rise > SUDDEN * enough:
            following, halvings = 0.5 * (behind + distance), halvings - 1
            continue
        last = found
        points.append((float(last[index]), rise, last))
        if rise >= enough or distance >= room:
            break
        gain = max(np.sqrt(max(rise, 0.0)) - root, 0.1 * np.sqrt(enough))
        root = np.sqrt(max(rise, 0.0))
        ahead = 1.05 * (np.sqrt(enough) - root) * (distance - behind) / gain
        following = distance + float(np.clip(ahead, 0.2 * distance, 2.0 * distance))
        if len(points) == POINTS - 1:
            following = room
    return points


def _crossing(values: Floats, rises: Floats, rise: float, none: float) -> float:
    """Where the root of the rise first crosses that of a level; ``none`` where it does not."""
    over = np.flatnonzero(rises >= rise)
    if not over.size:
        return none
    k = int(over[0])
    roots = np.sqrt(np.maximum(rises[[k - 1, k]], 0.0))
    share = (np.sqrt(rise) - roots[0]) / max(roots[1] - roots[0], 1e-300)
    return float(values[k - 1] + share * (values[k] - values[k - 1]))
