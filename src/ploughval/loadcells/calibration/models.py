"""Models of what a reading of the two cells means, from one constant a cell to cross-talk of second order."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.response import CURVED, OWN, Powers

Floats = NDArray[np.float64]
CONDITION_LIMIT = 200.0
"""Loads are too much alike at both cells to tell cross-talk beyond this condition number."""
_LEAST_LEVELS = 4  # different moments (zero included) for a second order


@dataclass(frozen=True, slots=True)
class Model:
    """Which features of the readings each moment is built from.

    Attributes
    ----------
    name : str
        For tables and messages.
    powers : tuple of (int, int)
        Exponents of the (upper, lower) reading in the features.
    active : tuple of two tuples of int
        Places in ``powers`` that the upper and the lower moment use.
    """

    name: str
    powers: Powers
    active: tuple[tuple[int, ...], tuple[int, ...]]

    @property
    def curved(self) -> bool:
        """Whether a square takes part."""
        return len(self.powers) > len(OWN)

    @property
    def crossed(self) -> bool:
        """Whether a moment uses the other cell's reading."""
        return 1 in self.active[0]

    def why_not(self, moments: Floats, runs: int, condition: float) -> str:
        """Why loads (2, N), N m, in so many runs cannot carry the model; empty where they can."""
        if self.curved and min(levels(m) for m in moments) < _LEAST_LEVELS:
            return f"fewer than {_LEAST_LEVELS} different moments"
        if self.crossed and not condition <= CONDITION_LIMIT:
            return f"arms too much alike (condition number {condition:.3g}, limit {CONDITION_LIMIT:g})"
        if moments.shape[1] <= len(self.active[0]) + runs:
            return "no more rows than parameters"
        return ""


MODELS = (
    Model("straight", OWN, ((0,), (1,))),
    Model("second order", CURVED, ((0, 2), (1, 3))),
    Model("cross-talk", OWN, ((0, 1), (0, 1))),
    Model("cross-talk and second order", CURVED, ((0, 1, 2), (0, 1, 3))),
)


def levels(moments: Floats) -> int:
    """Number of moments (N,) that differ by more than a thousandth of the largest."""
    ordered = np.sort(moments)
    return 1 + int((np.diff(ordered) > 1e-3 * float(np.abs(moments).max(initial=0.0))).sum())


def condition_number(moments: Floats) -> float:
    """Condition number of the loads (2, N) as seen by both cells, each cell scaled to unit length.

    Loads at a single arm are in one proportion at both cells: infinite.

    >>> round(condition_number(np.array([[1.0, 0.0], [0.0, 1.0]])), 6)
    1.0
    >>> condition_number(np.array([[1.0, 2.0], [3.0, 6.0]]))
    inf
    """
    length = np.sqrt((moments**2).sum(axis=1, keepdims=True))
    if not (length > 0).all():
        return float("inf")
    values = np.linalg.svd(moments / length, compute_uv=False)
    small = values.size < 2 or values[1] < 1e-9 * values[0]
    return float("inf") if small else float(values[0] / values[1])
