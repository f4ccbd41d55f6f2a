"""From an even cover of the range to the best of several local searches."""

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import ConvergenceError
from ploughval.model.fit.objective import IMPOSSIBLE, Objective

Floats = NDArray[np.float64]

SAMPLES = 2048  # of the cover
STARTS = 6  # of local searches: the best samples that differ
APART = 0.04  # of the range, between starts
WIDE_TRAVEL = 0.1  # relative price of the stretch while a search is still far away
SCAN_TOLERANCE, NEAR_TOLERANCE = 4e-3, 1e-3
WIDTHS = (0.5, 0.1)  # degrees, of differences: the first search sees past small teeth
EVALUATIONS = 40


def best_unknowns(objective: Objective) -> tuple[Floats, Floats]:
    """The unknowns of least cost at the objective's tolerance, and the ends of all local searches.

    Parameters
    ----------
    objective : Objective
        What is made least.

    Returns
    -------
    best : (V,) float
        All unknowns.
    ends : (S, P) float
        Soil variables at which the searches ended, best first, at a coarser tolerance.

    Raises
    ------
    ConvergenceError
        No sample of the cover can be modelled.
    """
    wide = objective.at(travel_std=max(objective.discrepancy.travel, WIDE_TRAVEL), tolerance=NEAR_TOLERANCE)
    near = objective.at(tolerance=NEAR_TOLERANCE)
    found = []
    for soil in cover(wide.at(tolerance=SCAN_TOLERANCE)):
        unknowns = local_search(wide, wide.start(soil), WIDTHS[0])
        unknowns = local_search(near, unknowns, WIDTHS[0])
        found.append((near.cost(unknowns), unknowns))
    if not found:
        source = objective.space.scene.source
        raise ConvergenceError(f"{source}: no soil in the range searched can be modelled; check [box]")
    found.sort(key=lambda pair: pair[0])
    tried = []
    for cost, unknowns in found[:2]:
        if cost <= 1.5 * found[0][0] + 10.0:
            last = local_search(objective, unknowns, WIDTHS[1])
            tried.append((objective.cost(last), last))
    best = min(tried, key=lambda pair: pair[0])[1]
    return best, np.array([unknowns[: objective.soils] for _, unknowns in found])


def cover(objective: Objective) -> list[Floats]:
    """Best samples of an even cover of the range, different ones, as soil variables."""
    from scipy.stats import qmc  # slow to import, not needed before a fit is asked for

    space = objective.space
    fitted = len(space.fitted)
    unit = qmc.Sobol(fitted, scramble=False).random(SAMPLES)
    low, high = space.low[:fitted], space.high[:fitted]
    samples = low + (high - low) * unit
    if {"peak_friction_deg", "residual_friction_deg"} <= set(space.fitted):
        peak, residual = (space.fitted.index(f"{name}_friction_deg") for name in ("peak", "residual"))
        samples[:, residual] = low[residual] + unit[:, residual] * (samples[:, peak] - low[residual])
    samples = np.column_stack([samples, np.zeros((SAMPLES, objective.soils - fitted))])
    cost = np.array([robust_cost(objective, soil) for soil in samples])
    chosen: list[int] = []
    for k in np.argsort(cost, kind="stable"):
        if len(chosen) == STARTS or cost[k] >= IMPOSSIBLE:
            break
        if all(np.abs(unit[k] - unit[c]).max() > APART for c in chosen):
            chosen.append(int(k))
    return [samples[k] for k in chosen]


def robust_cost(objective: Objective, soil: Floats) -> float:
    """Mean absolute residual of the registered rows, with what the stretch costs added.

    Far from the best fit single rows miss by hundreds of standard deviations: their squares would choose by
    the worst rows alone.
    """
    left = objective.residuals(objective.start(soil))
    rows = len(objective.record.u_mm)
    scale = np.median(np.abs(objective.record.force_N / objective.record.noise_std_N))
    return float(np.mean(np.abs(left[:rows])) + 0.02 * scale * np.mean(np.abs(left[rows:])))


def local_search(
    objective: Objective,
    start: Floats,
    width: float,
    *,
    held: int | None = None,
    limit: int = EVALUATIONS,
    lifted: bool = False,
) -> Floats:
    """Least squares from a start; ``held``: index of an unknown that keeps its value.

    Where the peak or the residual angle is held, the other stays on its side of it, unless a residual angle
    above the peak shall lift it (``lifted``).
    """
    from scipy.optimize import least_squares  # not needed before a fit is asked for

    free = np.array([k for k in range(len(start)) if k != held])
    if not free.size:
        return start
    low, high = (bound[free] for bound in _bounds(objective, start, None if lifted else held))
    span = np.maximum(high - low, 1e-12)

    def whole(share: Floats) -> Floats:
        unknowns = start.copy()
        unknowns[free] = low + span * share
        return unknowns

    # shares of the range: the first trust region is as wide as the start is far from 0
    found = least_squares(
        lambda share: objective.residuals(whole(share)),
        np.clip((start[free] - low) / span, 1e-9, 1.0 - 1e-9),
        jac=lambda share: objective.jacobian(whole(share), width)[:, free] * span,
        bounds=(0.0, 1.0),
        ftol=1e-7,
        xtol=1e-9,
        gtol=1e-8,
        max_nfev=limit,
    )
    return whole(np.asarray(found.x))


def _bounds(objective: Objective, start: Floats, held: int | None) -> tuple[Floats, Floats]:
    """Bounds of all unknowns; where peak or residual angle is held, the other stays on its side of it."""
    low, high = objective.bounds(start)
    names = objective.space.fitted
    pair = [f"{name}_friction_deg" for name in ("peak", "residual")]
    if held is not None and set(pair) <= set(names):
        peak, residual = (names.index(name) for name in pair)
        if held == peak:
            high[residual] = max(start[peak], low[residual] + 1e-6)
        elif held == residual:
            low[peak] = min(start[residual], high[peak] - 1e-6)
    return low, high
