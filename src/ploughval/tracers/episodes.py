"""Bands as intervals of activity: an outcrop that jumps ahead starts one.

docs/theory-bands.md, section 6.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ploughval.tracers.view import Floats

_JUMP = 0.12  # of the outcrop's distance from the tip: the least jump of a new band
_LONE_JUMP = 0.2  # the same where a single increment says so, at the end of the series
_JUMP_STDS = 4.0
_STEP = 0.4  # of a jump: what the outcrop steps at least where it happens
_SIDE = 4  # increments to either side of a jump that are looked at
_LEVEL = 3  # of them: those whose median is its level
_CREEP = 0.2  # of the blade's travel: an outcrop that moves ahead by less, or back, is taken to stay
_CREEP_STDS = 5.0  # of its own: a handful of increments drift by three at times
_LEAST_CURVED = 6  # increments that tell how it slowed down
_BEGINNING = 8  # increments that tell where a creeping band began


@dataclass(frozen=True, slots=True, eq=False)
class Episode:
    """One band: its rows in the table of increments, and its outcrop at its start.

    The first row is shared with the band before where there is one: the switch lies within it.
    """

    rows: pd.Index
    outcrop_x_mm: float
    outcrop_y_mm: float
    outcrop_std_mm: float
    outcrop_y_std_mm: float = 0.0


def divide(table: pd.DataFrame, *, least_slip_mm: float | None, depth_mm: float) -> list[Episode]:
    """Divide the increments into bands.

    The outcrop of a band stays in the sand, or creeps on steadily; a new band begins where it jumps ahead of
    what the increments before and after foresee together.

    Parameters
    ----------
    table : DataFrame
        u_mm, du_mm, beta_deg, outcrop_x_mm, outcrop_std_mm, outcrop_own_mm (without what two bands at once
        add), outcrop_shared_mm, outcrop_y_mm, slip_mm of each increment.
    least_slip_mm : float or None
        Bands with less slip are dropped; None: 1 % of the depth.
    depth_mm : float
        Of the blade.
    """
    known = table[np.isfinite(table["outcrop_x_mm"])]
    if len(known) == 0:
        return []
    starts = [0, *_jumps(known)]
    parts = [known.index[a:b] for a, b in zip(starts, [*starts[1:], len(known)], strict=True)]
    least = 0.01 * depth_mm if least_slip_mm is None else least_slip_mm
    parts = [p for p in _with_switches(known, parts) if known.loc[p, "slip_mm"].sum() >= least]
    parts = _joined(known, parts)
    return [_episode(known.loc[p], shared=number > 0) for number, p in enumerate(parts)]


def _jumps(known: pd.DataFrame) -> list[int]:
    """Increments with which a new band begins."""
    x, std = known["outcrop_x_mm"].to_numpy(), known["outcrop_own_mm"].to_numpy()
    u = (known["u_mm"] + known["du_mm"] / 2).to_numpy()
    found: list[int] = []
    for k in range(1, len(x)):
        if _jumps_at(x, std, u, found[-1] if found else 0, k):
            found.append(k)
    return found


def _jumps_at(x: Floats, std: Floats, u: Floats, start: int, k: int) -> bool:
    """Whether the outcrop jumps ahead with increment k, in a band from increment start on.

    docs/theory-bands.md, Eq. (19).
    """
    creep = _creep(x, u, k)
    ahead = x - creep * u
    past, future = slice(max(k - _LEVEL, start), k), slice(k, k + _LEVEL)
    before, after = ahead[past], ahead[future]
    jump = float(np.median(after) - np.median(before))
    doubt = float(np.hypot(_doubt(before, std[past]), _doubt(after, std[future])))
    part = _LONE_JUMP if len(after) == 1 else _JUMP
    if jump < max(part * (x[k - 1] - u[k - 1]), _JUMP_STDS * doubt):
        return False
    return bool(ahead[k] - ahead[k - 1] > _STEP * jump)


def _doubt(x: Floats, std: Floats) -> float:
    """Std of the level of a few outcrops: what the better ones state, or how three of them scatter."""
    stated = float(np.mean(np.maximum(std, 1e-6) ** -2.0) ** -0.5)
    scatter = 1.4826 * float(np.median(np.abs(x - np.median(x)))) if len(x) >= _LEVEL else 0.0
    return max(stated, scatter)


def _creep(x: Floats, u: Floats, k: int) -> float:
    """Speed of the outcrop about increment k for the blade's travel: median over both sides, 0 at least."""
    steps = [
        np.diff(x[side]) / np.diff(u[side])
        for side in (slice(max(k - _SIDE, 0), k), slice(k, k + _SIDE))
        if len(x[side]) > 1
    ]
    return max(float(np.median(np.concatenate(steps))), 0.0) if steps else 0.0


