"""The fit of soil parameters to a force history: search, weights, polish, intervals, words."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ploughval.model.fit.information import Information, information
from ploughval.model.fit.intervals import (
    PROFILE_TOLERANCE,
    WIDTH,
    Profile,
    profile,
    quantiles,
)
from ploughval.model.fit.landscape import landscape
from ploughval.model.fit.objective import Discrepancy, Objective, SharedErrors, objective_of
from ploughval.model.fit.record import read_record
from ploughval.model.fit.remarks import remarks_on
from ploughval.model.fit.result import (
    CURVE_COLUMNS,
    LANDSCAPE_COLUMNS,
    PROFILE_COLUMNS,
    SWITCH_COLUMNS,
    Shift,
    SoilFit,
)
from ploughval.model.fit.sampler import sample, sampler
from ploughval.model.fit.search import best_unknowns, local_search
from ploughval.model.fit.variables import PARAMETERS, Space, in_units, space_of
from ploughval.model.fit.weights import Misfit, loosened, misfit_of
from ploughval.scene import Scene
from ploughval.watch import Progress, one_step, unheard

Floats = NDArray[np.float64]

FINE_TOLERANCE = 1e-4
ROUNDS = 2  # of intervals, where the first finds a better fit on its way
BETTER = 0.5  # of the cost: what counts as better
SOFTENING_SEEN = 9.0  # of the cost: three standard deviations


@dataclass(frozen=True, slots=True)
class Extras:
    """What a fit gives beside values and intervals.

    Attributes
    ----------
    maps : bool
        The cost over pairs of parameters.
    samples : int
        Steps of each of 32 walkers of a sampler (extra ``bayes``); 0: none.
    progress : callable
        Hears of (stage, done, total).
    """

    maps: bool = False
    samples: int = 0
    progress: Progress = unheard


def fit_soil(
    u_mm: ArrayLike,
    force_N: ArrayLike,
    noise_std_N: ArrayLike,
    scene: Scene,
    *,
    parameters: Sequence[str] = PARAMETERS,
    shared: SharedErrors | None = None,
    discrepancy: Discrepancy | None = None,
    extras: Extras | None = None,
) -> SoilFit:
    """Fit soil parameters to a measured force history, with intervals (docs/theory-fit.md).

    Parameters
    ----------
    u_mm, force_N : (N,) float
        Displacement and horizontal force for the blade's width; rows that are not finite or before u = 0
        are left out.
    noise_std_N : float or (N,) float, N
        Standard uncertainty of the force that is fresh in every row; where it is not positive, the median of
        the others.
    scene : Scene
        The test; parameters that are not fitted keep the values of its [soil], within their standard
        uncertainties, as does the depth.
    parameters : sequence of str
        Numerical fields of [soil].
    shared : SharedErrors or None
        Errors that move all rows together.
    discrepancy : Discrepancy or None
        How far the model may be from the sand; None: 3 % of the length of a tooth and 1 % of the force.
    extras : Extras or None
        What is wanted beside values and intervals; None: nothing.

    Returns
    -------
    SoilFit
        Best values, intervals, and what the record determines.

    Raises
    ------
    ConfigError
        Unknown parameters, or no [soil].
    DataError
        Fewer usable rows than parameters.
    ConvergenceError
        No sample of the cover can be modelled.
    MissingExtraError
        Samples are wanted and emcee is not installed.
    """
    space, shared, extras = space_of(scene, parameters), shared or SharedErrors(), extras or Extras()
    if extras.samples:
        sampler()  # what is missing is said now, not after the search
    record = read_record(
        u_mm,
        force_N,
        noise_std_N,
        scene.blade.depth_mm,
        least=len(space.low),
        start_std_mm=shared.start_mm,
    )
    allowed = discrepancy or Discrepancy()
    objective = objective_of(space, record, shared, allowed, PROFILE_TOLERANCE)
    with one_step(extras.progress, "search"):
        best, _ = best_unknowns(objective)
    objective, best, misfit = _loosened(objective, best)
    flat = _no_softening(objective, best)
    best, told, profiles = _profiled(objective, best, misfit, extras.progress)
    fine = local_search(objective.at(tolerance=FINE_TOLERANCE), best, WIDTH, limit=8)
    found = _result(objective, (best, fine), told, profiles, misfit)
    found = _without_length(found) if flat else found
    found = replace(found, remarks=remarks_on(found, objective, told, flat=flat, allowed=allowed))
    return _with_extras(found, objective, best, extras)


def _loosened(objective: Objective, best: Floats) -> tuple[Objective, Floats, Misfit]:
    """The cost with errors as large as the record shows them to be, and its best unknowns."""
    looser = loosened(objective, best)
    if looser is not objective:
        objective = looser
        best = local_search(objective, best, WIDTH)
    misfit = _misfit(objective, best)
    if misfit.inflation > 1.0:
        objective = objective.inflated(misfit.inflation)
        best = local_search(objective, best, WIDTH)
    return objective, best, misfit


def _profiled(
    objective: Objective, best: Floats, misfit: Misfit, progress: Progress
) -> tuple[Floats, Information, tuple[Profile, ...]]:
    """Profiles about the best unknowns; where one runs into something better, about that, some times."""
    told = information(objective, best, WIDTH)
    profiles = _profiles(objective, best, told, misfit, progress)
    for _ in range(ROUNDS - 1):
        lowest = min(profiles, key=lambda p: float(p.rises.min()))
        if lowest.rises.min() > -BETTER:
            break
        best = local_search(objective, lowest.unknowns[int(np.argmin(lowest.rises))], WIDTH)
        told = information(objective, best, WIDTH)
        profiles = _profiles(objective, best, told, misfit, progress)
    return best, told, profiles


def _with_extras(found: SoilFit, objective: Objective, best: Floats, extras: Extras) -> SoilFit:
    """The fit with maps and samples, where they are wanted."""
    if extras.maps:
        with one_step(extras.progress, "maps of the cost"):
            found = replace(found, landscape=landscape(objective, best))
    if extras.samples:
        posterior = sample(objective, best, steps=extras.samples, progress=extras.progress)
        found = replace(found, posterior=posterior)
    return found


def _misfit(objective: Objective, best: Floats) -> Misfit:
    rows = len(objective.record.u_mm)
    return misfit_of(objective.residuals(best)[:rows], len(best))


def _no_softening(objective: Objective, best: Floats) -> bool:
    """Whether a fit whose residual angle is the peak does as well: softening is not seen at all then."""
    names = objective.space.fitted
    if not set(PARAMETERS) <= set(names):
        return False
    peak, residual = (names.index(f"{name}_friction_deg") for name in ("peak", "residual"))
    level, costs = best.copy(), []
    angles = np.linspace(best[residual], best[peak], 7)
    for angle in angles:
        level[[peak, residual]] = angle
        costs.append(objective.cost(level))
    level[peak] = objective.space.low[peak]  # the residual angle lifts it
    level[residual] = angles[int(np.argmin(costs))]
    level = local_search(objective, level, WIDTH, held=peak, lifted=True)
    return objective.cost(level) <= objective.cost(best) + SOFTENING_SEEN


def _rises(misfit: Misfit, best: Floats) -> dict[float, float]:
    return quantiles(max(misfit.independent - len(best), 1.0))


def _profiles(
    objective: Objective, best: Floats, told: Information, misfit: Misfit, progress: Progress
) -> tuple[Profile, ...]:
    rises = _rises(misfit, best)
    span = objective.space.high - objective.space.low
    found: list[Profile] = []
    progress("intervals", 0, len(objective.space.fitted))
    for k in range(len(objective.space.fitted)):
        std = told.std[k] if np.isfinite(told.std[k]) else 0.1 * span[k]
        found.append(profile(objective, best, k, float(np.clip(std, 1e-5 * span[k], 0.2 * span[k])), rises))
        progress("intervals", len(found), len(objective.space.fitted))
    return tuple(found)


def _limits(
    space: Space, profiles: tuple[Profile, ...], level: float, moved: tuple[Floats, Floats]
) -> Floats:
    """Limits in the parameters' units, moved with the best fit from one tolerance of the model to a finer."""
    best, fine = moved
    limits = np.full((len(profiles), 2), np.inf)
    for k, found in enumerate(profiles):
        shift = fine[k] - best[k]
        for side, sign in enumerate((-1.0, 1.0)):
            limit = found.limits[level][side]
            limits[k, side] = sign * np.inf
            if np.isfinite(limit):
                # the rest of the model's error is as large as what the finer run took away
                reach = np.hypot(limit - best[k], shift)
                limits[k, side] = in_units(space.fitted[k], fine[k] + sign * reach)
    return limits


