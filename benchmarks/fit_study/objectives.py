"""Four objectives for the fit on the same records: their landscapes, basins and errors."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import qmc

from fit_study.records import FINE, Made, paper_soil, scene_of, virtual_record
from ploughval.model import force_history
from ploughval.model.fit import PARAMETERS, Discrepancy, SharedErrors
from ploughval.model.fit.objective import objective_of
from ploughval.model.fit.record import read_record
from ploughval.model.fit.variables import space_of

Floats = NDArray[np.float64]
Cost = Callable[[Floats], float]

TOLERANCE = 2e-3
TRAVEL_MM, ROWS, NOISE = 75.0, 300, 0.02
SIDE = 41
STARTS = 48
EVALUATIONS = 160
NEAR = (1.0, 1.0, 0.2)  # degrees, degrees, logarithm: as good as the same minimum
LOW, HIGH = np.array([34.0, 20.0, np.log(0.3)]), np.array([62.0, 44.0, np.log(10.0)])
THRESHOLD = 0.1  # relative fall of the force that is a feature
FORCE_SHARE, TRAVEL_SHARE = 0.05, 0.05  # what a feature may be off by
MISSING = 10.0  # standard deviations, of a feature that only one side has


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A record and the truth behind it."""

    name: str
    made: Made


def cases() -> list[Case]:
    """Exact, longer teeth, another wall friction, other physics."""
    found = [Case("model right", _made(1.0, 0.0))]
    found += [Case(f"teeth {share} % longer", _made(1.0 + 0.01 * share, 0.0)) for share in (5, 10)]
    found.append(Case("wall friction 6 instead of 0 degrees", _made(1.0, 6.0)))
    for rule in ("least_force", "least_softened"):
        virtual = virtual_record(rule)
        if virtual is not None:
            found.append(Case(f"material points, {rule}", virtual[0]))
    return found


def _made(longer: float, wall_deg: float) -> Made:
    truth = paper_soil()
    rng = np.random.default_rng(7)
    made_by = scene_of({**truth, "wall_friction_deg": wall_deg})
    history = force_history(made_by, displacement_mm=TRAVEL_MM, tolerance=FINE)
    u = np.linspace(0.0, TRAVEL_MM, ROWS)
    starts = np.concatenate([[0.0], history.u_mm[np.flatnonzero(np.diff(history.band)) + 1], [2e3]])
    force = np.interp(np.interp(u, longer * starts, starts), history.u_mm, history.force_N)
    force *= np.cos(np.radians(wall_deg))
    noise = NOISE * float(force.mean())
    force = force + noise * rng.standard_normal(ROWS)
    return Made(u, force, noise, scene_of(truth), SharedErrors(), Discrepancy(), truth)


def objectives(made: Made) -> dict[str, Cost]:
    """Each as a function of peak, residual and the logarithm of the length."""
    scene, scale = made.scene, made.noise_std_N
    depth = scene.blade.depth_mm
    record = read_record(made.u_mm, made.force_N, scale, depth, least=3)
    registered = objective_of(space_of(scene, PARAMETERS), record, made.shared, Discrepancy(), TOLERANCE)
    plain = replace(record, middles_mm=np.empty(0), threshold=1.9)  # no switch is looked at
    pointwise = objective_of(space_of(scene, PARAMETERS), plain, made.shared, Discrepancy(), TOLERANCE)
    theirs = features(record.u_mm, record.force_N)

    def left(searched: Floats) -> Floats:
        return pointwise.residuals(pointwise.start(searched))[: len(record.u_mm)]

    def by_features(searched: Floats) -> float:
        model = left(searched) * scale + record.force_N
        return feature_cost(features(record.u_mm, model), theirs)

    return {
        "squares": lambda s: float(np.sum(left(s) ** 2)),
        "absolute": lambda s: float(np.sum(np.abs(left(s)))),
        "features": by_features,
        "registered": lambda s: registered.cost(registered.start(s)),
    }


def features(u_mm: Floats, force: Floats) -> list[tuple[float, float]]:
    """Places and forces of peaks and troughs in turn, the first force first."""
    found = [(float(u_mm[0]), float(force[0]))]
    best, falling = 0, True
    for k in range(1, len(force)):
        better = force[k] < force[best] if falling else force[k] > force[best]
        turned = (
            force[k] > (1 + THRESHOLD) * force[best] if falling else force[k] < (1 - THRESHOLD) * force[best]
        )
        if better:
            best = k
        elif turned:
            found.append((float(u_mm[best]), float(force[best])))
            best, falling = k, not falling
    return found