def _with_switches(known: pd.DataFrame, parts: list[pd.Index]) -> list[pd.Index]:
    """Give an increment in which one band took over from another to the later one.

    Such an increment holds motion on both, and its line stands between theirs: not a band of its own.
    """
    kept: list[pd.Index] = []
    waiting = parts[0][:0]
    for number, part in enumerate(parts):
        if 0 < number < len(parts) - 1 and len(part) == 1:
            before, here, after = (
                float(known.loc[p, "outcrop_x_mm"].median()) for p in parts[number - 1 :][:3]
            )
            if before < here < after:
                waiting = waiting.append(part)
                continue
        kept.append(waiting.append(part))
        waiting = waiting[:0]
    return kept


def _joined(known: pd.DataFrame, parts: list[pd.Index]) -> list[pd.Index]:
    """Parts of one and the same band, once what stood between them is dropped, put together."""
    joined: list[pd.Index] = []
    for part in parts:
        if joined:
            table = known.loc[joined[-1].append(part)]
            x, std = table["outcrop_x_mm"].to_numpy(), table["outcrop_own_mm"].to_numpy()
            u = (table["u_mm"] + table["du_mm"] / 2).to_numpy()
            # the first increment of a part may be a switch, with its line between two bands'
            if not any(_jumps_at(x, std, u, 0, len(joined[-1]) + k) for k in range(min(2, len(part)))):
                joined[-1] = joined[-1].append(part)
                continue
        joined.append(part)
    return joined


def _episode(rows: pd.DataFrame, *, shared: bool) -> Episode:
    """A band's place at its start: the mean of its increments' outcrops, or where they creep from.

    docs/theory-bands.md, Eq. (20).

    The first increment is left out where it is shared with the band before, if there are others.
    """
    start = float(rows["u_mm"].iloc[0])
    own = rows.iloc[1:] if shared and len(rows) > 1 else rows
    u = (own["u_mm"] + own["du_mm"] / 2).to_numpy()
    std, common = own["outcrop_std_mm"].to_numpy(), own["outcrop_shared_mm"].to_numpy()
    x, x_std = _at_start(u - start, own["outcrop_x_mm"].to_numpy(), std)
    x_std = float(np.hypot(x_std, np.median(common)))
    return Episode(rows.index, x, float(own["outcrop_y_mm"].iloc[0]), x_std)


def _at_start(u: Floats, x: Floats, std: Floats) -> tuple[float, float]:
    """Value at u = 0 of outcrops x at u, and its std; level unless the outcrop clearly creeps ahead."""
    weight = 1 / np.maximum(std, 1e-6) ** 2
    weight = np.minimum(weight, 4 * np.median(weight))
    middle = float(np.median(x))
    scatter = 1.4826 * float(np.median(np.abs(x - middle)))
    kept = np.abs(x - middle) <= np.maximum(4 * np.maximum(scatter, std), 1e-9)
    level = float(np.average(x[kept], weights=weight[kept]))
    level_std = max(float(1 / np.sqrt(weight[kept].sum())), scatter / np.sqrt(len(x)))
    if len(x) < 4:
        return level, level_std
    whole, _ = _polynomial(u, x, weight, 1)
    part = slice(0, _BEGINNING)
    early, early_std = _polynomial(u[part], x[part], weight[part], 1)
    if whole[1] < _CREEP or early[1] < max(_CREEP_STDS * early_std[1], _CREEP):
        return level, level_std
    order = 2 if len(x[part]) >= _LEAST_CURVED else 1  # a creeping outcrop slows down
    fit, fit_std = _polynomial(u[part], x[part], weight[part], order)
    return float(fit[0]), float(fit_std[0])


def _polynomial(u: Floats, x: Floats, weight: Floats, order: int) -> tuple[Floats, Floats]:
    """Weighted polynomial through (u, x): coefficients from the value at 0 upwards, with their stds."""
    design = np.vander(u, order + 1, increasing=True)
    normal = design.T @ (weight[:, None] * design)
    fit = np.linalg.solve(normal, design.T @ (weight * x))
    spread = float(np.sum(weight * (x - design @ fit) ** 2)) / max(len(x) - order - 1, 1)
    std = np.sqrt(np.diag(np.linalg.inv(normal)) * max(spread, 1.0))
    return np.asarray(fit, float), np.asarray(std, float)
