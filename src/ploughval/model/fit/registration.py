"""Travel of the record laid on travel of the model, so that both change their band at the same rows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Teeth:
    """Visible teeth of a modelled force history, the first one starting at u = 0.

    Attributes
    ----------
    place_mm : (T,) float
        Where their bands start.
    soft_mm : (T,) float
        Travel over which they soften.
    middle_mm : (T,) float
        Travel from their start to where the force has fallen half-way to its trough.
    drop : (T,) float
        Fall of the force, relative.
    """

    place_mm: Floats
    soft_mm: Floats
    middle_mm: Floats
    drop: Floats


def teeth_of(rows: Floats, length_mm: float, visible: float) -> Teeth:
    """Teeth of a march whose force falls by at least the share ``visible`` (the first one in any case)."""
    u, force, slip = rows[:, 0], rows[:, 2], rows[:, 7]
    starts = np.flatnonzero(np.diff(rows[:, 6], prepend=-1.0))
    drop = 1.0 - np.minimum.reduceat(force, starts) / force[starts]
    seen = np.flatnonzero(drop >= visible)
    seen = seen if seen.size and seen[0] == 0 else np.concatenate([[0], seen])
    ends = np.append(starts[1:], len(u))
    soft, middle = np.zeros(len(seen)), np.zeros(len(seen))
    for k, tooth in enumerate(seen):
        first, last = starts[tooth], ends[tooth]
        part = force[first:last]
        done = int(np.argmax(slip[first:last] >= length_mm)) or len(part) - 1
        soft[k] = u[first + done] - u[first]
        low = int(np.argmin(part))
        level = 0.5 * (part[0] + part[low])
        if low > 0:
            after = int(np.argmax(part[: low + 1] <= level))
            share = (part[after - 1] - level) / max(part[after - 1] - part[after], 1e-300)
            middle[k] = u[first + after - 1] + share * (u[first + after] - u[first + after - 1]) - u[first]
    return Teeth(u[starts[seen]], soft, middle, drop[seen])


def starts_in_record(middles_mm: Floats, teeth: Teeth) -> Floats:
    """Where the bands of the record start, taken to fall as the model's do."""
    known = min(len(middles_mm), len(teeth.place_mm) - 1)
    ahead = np.full(len(middles_mm), teeth.middle_mm[known])
    ahead[:known] = teeth.middle_mm[1 : known + 1]
    return np.asarray(middles_mm - ahead)


def laid_on(u_mm: Floats, start_mm: float, switches_mm: Floats, end_mm: float, teeth: Teeth) -> Floats:
    """Travel of the model for travel of the record (docs/theory-fit.md, Eq. (2)).

    Piecewise linear: each tooth of the record is laid on the model's. The softening after a switch is not
    stretched, what is left of the tooth is. The last tooth, which the record does not close, is not stretched
    unless the model would switch before the record ends.
    """
    places = teeth.place_mm
    known = min(len(switches_mm), len(places) - 1)
    record = np.concatenate([[start_mm], switches_mm[:known]])
    model = places[: known + 1]
    rest = end_mm - record[-1]
    close = min(rest, places[known + 1] - model[-1]) if known + 1 < len(places) else rest
    ends = np.append(record, end_mm), np.append(model, model[-1] + close)
    lengths = np.minimum(np.diff(ends[0]), np.diff(ends[1]))
    soft = np.clip(teeth.soft_mm[: known + 1], 0.0, 0.5 * np.maximum(lengths, 0.0))
    knots = np.empty((2, 2 * known + 3))
    for row, ends_row in zip(knots, ends, strict=True):
        row[0::2] = ends_row
        row[1::2] = ends_row[:-1] + soft
    return np.asarray(np.interp(u_mm, knots[0], knots[1]))


def prices(
    start_mm: float, switches_mm: Floats, end_mm: float, teeth: Teeth, spread: tuple[float, float]
) -> Floats:
    """What the stretch of each tooth costs, in standard deviations (docs/theory-fit.md, Eq. (3)).

    One value a switch of the record, then one for a switch of the model before the record's end that the
    record does not show. ``spread``: relative, and absolute in mm.
    """
    relative, absolute = spread
    count, places = len(switches_mm), teeth.place_mm
    known = min(count, len(places) - 1)
    cost = np.full(count + 1, 0.0)
    lengths = np.diff(places[: known + 1])
    seen = np.diff(np.concatenate([[start_mm], switches_mm[:known]]))
    cost[:known] = (seen - lengths) / np.hypot(relative * lengths, absolute)
    cost[known:count] = 1.0 / max(relative, 1e-3)
    if known == count and known + 1 < len(places):
        wanted = places[known + 1] - places[known]
        missing = end_mm - (switches_mm[-1] if count else start_mm) - wanted
        weight = min(1.0, teeth.drop[known + 1] / max(teeth.drop[: known + 2].max(), 1e-9))
        cost[count] = weight * max(missing, 0.0) / np.hypot(relative * wanted, absolute)
    return cost