def feature_cost(model: list[tuple[float, float]], record: list[tuple[float, float]]) -> float:
    """Squares of relative differences in place and force; a missing feature costs a fixed amount."""
    common = min(len(model), len(record))
    cost = MISSING**2 * abs(len(model) - len(record))
    end = max(record[-1][0], 1e-9)
    for (u, force), (at, measured) in zip(model[:common], record[:common], strict=True):
        cost += (
            (u - at) / (TRAVEL_SHARE * max(at, 0.2 * end))
        ) ** 2 + ((force - measured) / (FORCE_SHARE * measured)) ** 2  # fmt: skip
    return cost


def compare_objectives(out: Path) -> tuple[pd.DataFrame, dict[str, Floats]]:
    """Maps and searches of every objective on every record; objectives.csv, and maps for the figure."""
    rows, maps = [], {}
    peak, residual = (np.linspace(LOW[k], HIGH[k], SIDE) for k in (0, 1))
    length = np.linspace(LOW[2], HIGH[2], SIDE)
    for case in cases():
        truth = np.array([case.made.truth[n] for n in PARAMETERS])
        truth[2] = np.log(truth[2])
        for name, cost in objectives(case.made).items():
            angles = np.array([[_at(cost, (p, r, truth[2])) for p in peak] for r in residual])
            other = np.array([[_at(cost, (p, truth[1], g)) for p in peak] for g in length])
            maps[f"{case.name}|{name}|residual"], maps[f"{case.name}|{name}|length"] = angles, other
            ends, costs = searches(cost)
            best = ends[int(np.argmin(costs))]
            near = np.all(np.abs(ends - best) < NEAR, axis=1)
            rows.append(
                {
                    "record": case.name,
                    "objective": name,
                    "minima_peak_residual": minima(angles),
                    "minima_peak_length": minima(other),
                    "reach_best_pct": 100.0 * near.mean(),
                    "peak_error_deg": best[0] - truth[0],
                    "residual_error_deg": best[1] - truth[1],
                    "length_ratio": float(np.exp(best[2] - truth[2])),
                }
            )
            print(rows[-1], flush=True)
    table = pd.DataFrame(rows)
    table.to_csv(out / "objectives.csv", index=False, float_format="%.4g")
    return table, maps


def _at(cost: Cost, values: tuple[float, float, float]) -> float:
    return cost(np.array(values)) if values[1] <= values[0] else np.nan


def minima(values: Floats) -> int:
    """Nodes of a map that are lower than all their neighbours by more than rounding."""
    framed = np.pad(np.where(np.isfinite(values), values, np.inf), 1, constant_values=np.inf)
    around = [
        framed[1 + i : framed.shape[0] - 1 + i, 1 + j : framed.shape[1] - 1 + j]
        for i in (-1, 0, 1)
        for j in (-1, 0, 1)
        if (i, j) != (0, 0)
    ]
    return int(np.sum(np.isfinite(values) & np.all([values < other for other in around], axis=0)))


def searches(cost: Cost, starts: int = STARTS) -> tuple[Floats, Floats]:
    """Ends (starts, 3) of a downhill simplex from an even cover of the range, and the cost at each."""
    unit = qmc.Sobol(3, scramble=False).random(64)[:starts]
    ends, costs = [], []
    for share in unit:
        start = LOW + (HIGH - LOW) * share
        start[1] = LOW[1] + share[1] * (min(start[0], HIGH[1]) - LOW[1])
        simplex = np.vstack([start, start + np.diag([2.0, 2.0, 0.3])])
        found = minimize(
            lambda s: cost(np.clip(s, LOW, HIGH)), start, method="Nelder-Mead",
            options={"maxfev": EVALUATIONS, "initial_simplex": simplex, "xatol": 1e-2, "fatol": 1e-3},
        )  # fmt: skip
        ends.append(np.clip(found.x, LOW, HIGH))
        costs.append(float(found.fun))
    return np.array(ends), np.array(costs)
