"""Bands as intervals of activity: one outcrop follows the other when it jumps ahead."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ploughval.tracers.view import Floats

_JUMP = 0.12  # of the outcrop's distance from the tip: the least jump of a new band
_JUMP_STDS = 4.0
_CREEP = 0.2  # of the blade's travel: an outcrop that moves ahead by less, or back, is taken to stay
_MEMORY = 6  # increments from which the next outcrop is foreseen


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

    The outcrop of a band stays in the sand, or creeps on steadily; a new band begins where it
    jumps ahead of what the increments before foresee and the next increment agrees.

    Parameters
    ----------
    table : DataFrame
        u_mm, du_mm, beta_deg, outcrop_x_mm, outcrop_std_mm, outcrop_y_mm, slip_mm of each increment.
    least_slip_mm : float or None
        Bands with less slip are dropped; None: 1 % of the depth.
    depth_mm : float
        Of the blade.
    """
    known = table[np.isfinite(table["outcrop_x_mm"])]
    if len(known) == 0:
        return []
    x, std = known["outcrop_x_mm"].to_numpy(), known["outcrop_std_mm"].to_numpy()
    u = (known["u_mm"] + known["du_mm"] / 2).to_numpy()
    starts = [0]
    for k in range(1, len(x)):
        if _jumps(x, std, u, starts[-1], k):
            starts.append(k)
    least = 0.01 * depth_mm if least_slip_mm is None else least_slip_mm
    parts = [known.index[a:b] for a, b in zip(starts, [*starts[1:], len(x)], strict=True)]
    parts = _joined(
        known, [p for p in _with_switches(known, parts) if known.loc[p, "slip_mm"].sum() >= least]
    )
    return [_episode(known.loc[p], shared=number > 0) for number, p in enumerate(parts)]


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


def _jumps(x: Floats, std: Floats, u: Floats, start: int, k: int) -> bool:
    """Whether a new band begins with increment k, in a band that began with increment start."""
    foreseen, doubt = _foresee(x, u, start, k)
    least = _JUMP * max(x[k - 1] - u[k - 1], 0.0)

    def ahead(j: int) -> bool:
        return bool(x[j] - foreseen > max(least, _JUMP_STDS * np.hypot(doubt, std[j])))

    return ahead(k) and (k + 1 >= len(x) or ahead(k + 1))


def _foresee(x: Floats, u: Floats, start: int, k: int) -> tuple[float, float]:
    """Outcrop expected at increment k from the last ones of its band, and its doubt."""
    past = slice(max(start, k - _MEMORY), k)
    xs, us = x[past], u[past]
    if len(xs) < 3:
        return float(np.median(xs)), 0.0
    i, j = np.triu_indices(len(xs), 1)
    slope = max(float(np.median((xs[j] - xs[i]) / (us[j] - us[i]))), 0.0)
    rest = xs - slope * us
    doubt = 1.4826 * float(np.median(np.abs(rest - np.median(rest))))
    return float(np.median(rest) + slope * u[k]), doubt


def _joined(known: pd.DataFrame, parts: list[pd.Index]) -> list[pd.Index]:
    """Parts of one and the same band, once what stood between them is dropped, put together."""
    joined: list[pd.Index] = []
    for part in parts:
        if joined:
            before, after = known.loc[joined[-1]], known.loc[part]
            x = np.concatenate([before["outcrop_x_mm"].to_numpy(), after["outcrop_x_mm"].to_numpy()[:1]])
            tables = pd.concat([before, after.iloc[:1]])
            u = (tables["u_mm"] + tables["du_mm"] / 2).to_numpy()
            if not _jumps(x, tables["outcrop_std_mm"].to_numpy(), u, 0, len(x) - 1):
                joined[-1] = joined[-1].append(part)
                continue
        joined.append(part)
    return joined


def _episode(rows: pd.DataFrame, *, shared: bool) -> Episode:
    """A band's place at its start: a straight line through the outcrops of its increments.

    The first increment is left out where it is shared with the band before, if there are others.
    """
    start = float(rows["u_mm"].iloc[0])
    own = rows.iloc[1:] if shared and len(rows) > 1 else rows
    u = (own["u_mm"] + own["du_mm"] / 2).to_numpy()
    x, x_std = _at_start(u - start, own["outcrop_x_mm"].to_numpy(), own["outcrop_std_mm"].to_numpy())
    return Episode(rows.index, x, float(own["outcrop_y_mm"].iloc[0]), x_std)


def _at_start(u: Floats, x: Floats, std: Floats) -> tuple[float, float]:
    """Value at u = 0 of a line through (u, x), and its std; level unless the outcrop clearly creeps ahead."""
    weight = 1 / np.maximum(std, 1e-6) ** 2
    weight = np.minimum(weight, 4 * np.median(weight))
    off = np.abs(x - np.median(x))
    level = float(np.average(x, weights=weight))
    scatter = 1.4826 * float(np.median(off))
    level_std = max(float(1 / np.sqrt(weight.sum())), scatter / np.sqrt(len(x)))
    if len(x) < 4:
        return level, level_std
    design = np.column_stack([np.ones(len(u)), u])
    normal = design.T @ (weight[:, None] * design)
    fit = np.linalg.solve(normal, design.T @ (weight * x))
    spread = max(float(np.sum(weight * (x - design @ fit) ** 2)) / (len(x) - 2), 1e-12)
    fit_std = np.sqrt(np.diag(np.linalg.inv(normal)) * max(spread, 1.0))
    if fit[1] < max(3 * fit_std[1], _CREEP):
        return level, level_std
    return float(fit[0]), float(fit_std[0])