def _result(
    objective: Objective,
    solved: tuple[Floats, Floats],
    told: Information,
    profiles: tuple[Profile, ...],
    misfit: Misfit,
) -> SoilFit:
    """Everything but the remarks."""
    space, (best, fine) = objective.space, solved
    names = space.fitted
    physical = space.physical(fine[: objective.soils])
    inner, outer = (_limits(space, profiles, level, (best, fine)) for level in (0.68, 0.95))
    std = np.where(np.isfinite(inner).all(axis=1), 0.5 * (inner[:, 1] - inner[:, 0]), np.inf)
    curve = objective.at(tolerance=FINE_TOLERANCE).curve(fine)
    record = objective.record
    rows = (record.u_mm, record.force_N, record.noise_std_N, curve)
    return SoilFit(
        parameters=names,
        values=np.array([physical[name] for name in names]),
        std=std,
        covariance=_covariance(std, told.correlation),
        interval_68=inner,
        interval_95=outer,
        told_by=tuple(told.told_by(name) for name in names),
        information=told,
        shifts=_shifts(objective, fine),
        switches=_switches(objective, fine),
        curve=pd.DataFrame(dict(zip(CURVE_COLUMNS, rows, strict=True))),
        profiles=_profile_table(profiles),
        landscape=pd.DataFrame(columns=list(LANDSCAPE_COLUMNS)),
        rises=_rises(misfit, best),
        misfit=misfit,
        discrepancy=objective.discrepancy,
        residual_rms_N=float(np.sqrt(np.mean((curve - record.force_N) ** 2))),
        points=len(record.u_mm),
        remarks=(),
    )


