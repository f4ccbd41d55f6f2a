"""Standard uncertainties of force and line of action (JCGM 100:2008, eq. 13 and G.3)."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t as student

from ploughval.axes import BUDGET_COLUMNS

Floats = NDArray[np.float64]
_NORMAL_95 = 1.959964
_SHARE_EXPONENT = 1.75


@dataclass(frozen=True, slots=True)
class Sources:
    """Uncertainties of moments and geometry; covariances are (2, 2) of (upper, lower), (N m)^2."""

    noise_cov: Floats  # random, fresh in every sample
    zero_cov: Floats  # systematic over the test, like all that follow but the variation
    friction_cov: Floats
    friction_dof: float  # degrees of freedom behind friction_cov
    variation_cov: Floats  # of friction along the travel: random, while the blade moves
    gain_relative_std: Floats  # (2,) of the calibration constants
    spacing_mm: float
    spacing_std_mm: float
    lower_to_tip_std_mm: float

    def moment_cov(self, *, moving: bool) -> Floats:
        """Sum of the covariances that do not depend on the load, (2, 2)."""
        still = self.noise_cov + self.zero_cov
        return still + self.friction_cov + self.variation_cov if moving else still


def force_std(cells: Floats, force_N: Floats, moving: NDArray[np.bool_], sources: Sources) -> Floats:
    """Standard uncertainty of the force, N: (N,) from compensated moments (2, N) in N m."""
    per_Nm = 1000.0 / sources.spacing_mm
    gradient = np.array([per_Nm, -per_Nm])
    still, move = (float(gradient @ sources.moment_cov(moving=m) @ gradient) for m in (False, True))
    variance: Floats = np.where(moving, move, still)
    gains: Floats = (sources.gain_relative_std * per_Nm) ** 2
    variance += gains[0] * cells[0] ** 2 + gains[1] * cells[1] ** 2
    variance += (force_N * (sources.spacing_std_mm / sources.spacing_mm)) ** 2
    friction = np.where(moving, float(gradient @ sources.friction_cov @ gradient), 0.0)
    return np.sqrt(variance) * _widening(friction, variance, sources.friction_dof)


def arm_std(cells: Floats, force_N: Floats, moving: NDArray[np.bool_], sources: Sources) -> Floats:
    """Standard uncertainty of the line of action, mm: (N,).

    The arm is written in the two moments, so that what force and arm have in common is counted once:
    arm = lower_to_tip - spacing M_lower / (M_upper - M_lower).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1e6 / (sources.spacing_mm * force_N**2)  # mm / (N m), times a moment
        by_upper, by_lower = cells[1] * scale, -cells[0] * scale
        by_spacing = -1000.0 * cells[1] / (force_N * sources.spacing_mm)

    def load_free(cov: Floats) -> Floats:
        cross = 2 * by_upper * by_lower * cov[0, 1]
        return np.asarray(by_upper**2 * cov[0, 0] + by_lower**2 * cov[1, 1] + cross)

    still, move = sources.moment_cov(moving=False), sources.moment_cov(moving=True)
    variance = np.where(moving, load_free(move), load_free(still))
    gains = sources.gain_relative_std**2
    variance += gains[0] * (by_upper * cells[0]) ** 2 + gains[1] * (by_lower * cells[1]) ** 2
    variance += (by_spacing * sources.spacing_std_mm) ** 2 + sources.lower_to_tip_std_mm**2
    friction = np.where(moving, load_free(sources.friction_cov), 0.0)
    return np.sqrt(np.maximum(variance, 0.0)) * _widening(friction, variance, sources.friction_dof)


def _widening(friction: Floats, variance: Floats, dof: float) -> Floats:
    """What makes 1.96 standard uncertainties hold 95 % although few empty runs know friction's spread poorly.

    Exact with friction alone (Student's over the normal factor) and without friction (1). Between them the
    share of the variance enters with an exponent that draws show to hold 93 to 97 % for any number of runs;
    effective degrees of freedom (Welch-Satterthwaite) fall to 88 % with two.
    """
    if not np.isfinite(dof):
        return np.ones(variance.shape)
    excess = (float(student.ppf(0.975, dof)) / _NORMAL_95) ** 2 - 1
    share = np.divide(friction, variance, out=np.zeros(variance.shape), where=variance > 0)
    return np.asarray(np.sqrt(1 + excess * share**_SHARE_EXPONENT))


def budget_table(
    sources: Sources,
    *,
    mean_cells_Nm: Floats,
    zero_Nm: Floats,
    friction_Nm: Floats | None,
    gain: Floats,
    lower_to_tip_mm: float,
) -> pd.DataFrame:
    """The budget of one sample of the force at the mean load of the test.

    Parameters
    ----------
    sources : Sources
        Everything uncertain.
    mean_cells_Nm : (2,) float, N m
        Mean compensated moments while the blade moves.
    zero_Nm : (2,) float, N m
        The zero offsets taken off.
    friction_Nm : (2,) float, N m, or None
        The friction taken off.
    gain : (2,) float, N m per unit of the log
        The calibration constants.
    lower_to_tip_mm : float
        Height of the lower cell above the tip.

    Returns
    -------
    DataFrame
        BUDGET_COLUMNS: value and std in ``unit``, sensitivity in N per unit, share of the force's variance.
        What the cells have in common is split evenly between them: shares add up to 1 and may be negative.
    """
    per_Nm = 1000.0 / sources.spacing_mm
    gradient = np.array([per_Nm, -per_Nm])
    force = float(gradient @ mean_cells_Nm)
    rows: list[tuple[str, float, float, str, float, float]] = []

    def pair(name: str, values: Floats, cov: Floats) -> None:
        parts = gradient * (cov @ gradient)
        for k, cell in enumerate(("upper", "lower")):
            std = float(np.sqrt(cov[k, k]))
            rows.append(
                (f"{name}, {cell} cell", float(values[k]), std, "N m", float(gradient[k]), float(parts[k]))
            )

    def single(name: str, value: float, std: float, unit: str, slope: float) -> None:
        rows.append((name, value, std, unit, slope, (slope * std) ** 2))

    pair("noise of one sample", np.zeros(2), sources.noise_cov)
    pair("zero offset", zero_Nm, sources.zero_cov)
    if friction_Nm is not None:
        pair("friction", friction_Nm, sources.friction_cov)
        pair("friction along the travel", np.zeros(2), sources.variation_cov)
    for k, cell in enumerate(("upper", "lower")):
        slope = float(gradient[k] * mean_cells_Nm[k] / gain[k])
        std = float(abs(sources.gain_relative_std[k] * gain[k]))
        single(f"calibration, {cell} cell", float(gain[k]), std, "N m/unit", slope)
    single("spacing", sources.spacing_mm, sources.spacing_std_mm, "mm", -force / sources.spacing_mm)
    single("lower_to_tip", lower_to_tip_mm, sources.lower_to_tip_std_mm, "mm", 0.0)
    table = pd.DataFrame(rows, columns=list(BUDGET_COLUMNS))
    total = float(table["share"].sum())
    table["share"] = table["share"] / total if total > 0 else np.nan
    return table
