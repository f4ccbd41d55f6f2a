"""Readings of two cells to force, line of action and their standard uncertainties: arrays in, arrays out."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.loadcells.bending import CellGeometry, horizontal_force, line_of_action
from ploughval.loadcells.budget import Sources, Term, arm_std, budget_table, force_std
from ploughval.loadcells.drift import ZeroLine
from ploughval.loadcells.friction import Friction
from ploughval.loadcells.response import CellResponse

Floats = NDArray[np.float64]
ARM_LIMIT = 5.0
"""Forces below this many standard uncertainties have no line of action."""
_ROUNDING = 1e-9  # nor have those below this share of the largest, where nothing else is uncertain


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """The two cells.

    Attributes
    ----------
    geometry : CellGeometry
        Where they are.
    response : CellResponse
        What their readings mean.
    noise_cov : (2, 2) float64, unit of the log squared
        Covariance of one sample's (upper, lower) reading.
    """

    geometry: CellGeometry
    response: CellResponse
    noise_cov: Floats


@dataclass(frozen=True, slots=True, eq=False)
class ForceArrays:
    """Result of :func:`force_from_readings`; NaN where a reading was.

    Attributes
    ----------
    force_N, force_std_N : (N,) float64, N
        Horizontal resultant with friction taken off, and its standard uncertainty.
    arm_mm, arm_std_mm : (N,) float64, mm
        Height of its line of action above the tip, and its standard uncertainty.
    raw_N : (N,) float64, N
        The resultant with the friction in it.
    friction_N : (N,) float64, N
        What was taken off; NaN without empty runs.
    small : (N,) bool
        Rows whose force is too small for a line of action.
    features, sources : (K, N) float64, Sources
        What the uncertainty of the force comes from, with friction taken off.
    arm_features, arm_sources : (K, N) float64, Sources
        The same of the line of action; other ones only where friction is taken off the force alone.
    """

    force_N: Floats
    force_std_N: Floats
    arm_mm: Floats
    arm_std_mm: Floats
    raw_N: Floats
    friction_N: Floats
    small: NDArray[np.bool_]
    features: Floats
    sources: Sources
    arm_features: Floats
    arm_sources: Sources


def force_from_readings(
    readings: Floats,
    rig: Rig,
    zero: ZeroLine,
    *,
    moving: NDArray[np.bool_] | Floats,
    friction: Friction | None = None,
    friction_at: Floats | None = None,
    more: tuple[Term, ...] = (),
    per_cell: bool = True,
) -> ForceArrays:
    """Force and line of action of a record.

    Parameters
    ----------
    readings : (2, N) float, unit of the log
        Upper and lower cell, in the log's unit; NaN where not measured.
    rig : Rig
        The two cells.
    zero : ZeroLine
        Offsets to be taken off.
    moving : (N,) bool or float
        Rows in which friction acts; of smoothed readings the share of it, smoothed alike.
    friction : Friction or None
        From empty runs; None: nothing is taken off.
    friction_at : (N,) float or None, mm
        Travel at which friction is read; None: the mean is taken everywhere.
    more : tuple of Term
        Further sources of uncertainty.
    per_cell : bool
        Whether friction is taken off each cell. Otherwise off the force alone (Kashizadeh et al., 2014),
        and the line of action is that of sand and friction together.

    Returns
    -------
    ForceArrays
    """
    geometry, response = rig.geometry, rig.response
    share = np.asarray(moving, np.float64)
    raw = response.features(readings - zero.offset)
    raw_N = _resultant(response.coefficients @ raw, geometry)
    net, friction_N = raw, np.full(raw_N.shape, np.nan)
    if friction is not None:
        taken = (friction.mean if friction_at is None else friction.at(friction_at)) * share
        net, friction_N = raw - taken, _resultant(response.coefficients @ taken, geometry)
        del taken  # of a log of hours each array counts
    slope = response.slopes(_mean_reading(readings - zero.offset, share > 0.5))
    always = _always(rig, zero, slope) + more
    sources = Sources(always + _friction_terms(friction, share, response), response, geometry)
    force_cells = response.coefficients @ net
    force_N = _resultant(force_cells, geometry)
    arm = (net, sources) if per_cell else (raw, Sources(always, response, geometry))
    arm_force = force_N if per_cell else raw_N
    arm_lower = (force_cells if per_cell else response.coefficients @ raw)[1]
    arm_mm = line_of_action(arm_lower, arm_force, geometry.lower_to_tip_mm)
    del raw, force_cells, arm_lower
    std_N = force_std(net, sources)
    arm_mm_std = arm_std(*arm)
    small = _small(arm_force, std_N)
    arm_mm[small] = arm_mm_std[small] = std_N[~np.isfinite(force_N)] = np.nan
    return ForceArrays(force_N, std_N, arm_mm, arm_mm_std, raw_N, friction_N, small, net, sources, *arm)


@dataclass(frozen=True, slots=True, eq=False)
class MeanSample:
    """One sample at the mean load of some rows.

    Features (K, 1) and sources, the weight of each term being one number, of the force and of the line of
    action as in :class:`ForceArrays`; ``loaded``: whether there was any such row.
    """

    features: Floats
    sources: Sources
    arm_features: Floats
    arm_sources: Sources
    loaded: bool


@dataclass(frozen=True, slots=True)
class MeanLoad:
    """Force, N, and line of action, mm, at the mean load, with the standard uncertainty of one sample there.

    NaN where there is no load, and for a line of action of which the force is too small.
    """

    force_N: float
    force_std_N: float
    arm_mm: float
    arm_std_mm: float


def mean_sample(found: ForceArrays, loaded: NDArray[np.bool_]) -> MeanSample:
    """One sample at the mean load of the rows ``loaded`` (N,)."""
    force = arm = _at_mean(found.features, found.sources, loaded)
    if found.arm_sources is not found.sources:
        arm = _at_mean(found.arm_features, found.arm_sources, loaded)
    return MeanSample(*force, *arm, loaded=bool(loaded.any()))


def mean_budget(mean: MeanSample) -> pd.DataFrame:
    """Budget of one sample at the mean load: see :func:`budget_table`."""
    table = budget_table(mean.features, mean.sources)
    if mean.arm_sources is not mean.sources:
        arm = ["sensitivity_mm", "arm_share"]
        own = budget_table(mean.arm_features, mean.arm_sources).set_index("source")[arm]
        table[arm] = own.reindex(table["source"], fill_value=0.0).to_numpy()
    return table


def mean_load(mean: MeanSample) -> MeanLoad:
    """What the budget of :func:`mean_budget` adds up to."""
    if not mean.loaded:
        return MeanLoad(np.nan, np.nan, np.nan, np.nan)
    geometry = mean.sources.geometry
    force = float(_resultant(mean.sources.response.coefficients @ mean.features, geometry)[0])
    std = float(force_std(mean.features, mean.sources)[0])
    cells = mean.arm_sources.response.coefficients @ mean.arm_features
    acting = _resultant(cells, geometry)
    if _small(acting, np.array([std]))[0]:
        return MeanLoad(force, std, np.nan, np.nan)
    arm = line_of_action(cells[1], acting, geometry.lower_to_tip_mm)
    return MeanLoad(force, std, float(arm[0]), float(arm_std(mean.arm_features, mean.arm_sources)[0]))


def _at_mean(features: Floats, sources: Sources, loaded: NDArray[np.bool_]) -> tuple[Floats, Sources]:
    """Mean features (K, 1) of some rows, zero without any, and the sources with their mean weights there."""
    some = bool(loaded.any())
    mean = features.mean(axis=1, where=loaded) if some else np.zeros(features.shape[0])
    terms = tuple(
        replace(term, weight=_mean_weight(term, loaded if some else ~loaded)) for term in sources.terms
    )
    return mean[:, None], replace(sources, terms=terms)


def _mean_weight(term: Term, rows: NDArray[np.bool_]) -> float:
    """Mean weight of a term over some rows (N,); 0 in an empty record."""
    weight = np.asarray(term.weight, float)
    if weight.size == 0:
        return 0.0
    return float(weight.mean(where=rows) if weight.ndim else weight)


def _resultant(cells: Floats, geometry: CellGeometry) -> Floats:
    """Force (N,) of moments (2, N)."""
    return horizontal_force(cells[0], cells[1], geometry.spacing_mm)


def _small(force_N: Floats, std_N: Floats) -> NDArray[np.bool_]:
    """Rows (N,) whose force is too small, or missing, for a line of action."""
    size = np.abs(force_N)
    rounding = _ROUNDING * float(np.nanmax(size, initial=0.0))
    return np.asarray(~((size >= ARM_LIMIT * std_N) & (size > rounding)))


def _mean_reading(readings: Floats, moving: NDArray[np.bool_]) -> Floats:
    """Mean reading (2,) while the blade moves; 0 where there is none."""
    some = moving & np.isfinite(readings).all(axis=0)
    return np.asarray(readings.mean(axis=1, where=some)) if some.any() else np.zeros(2)


def _always(rig: Rig, zero: ZeroLine, slope: Floats) -> tuple[Term, ...]:
    """Noise and zeros."""
    noise = Term("noise of one sample", slope @ rig.noise_cov @ slope.T, 1.0, np.zeros(2))
    parts = [
        Term(name, slope @ cov @ slope.T, weight, slope @ value) for name, cov, weight, value in zero.parts
    ]
    return (noise, *parts)


def _friction_terms(friction: Friction | None, share: Floats, response: CellResponse) -> tuple[Term, ...]:
    if friction is None:
        return ()
    while_moving = share**2
    level = response.coefficients @ friction.features.mean(axis=1)
    return (
        Term("friction", friction.cov, while_moving, level, friction.dof),
        Term("friction along the travel", friction.variation_cov, while_moving, np.zeros(2)),
    )
