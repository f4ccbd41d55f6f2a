"""Soil parameters from a measured force history, with uncertainties after the GUM (JCGM 100:2008, H.3)."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ploughval.errors import ConfigError, ConvergenceError, DataError, Fault
from ploughval.model.settings import STEP_PER_TOLERANCE, run_march, scene_law, soil_of
from ploughval.scene import Scene

Floats = NDArray[np.float64]
log = logging.getLogger(__name__)

PARAMETERS = ("peak_friction_deg", "residual_friction_deg", "mobilization_length_mm")
FITTED = (*PARAMETERS, "wall_friction_deg", "repose_deg", "unit_weight_kN_m3")
ANGLES = {"peak_friction_deg", "residual_friction_deg", "wall_friction_deg", "repose_deg"}
STEPS = (
    0.5,
    0.1,
    0.02,
)  # of the derivatives, one search after the other: degrees, or tenths of other variables
SAMPLES = 2048  # of the global scan, at a coarse tolerance
STARTS = 6  # of the local search: the best samples that differ
SCAN_TOLERANCE, FIT_TOLERANCE, LAST_TOLERANCE = 4e-3, 5e-4, 1e-4
LEAST_ANGLE = 10.0  # degrees, searched for the residual friction angle
ALIKE = 0.98  # parameters more correlated than this cannot be told apart


@dataclass(frozen=True, slots=True, eq=False)
class SoilFit:
    """Soil parameters fitted to a force history.

    Attributes
    ----------
    parameters : tuple of str
        Names as in [soil], units in the names.
    values, std : (K,) float
        Best values and their standard uncertainties; infinite where the record says nothing.
    covariance : (K, K) float
        Scaled by the reduced chi-square where the model fits worse than the data's uncertainty allows.
    residual_rms_N : float
        Rms of measured minus modelled force.
    chi2_reduced : float
        Squared residuals over their stated variance, per degree of freedom.
    points : int
        Rows of the record that were used.
    message : str
        What limits the result: parameters that the record hardly determines, cannot tell apart or drives
        to a bound.
    """

    parameters: tuple[str, ...]
    values: Floats
    std: Floats
    covariance: Floats
    residual_rms_N: float
    chi2_reduced: float
    points: int
    message: str

    def __str__(self) -> str:
        rows = zip(self.parameters, self.values, self.std, strict=True)
        lines = [f"{name}: {value:.4g} +- {std:.2g}" for name, value, std in rows]
        lines.append(f"residual: {self.residual_rms_N:.3g} N rms over {self.points} points")
        return "\n".join([*lines, self.message])

    def to_json(self) -> dict[str, object]:
        """Everything as plain numbers and text, for a JSON file."""
        return {
            "parameters": {
                n: {"value": float(v), "std": float(s) if np.isfinite(s) else None}
                for n, v, s in zip(self.parameters, self.values, self.std, strict=True)
            },
            "covariance": [[c if np.isfinite(c) else None for c in row] for row in self.covariance.tolist()],
            "residual_rms_N": self.residual_rms_N,
            "chi2_reduced": self.chi2_reduced,
            "points": self.points,
            "message": self.message,
        }


def fit_soil(
    u_mm: ArrayLike,
    force_N: ArrayLike,
    force_std_N: ArrayLike,
    scene: Scene,
    *,
    parameters: Sequence[str] = PARAMETERS,
    shared_std_N: float = 0.0,
) -> SoilFit:
    """Fit soil parameters to a measured force history: a global scan, then least squares from its best.

    Parameters
    ----------
    u_mm, force_N : (N,) float
        Displacement and horizontal force for the blade's width; rows that are not finite or before u = 0
        are left out.
    force_std_N : float or (N,) float, N
        Standard uncertainty of the force, independent from row to row; where it is not positive, the median
        of the others.
    scene : Scene
        The test; parameters that are not fitted keep the values of its [soil].
    parameters : sequence of str
        Numerical fields of [soil].
    shared_std_N : float
        Standard uncertainty that moves all rows together (friction, zeros): the fit is made again with the
        force so much higher, and what it moves by is added.

    Returns
    -------
    SoilFit
        Best values with standard uncertainties and a remark on what the record determines.

    Raises
    ------
    ConfigError
        Unknown parameters, or no [soil].
    DataError
        Fewer usable rows than parameters.
    ConvergenceError
        No sample of the scan can be modelled.
    """
    names = tuple(parameters)
    _check(scene, names)
    low, high = _bounds(scene, names)
    u, force, std = _usable(u_mm, force_N, force_std_N, len(names))
    coarse = _residuals(scene, names, (u, force, std), SCAN_TOLERANCE)
    exact = _residuals(scene, names, (u, force, std), FIT_TOLERANCE)
    ends, costs = [], []
    for found in _scan(coarse, low, high):
        for step in STEPS:
            found = _search(exact, found, low, high, step)
        ends.append(found)
        costs.append(float(np.sum(exact(found) ** 2)))
    if not ends:
        raise ConvergenceError(f"{scene.source}: no soil in the range searched can be modelled; check [box]")
    plain = {"peak_friction_deg", "residual_friction_deg"} <= set(names)
    if plain:
        ends.append(_without_softening(exact, names, ends[int(np.argmin(costs))], low, high))
        costs.append(float(np.sum(exact(ends[-1]) ** 2)))
    least = min(costs)
    alike = [k for k, cost in enumerate(costs) if cost < least + 9.0 * max(1.0, least / len(u))]
    # the last is the fit without softening: nothing more is claimed where it does as well
    best = ends[-1] if plain and alike[-1] == len(ends) - 1 else ends[int(np.argmin(costs))]
    finest = _residuals(scene, names, (u, force, std), LAST_TOLERANCE)
    last = _search(finest, best, low, high, STEPS[-1])
    # first order in the step: what is left is to what was gained as the tolerances
    numerical = np.abs(last - best) * LAST_TOLERANCE / (FIT_TOLERANCE - LAST_TOLERANCE)
    fitted = _result(
        scene, names, last, _Local(finest, low, high, numerical, np.array([ends[k] for k in alike])), std
    )
    if shared_std_N <= 0:
        return fitted
    higher = _residuals(scene, names, (u, force + shared_std_N, std), LAST_TOLERANCE)
    moved = _physical(names, _search(higher, last, low, high, STEPS[-1]))
    shift = np.array(list(moved.values())) - fitted.values
    covariance = fitted.covariance + np.outer(shift, shift)
    return replace(fitted, covariance=covariance, std=np.sqrt(np.diag(covariance)))


def _check(scene: Scene, names: tuple[str, ...]) -> None:
    """Refuse names that cannot be fitted."""
    wrong = [Fault("parameters", repr(n), f"one of {', '.join(FITTED)}") for n in names if n not in FITTED]
    if len(set(names)) != len(names) or not names:
        wrong.append(Fault("parameters", repr(names), "different names, at least one"))
    if wrong:
        raise ConfigError(scene.source, wrong)


def _bounds(scene: Scene, names: tuple[str, ...]) -> tuple[Floats, Floats]:
    """Range of the variables searched: degrees; logarithms of lengths and weights; see ``_physical``."""
    soil, depth = soil_of(scene), scene.blade.depth_mm
    wall = 0.0 if "wall_friction_deg" in names else soil.wall_friction_deg
    both = "peak_friction_deg" in names
    residual = LEAST_ANGLE if "residual_friction_deg" in names else soil.residual_friction_deg
    ranges = {
        "peak_friction_deg": (max(15.0, residual), min(70.0, 89.0 - wall)),
        "residual_friction_deg": (0.0, 1.0) if both else (LEAST_ANGLE, soil.peak_friction_deg),
        "mobilization_length_mm": (np.log(1e-3 * depth), np.log(2.0 * depth)),
        "wall_friction_deg": (0.0, min(35.0, 89.0 - (70.0 if both else soil.peak_friction_deg))),
        "repose_deg": (5.0, 80.0),
        "unit_weight_kN_m3": (np.log(5.0), np.log(40.0)),
    }
    limits = np.array([ranges[name] for name in names])
    return limits[:, 0], limits[:, 1]


def _usable(
    u_mm: ArrayLike, force_N: ArrayLike, std_N: ArrayLike, least: int
) -> tuple[Floats, Floats, Floats]:
    """Rows that can be used, with a positive uncertainty each."""
    u, force, std = (np.array(v, float) for v in np.broadcast_arrays(u_mm, force_N, std_N))
    keep = np.isfinite(u) & np.isfinite(force) & (u >= 0.0)
    if keep.sum() <= least:
        raise DataError(f"{keep.sum()} rows of the force record are usable; more than {least} are needed")
    u, force, std = u[keep], force[keep], std[keep]
    good = np.isfinite(std) & (std > 0.0)
    std[~good] = np.median(std[good]) if good.any() else 0.01 * np.abs(force).max()
    return u, force, std


def _residuals(
    scene: Scene, names: tuple[str, ...], data: tuple[Floats, Floats, Floats], tolerance: float
) -> Callable[[Floats], Floats]:
    """Function from the searched values to (model - measured) / std; huge where nothing can be modelled."""
    u, force, std = data
    soil, travel, step = soil_of(scene), float(u.max()), STEP_PER_TOLERANCE * tolerance * scene.blade.depth_mm

    def residuals(searched: Floats) -> Floats:
        changed = soil.model_copy(update=_physical(names, searched))
        try:
            marched = run_march(scene, scene_law(scene, changed), travel, step, store=False)
        except ConvergenceError:
            return np.full(len(u), 1e6)
        scale = 1e-6 * changed.unit_weight_kN_m3 * scene.blade.width_mm * changed.horizontal_share
        return np.asarray((scale * np.interp(u, marched.rows[:, 0], marched.rows[:, 2]) - force) / std)

    return residuals


def _physical(names: tuple[str, ...], searched: Floats) -> dict[str, float]:
    """Soil parameters from what is searched; beside the peak, the residual angle is a share of it."""
    values = {n: float(v) if n in ANGLES else float(np.exp(v)) for n, v in zip(names, searched, strict=True)}
    peak = values.get("peak_friction_deg")
    if peak is not None and "residual_friction_deg" in values:
        share = values["residual_friction_deg"]
        values["residual_friction_deg"] = LEAST_ANGLE + share * (peak - LEAST_ANGLE)
    return values


def _search(
    residuals: Callable[[Floats], Floats], start: Floats, low: Floats, high: Floats, step: float
) -> Floats:
    """Local least squares with derivatives over one step."""
    from scipy.optimize import least_squares  # not needed before a fit is asked for

    inside = np.clip(start, low + 1e-9 * (high - low), high - 1e-9 * (high - low))
    slopes = _slopes(residuals, low, high, step)
    found = least_squares(residuals, inside, jac=slopes, bounds=(low, high), x_scale=high - low, max_nfev=40)
    return np.asarray(found.x)


def _scan(residuals: Callable[[Floats], Floats], low: Floats, high: Floats) -> list[Floats]:
    """Best samples of an even cover of the range, different ones, by the mean absolute residual."""
    from scipy.stats import qmc  # slow to import, not needed before a fit is asked for

    unit = qmc.Sobol(len(low), scramble=False).random(SAMPLES)
    cost = np.array([np.mean(np.abs(residuals(low + (high - low) * share))) for share in unit])
    chosen: list[int] = []
    for k in np.argsort(cost, kind="stable"):
        if len(chosen) == STARTS or cost[k] >= 1e6:
            break
        if all(np.abs(unit[k] - unit[c]).max() > 0.03 for c in chosen):
            chosen.append(int(k))
    return [low + (high - low) * unit[k] for k in chosen]


def _slopes(
    residuals: Callable[[Floats], Floats], low: Floats, high: Floats, step: float
) -> Callable[[Floats], Floats]:
    """Derivatives by differences wide enough to see past the drops at the switches of bands."""

    def jacobian(at: Floats) -> Floats:
        columns = []
        for k in range(len(at)):
            # an angle spans tens of degrees, a logarithm a few units: a tenth of the step for the latter
            width = step if high[k] > 10.0 else 0.1 * step
            ends = np.clip([at[k] - width, at[k] + width], low[k], high[k])
            sides = [residuals(np.concatenate([at[:k], [end], at[k + 1 :]])) for end in ends]
            columns.append((sides[1] - sides[0]) / (ends[1] - ends[0]))
        return np.column_stack(columns)

    return jacobian


@dataclass(frozen=True, slots=True, eq=False)
class _Local:
    """Around the best values: residuals, range searched, numerical error, and what fits alike (3 sigma)."""

    residuals: Callable[[Floats], Floats]
    low: Floats
    high: Floats
    numerical: Floats
    alike: Floats


def _without_softening(
    residuals: Callable[[Floats], Floats], names: tuple[str, ...], near: Floats, low: Floats, high: Floats
) -> Floats:
    """The best peak angle when the residual angle is the same: is softening seen in the record at all?"""
    from scipy.optimize import minimize_scalar  # not needed before a fit is asked for

    k = names.index("peak_friction_deg")
    level = near.copy()
    level[names.index("residual_friction_deg")] = 1.0

    def cost(peak: float) -> float:
        return float(np.sum(residuals(np.concatenate([level[:k], [peak], level[k + 1 :]])) ** 2))

    level[k] = minimize_scalar(cost, bounds=(low[k], high[k]), method="bounded", options={"xatol": 1e-3}).x
    return level


def _result(scene: Scene, names: tuple[str, ...], best: Floats, local: _Local, std: Floats) -> SoilFit:
    left = local.residuals(best)
    slopes = _slopes(local.residuals, local.low, local.high, STEPS[-1])(best)
    freedom = len(left) - len(best)
    chi2 = float(np.sum(left**2)) / freedom
    seen = np.linalg.norm(slopes, axis=0) * (local.high - local.low) > 1e-3
    searched = np.diag(np.where(seen, 0.0, np.inf))
    normal = slopes[:, seen].T @ slopes[:, seen]
    searched[np.ix_(seen, seen)] = np.linalg.pinv(normal, rcond=1e-14) * max(chi2, 1.0)
    # searches that ended elsewhere with as good a fit tell of a flat or rough valley that slopes do not show
    apart = local.alike - best
    far = np.abs(apart) > 3.0 * np.sqrt(np.diag(searched))
    spread = np.max(np.where(far, np.abs(apart), 0.0), axis=0)
    searched[np.ix_(seen, seen)] += np.diag(local.numerical[seen] ** 2 + spread[seen] ** 2 / 4.0)
    values = np.array(list(_physical(names, best).values()))
    to_physical = np.column_stack(
        [
            (np.array(list(_physical(names, best + shift).values())) - values) / 1e-6
            for shift in 1e-6 * np.eye(len(best))
        ]
    )
    known = np.where(np.isfinite(searched), searched, 0.0)
    covariance = to_physical @ known @ to_physical.T
    blind = ~seen
    covariance[blind, :] = covariance[:, blind] = 0.0
    covariance[blind, blind] = np.inf
    flat = _no_softening(names, values, covariance)
    if flat:
        length = names.index("mobilization_length_mm")
        covariance[length, :] = covariance[:, length] = 0.0
        covariance[length, length] = np.inf
    return SoilFit(
        parameters=names,
        values=values,
        std=np.sqrt(np.diag(covariance)),
        covariance=covariance,
        residual_rms_N=float(np.sqrt(np.mean((left * std) ** 2))),
        chi2_reduced=chi2,
        points=len(left),
        message="; ".join(
            [
                *_remarks(names, best, searched, (local.low, local.high)),
                *flat,
                *(
                    [f"the model misses the record by {np.sqrt(chi2):.1f} times its stated std"]
                    if chi2 > 4
                    else []
                ),
            ]
        )
        or "all parameters are determined by this record",
    )


def _no_softening(names: tuple[str, ...], values: Floats, covariance: Floats) -> list[str]:
    """A remark where peak and residual angle are equal within two standard uncertainties."""
    if not set(PARAMETERS) <= set(names):
        return []
    peak, residual = names.index("peak_friction_deg"), names.index("residual_friction_deg")
    std = np.sqrt(covariance[peak, peak] + covariance[residual, residual] - 2.0 * covariance[peak, residual])
    if values[peak] - values[residual] > 2.0 * std:
        return []
    return ["the record shows no softening: mobilization_length_mm is hardly determined by it"]


def _remarks(
    names: tuple[str, ...], best: Floats, covariance: Floats, bounds: tuple[Floats, Floats]
) -> list[str]:
    """What the record does not determine, in words."""
    low, high = bounds
    std = np.sqrt(np.diag(covariance))
    remarks = []
    for k, name in enumerate(names):
        if std[k] > 0.15 * (high[k] - low[k]):
            remarks.append(f"{name} is hardly determined by this record")
        elif min(best[k] - low[k], high[k] - best[k]) < 1e-3 * (high[k] - low[k]):
            remarks.append(f"{name} stands at the end of the range searched")
        for j in range(k):
            if np.isfinite(std[[j, k]]).all() and abs(covariance[j, k]) > ALIKE * std[j] * std[k]:
                remarks.append(f"{names[j]} and {name} cannot be told apart")
    return remarks
