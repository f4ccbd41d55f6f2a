"""The cost over two parameters at a time: one valley, or many?"""

from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.model.fit.objective import Objective
from ploughval.model.fit.result import LANDSCAPE_COLUMNS
from ploughval.model.fit.variables import in_units

Floats = NDArray[np.float64]

SIDE = 25  # samples of a map along either parameter
TOLERANCE = 2e-3
SPANS = {True: 8.0, False: 0.7}  # of a map to either side: degrees, or of a logarithm
MAPS = 3  # at most


def landscape(objective: Objective, best: Floats) -> pd.DataFrame:
    """Maps of the cost around the best fit over pairs of parameters, the others as they are there.

    Parameters
    ----------
    objective : Objective
        What is made least.
    best : (V,) float
        Its unknowns of least cost.

    Returns
    -------
    DataFrame
        LANDSCAPE_COLUMNS: names of the pair, their values in their units, and the rise of the cost. Switches
        of the record are laid on those of the model at each node.
    """
    coarse, names = objective.at(tolerance=TOLERANCE), objective.space.fitted
    tables = []
    for first, second in list(combinations(range(len(names)), 2))[:MAPS]:
        axes = [_axis(objective, best, k) for k in (first, second)]
        grid = np.array([[_cost(coarse, best, (first, second), (x, y)) for x in axes[0]] for y in axes[1]])
        values = [
            [in_units(names[k], v) for v in axis] for k, axis in zip((first, second), axes, strict=True)
        ]
        x, y = np.meshgrid(*values)
        grid[_above_peak(names[first], names[second], x, y)] = np.nan
        columns = (f"{names[first]} x {names[second]}", x.ravel(), y.ravel(), grid.ravel() - np.nanmin(grid))
        tables.append(pd.DataFrame(dict(zip(LANDSCAPE_COLUMNS, columns, strict=True))))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=list(LANDSCAPE_COLUMNS))


def _above_peak(first: str, second: str, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """Nodes at which the residual angle is above the peak: there is no such soil."""
    pair = {first: x, second: y}
    if set(pair) != {"peak_friction_deg", "residual_friction_deg"}:
        return np.zeros(x.shape, bool)
    return np.asarray(pair["residual_friction_deg"] > pair["peak_friction_deg"])


def _axis(objective: Objective, best: Floats, index: int) -> Floats:
    span = SPANS[objective.space.angles[index]]
    low, high = objective.space.low[index], objective.space.high[index]
    return np.linspace(max(low, best[index] - span), min(high, best[index] + span), SIDE)


def _moved(best: Floats, indices: tuple[int, ...], values: tuple[float, ...]) -> Floats:
    moved = best.copy()
    moved[list(indices)] = values
    return moved


def _cost(objective: Objective, best: Floats, indices: tuple[int, int], values: tuple[float, float]) -> float:
    """Cost at a node: shared errors as at the best fit, switches where the record shows them."""
    moved = _moved(best, indices, values)
    moved[objective.switches] = objective.start(moved[: objective.soils])[objective.switches]
    return objective.cost(moved)
