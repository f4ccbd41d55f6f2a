"""Standard uncertainties of force and line of action (JCGM 100:2008, eq. 13 and G.3)."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t as student

from ploughval.axes import BUDGET_COLUMNS
from ploughval.loadcells.bending import CellGeometry, horizontal_force
from ploughval.loadcells.response import CellResponse

Floats = NDArray[np.float64]
_NORMAL_95 = 1.959964
_CELLS = ("upper", "lower")


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """A source that adds to both moments, whatever the load.

    ``cov`` (2, 2), (N m)^2, of (upper, lower); ``weight`` of it at every row, (N,) or one number; ``value``
    (2,) what was taken off for it, N m; ``dof`` degrees of freedom behind ``cov``.
    """

    name: str
    cov: Floats
    weight: Floats | float
    value: Floats
    dof: float = np.inf


@dataclass(frozen=True, slots=True, eq=False)
class Sources:
    """Everything uncertain about the two moments and what is made of them."""

    terms: tuple[Term, ...]
    response: CellResponse
    geometry: CellGeometry


@dataclass(frozen=True, slots=True, eq=False)
class _Slopes:
    """Derivatives of one result at N rows: by the two moments (2, N), by spacing and by lower_to_tip (N,)."""

    moments: Floats
    spacing: Floats
    lower_to_tip: Floats


def force_std(features: Floats, sources: Sources) -> Floats:
    """Standard uncertainty (N,) of the force, N.

    Parameters
    ----------
    features : (K, N) float
        Features of the readings, friction's taken off: the moments are ``sources.response.coefficients``
        times these.
    sources : Sources
        Everything uncertain.
    """
    return _std(_force_slopes(features, sources), features, sources)


def arm_std(features: Floats, sources: Sources) -> Floats:
    """Standard uncertainty (N,) of the line of action, mm, from features (K, N) as for :func:`force_std`.

    The arm is written in the two moments, so that what force and arm have in common is counted once:
    arm = lower_to_tip - spacing M_lower / (M_upper - M_lower).
    """
    return _std(_arm_slopes(features, sources), features, sources)


def _force_slopes(features: Floats, sources: Sources) -> _Slopes:
    by_moment = sources.geometry.per_Nm * np.array([[1.0], [-1.0]])
    upper, lower = sources.response.coefficients @ features
    explicit = -horizontal_force(upper, lower, sources.geometry.spacing_mm) / sources.geometry.spacing_mm
    return _with_calibration(by_moment, explicit, np.zeros_like(explicit), features, sources)


def _arm_slopes(features: Floats, sources: Sources) -> _Slopes:
    upper, lower = sources.response.coefficients @ features
    difference = upper - lower
    difference[difference == 0] = np.nan
    scale = sources.geometry.spacing_mm / difference**2
    by_moment = np.stack([lower * scale, -upper * scale])
    explicit = -lower / difference
    return _with_calibration(by_moment, explicit, np.ones_like(explicit), features, sources)


def _with_calibration(
    by_moment: Floats, by_spacing: Floats, by_lower: Floats, features: Floats, sources: Sources
) -> _Slopes:
    """Slopes by the geometry with what a calibration from known forces at known arms takes back of them.

    docs/theory-loadcells.md, Eq. (5).
    """
    response = sources.response
    if response.by_spacing.any():
        by_spacing = by_spacing + (by_moment * (response.by_spacing @ features)).sum(axis=0)
    if response.by_lower_to_tip.any():
        by_lower = by_lower + (by_moment * (response.by_lower_to_tip @ features)).sum(axis=0)
    return _Slopes(by_moment, by_spacing, by_lower)


def _quadratic(by_moment: Floats, cov: Floats) -> Floats:
    """h^T cov h at every row, for slopes h (2, N)."""
    first, second = by_moment
    return np.asarray(first**2 * cov[0, 0] + 2 * first * second * cov[0, 1] + second**2 * cov[1, 1])


def _calibration_variance(by_moment: Floats, features: Floats, response: CellResponse) -> Floats:
    """Variance that the coefficients' covariance gives, (N,)."""
    total = np.zeros(features.shape[1])
    for i in range(2):
        for j in range(2):
            block = response.cov[i, :, j, :]
            if block.any():
                total = total + by_moment[i] * by_moment[j] * (features * (block @ features)).sum(axis=0)
    return total * _known_poorly(response.dof)


def _known_poorly(dof: float) -> float:
    """What a variance counts for when it is known with few degrees of freedom: Student's factor, squared."""
    return (float(student.ppf(0.975, dof)) / _NORMAL_95) ** 2 if np.isfinite(dof) else 1.0


def _std(slopes: _Slopes, features: Floats, sources: Sources) -> Floats:
    """Standard uncertainty (N,) of a result with these slopes (docs/theory-loadcells.md, Eq. (4))."""
    geometry = sources.geometry
    variance = _calibration_variance(slopes.moments, features, sources.response)
    variance = variance + (slopes.spacing * geometry.spacing_std_mm) ** 2
    variance += (slopes.lower_to_tip * geometry.lower_to_tip_std_mm) ** 2
    poor = [term for term in sources.terms if np.isfinite(term.dof)]
    for term in sources.terms:
        if term.cov.any():
            variance += _quadratic(slopes.moments, term.cov) * term.weight
    wide = np.ones(variance.shape)
    for term in poor:
        part = np.maximum(_quadratic(slopes.moments, term.cov) * term.weight, 0.0)
        wide *= _widening(np.broadcast_to(part, variance.shape), variance, term.dof)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)) * wide)


