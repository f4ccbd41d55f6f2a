"""Two bending moments to a horizontal force and its line of action (statics of the blade's stem)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CellGeometry:
    """Where the two cells are.

    Attributes
    ----------
    spacing_mm : float, mm
        Distance between the cells.
    lower_to_tip_mm : float, mm
        Height of the lower cell above the blade's tip.
    spacing_std_mm, lower_to_tip_std_mm : float, mm
        Their standard uncertainties.
    """

    spacing_mm: float
    lower_to_tip_mm: float
    spacing_std_mm: float = 0.0
    lower_to_tip_std_mm: float = 0.0

    @property
    def per_Nm(self) -> float:
        """Force (N) for a difference of the two moments of 1 N m."""
        return 1000.0 / self.spacing_mm


def horizontal_force(upper_Nm: Floats, lower_Nm: Floats, spacing_mm: float) -> Floats:
    """Horizontal resultant below both cells, F = (M_upper - M_lower) / spacing.

    docs/theory-loadcells.md, Eq. (1).

    Parameters
    ----------
    upper_Nm, lower_Nm : (N,) float64, N m
        Bending moments at the two cells.
    spacing_mm : float, mm
        Distance between them.

    Returns
    -------
    (N,) float64, N

    >>> float(horizontal_force(np.array([8.0]), np.array([5.0]), 125.0)[0])
    24.0
    """
    return (upper_Nm - lower_Nm) * (1000.0 / spacing_mm)


def line_of_action(lower_Nm: Floats, force_N: Floats, lower_to_tip_mm: float) -> Floats:
    """Height of the resultant above the tip, lower_to_tip - M_lower / F.

    docs/theory-loadcells.md, Eq. (1).

    Parameters
    ----------
    lower_Nm : (N,) float64, N m
        Bending moment at the lower cell.
    force_N : (N,) float64, N
        Horizontal resultant.
    lower_to_tip_mm : float, mm
        Height of the lower cell above the tip.

    Returns
    -------
    (N,) float64, mm
        NaN where the force is zero.

    >>> float(line_of_action(np.array([5.0]), np.array([20.0]), 260.0)[0])
    10.0
    """
    lever_mm = np.full(np.broadcast_shapes(lower_Nm.shape, force_N.shape), np.nan)
    np.divide(1000.0 * lower_Nm, force_N, out=lever_mm, where=force_N != 0)
    return lower_to_tip_mm - lever_mm


def moments(
    force_N: Floats, arm_mm: Floats, spacing_mm: float, lower_to_tip_mm: float
) -> tuple[Floats, Floats]:
    """The inverse: upper and lower bending moment (N m) of a force at a height above the tip."""
    lower = force_N * (lower_to_tip_mm - arm_mm) * 1e-3
    return lower + force_N * spacing_mm * 1e-3, lower