def _without_length(found: SoilFit) -> SoilFit:
    """The fit with nothing said on the mobilization length."""
    k = found.parameters.index("mobilization_length_mm")
    std, covariance = found.std.copy(), found.covariance.copy()
    std[k] = np.inf
    covariance[k, :] = covariance[:, k] = 0.0
    covariance[k, k] = np.inf
    inner, outer = found.interval_68.copy(), found.interval_95.copy()
    inner[k] = outer[k] = (-np.inf, np.inf)
    told = list(found.told_by)
    told[k] = "nothing in this record"
    return replace(
        found,
        std=std,
        covariance=covariance,
        interval_68=inner,
        interval_95=outer,
        told_by=tuple(told),
    )


def _covariance(std: Floats, correlation: Floats) -> Floats:
    """Variances with the correlation of the best fit; rows of a parameter without an interval are apart."""
    closed = np.isfinite(std)
    safe = np.where(closed, std, 0.0)
    covariance = np.where(np.isfinite(correlation), correlation, 0.0) * np.outer(safe, safe)
    np.fill_diagonal(covariance, np.where(closed, safe**2, np.inf))
    return np.asarray(covariance)


def _profile_table(profiles: tuple[Profile, ...]) -> pd.DataFrame:
    tables = []
    for found in profiles:
        values = [in_units(found.parameter, value) for value in found.values]
        columns = ([found.parameter] * len(values), values, found.rises)
        tables.append(pd.DataFrame(dict(zip(PROFILE_COLUMNS, columns, strict=True))))
    return pd.concat(tables, ignore_index=True)


def _shifts(objective: Objective, unknowns: Floats) -> tuple[Shift, ...]:
    """Where the best fit puts what was known beforehand."""
    space, shared, record = objective.space, objective.shared, objective.record
    given = objective.shared.offset_N, shared.gain, record.start_std_mm
    names = [*space.known, *np.array(["offset_N", "gain", "start_mm"])[list(objective.blocks)]]
    stds = [space.std_of(name) for name in space.known] + [std for std in given if std > 0.0]
    found = unknowns[len(space.fitted) : objective.shape.start]
    return tuple(Shift(str(n), float(z * s), float(s)) for n, z, s in zip(names, found, stds, strict=True))


def _switches(objective: Objective, unknowns: Floats) -> pd.DataFrame:
    """Where record and model change their band."""
    places = unknowns[objective.switches]
    modelled = objective.modelled(unknowns[: objective.soils])
    teeth = np.zeros(1) if modelled is None else modelled.teeth.place_mm
    theirs = np.full(len(places), np.nan)
    known = min(len(places), len(teeth) - 1)
    theirs[:known] = teeth[1 : known + 1]
    start = objective.record.start_mm
    stretch = np.diff(np.concatenate([[start], places])) / np.diff(np.concatenate([[0.0], theirs])) - 1.0
    columns = (np.arange(1, len(places) + 1), places, theirs, stretch)
    return pd.DataFrame(dict(zip(SWITCH_COLUMNS, columns, strict=True)))