def _widening(part: Floats, variance: Floats, dof: float) -> Floats:
    """What makes 1.96 standard uncertainties hold 95 % although few empty runs know friction's spread poorly.

    Exact with that part alone (Student's over the normal factor) and without it (1). Between them its share
    of the variance enters with the exponent 7/4, which draws show to hold 93 to 97 % for any number of runs;
    effective degrees of freedom (Welch-Satterthwaite) fall to 88 % with two, and the sum of a normal and a
    Student's variable (JCGM 101:2008) holds up to 98.7 %.
    """
    excess = _known_poorly(dof) - 1
    share = part / np.maximum(np.maximum(variance, part), np.finfo(float).tiny)  # at most 1 to rounding
    return np.asarray(np.sqrt(1 + excess * share * np.sqrt(share * np.sqrt(share))))  # share^1.75, by roots


def budget_table(features: Floats, sources: Sources) -> pd.DataFrame:
    """The budget of one sample of force and line of action at the mean load of the test.

    Parameters
    ----------
    features : (K, 1) float
        Mean features while the blade moves, friction's taken off.
    sources : Sources
        Everything uncertain; the weight of each term is one number, its mean there.

    Returns
    -------
    DataFrame
        BUDGET_COLUMNS: value and std in ``unit``; sensitivity of the force (N per unit) and share of its
        variance; the same for the line of action (mm per unit), NaN without a load. What the cells have in
        common is split evenly between them: shares add up to 1 and may be negative.
    """
    force = _force_slopes(features, sources)
    arm = _arm_slopes(features, sources)
    rows = [*_term_rows(sources, force, arm), *_calibration_rows(features, sources, force, arm)]
    geometry = sources.geometry
    for name, value, std, place in (
        ("spacing", geometry.spacing_mm, geometry.spacing_std_mm, "spacing"),
        ("lower_to_tip", geometry.lower_to_tip_mm, geometry.lower_to_tip_std_mm, "lower_to_tip"),
    ):
        slopes = [float(getattr(s, place)[0]) for s in (force, arm)]
        rows.append((name, value, std, "mm", *_interleave(slopes, [(slope * std) ** 2 for slope in slopes])))
    table = pd.DataFrame(rows, columns=list(BUDGET_COLUMNS))
    for share in ("share", "arm_share"):
        total = float(table[share].sum(skipna=False))
        table[share] = table[share] / total + 0.0 if total > 0 else np.nan  # + 0: no share of -0
    return table


_Row = tuple[str, float, float, str, float, float, float, float]


def _interleave(slopes: list[float], parts: list[float]) -> tuple[float, float, float, float]:
    """Sensitivity and part of the variance of the force, then of the arm, as the table has them."""
    return slopes[0], parts[0], slopes[1], parts[1]


def _term_rows(sources: Sources, *results: _Slopes) -> list[_Row]:
    rows: list[_Row] = []
    for term in sources.terms:
        if term.weight == 0:
            continue  # it has no part in the load that the table is of
        cov = term.cov * term.weight
        slopes = [result.moments[:, 0] for result in results]
        for k, cell in enumerate(_CELLS):
            std = float(np.sqrt(max(cov[k, k], 0.0)))
            parts = [float(h[k] * (cov[k] @ h)) for h in slopes]
            pair = _interleave([float(h[k]) for h in slopes], parts)
            rows.append((f"{term.name}, {cell} cell", float(term.value[k]), std, "N m", *pair))
    return rows


def _calibration_rows(column: Floats, sources: Sources, *results: _Slopes) -> list[_Row]:
    """One row a coefficient that is there or uncertain."""
    response = sources.response
    cov = response.cov * _known_poorly(response.dof)
    rows: list[_Row] = []
    for i, cell in enumerate(_CELLS):
        for k, powers in enumerate(response.powers):
            std = float(np.sqrt(max(cov[i, k, i, k], 0.0)))
            if response.coefficients[i, k] == 0 and std == 0:
                continue
            lever = [result.moments * column[:, 0] for result in results]  # (2, K) by every coefficient
            slopes = [float(h[i, k]) for h in lever]
            parts = [float(h[i, k] * np.sum(cov[i, k] * h)) for h in lever]
            value = float(response.coefficients[i, k])
            name = _coefficient_name(cell, powers)
            rows.append((name, value, std, _coefficient_unit(powers), *_interleave(slopes, parts)))
    return rows


def _coefficient_name(cell: str, powers: tuple[int, int]) -> str:
    own = powers[_CELLS.index(cell)]
    if sum(powers) > own:
        kind = "cross-talk" if sum(powers) == 1 else "cross-talk of second order"
        return f"{kind}, {cell} moment by the other cell's reading"
    return f"calibration, {cell} cell" if own == 1 else f"second order of the calibration, {cell} cell"


def _coefficient_unit(powers: tuple[int, int]) -> str:
    return "N m/unit" if sum(powers) == 1 else f"N m/unit^{sum(powers)}"
