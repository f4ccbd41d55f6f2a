"""Error and time of the fit of soil parameters by setting: rows, searches, allowed discrepancy, objective.

Every record is the model's, its teeth stretched by 3 % and its force bent by 1 % (standard deviations), with
offset, gain and noise of a rig; the same draws of a seed in every setting. Objectives are searched by a
downhill simplex from an even cover of the range, without intervals.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from fit_study.objectives import objectives, searches
from fit_study.records import FINE, Made, paper_soil, scene_of, stretched, wave
from ploughval.model import force_history
from ploughval.model.fit import PARAMETERS, Discrepancy, SharedErrors, fit_soil, search
from speed_error.timing import Seconds, timed

Floats = NDArray[np.float64]

TRAVEL_MM, DEPTH_MM, NOISE = 75.0, 30.0, 0.01
OFFSET, GAIN, ALLOWED = 0.02, 0.01, Discrepancy()
SEEDS, QUICK_SEEDS = range(4), range(1)
SIMPLEX_STARTS = 8
SETTING_COLUMNS = (
    "family", "setting", "default", "seeds", "angles_deg", "length_pct", "stated_deg", "hold_pct", "cpu_s",
    "wall_s",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Setting:
    """One way of fitting."""

    rows: int = 300
    starts: int = search.STARTS
    cover: int = search.SAMPLES
    allowed: Discrepancy = ALLOWED


DEFAULT = Setting()
FAMILIES: dict[str, dict[str, Setting]] = {
    "rows of the record": {f"{n}": replace(DEFAULT, rows=n) for n in (30, 100, 300, 1000, 3000)},
    "local searches": {f"{n}": replace(DEFAULT, starts=n) for n in (1, 2, search.STARTS, 12)},
    "samples of the cover": {f"{n}": replace(DEFAULT, cover=n) for n in (64, 256, search.SAMPLES)},
    "model allowed to be off": {
        "no": replace(DEFAULT, allowed=Discrepancy(0.0, 0.0)),
        "3 %, 1 %": DEFAULT,
        "6 %, 2 %": replace(DEFAULT, allowed=Discrepancy(2 * ALLOWED.travel, 2 * ALLOWED.force)),
    },
}


@dataclass(frozen=True, slots=True)
class Answer:
    """What one fit gave: errors, stated standard uncertainty of the angles, whether the intervals hold."""

    angles_deg: Floats
    length: float
    stated_deg: Floats
    holds: Floats
    seconds: Seconds


def record(seed: int, rows: int) -> Made:
    """A record of the paper's sand with drawn errors; what is told of the soil is far from the truth."""
    rng, truth = np.random.default_rng(seed), paper_soil()
    history = force_history(scene_of(truth), displacement_mm=1.6 * TRAVEL_MM, tolerance=FINE)
    starts = history.u_mm[np.flatnonzero(np.diff(history.band)) + 1]
    u = np.linspace(0.0, TRAVEL_MM, rows)
    travelled = stretched(u, starts, truth["mobilization_length_mm"], rng, ALLOWED.travel)
    force = np.interp(travelled, history.u_mm, history.force_N)
    force *= 1.0 + ALLOWED.force * wave(np.linspace(0.0, TRAVEL_MM, rows), 0.5 * DEPTH_MM, rng)
    mean = float(np.interp(np.linspace(0.0, TRAVEL_MM, 200), history.u_mm, history.force_N).mean())
    force = force * (1.0 + GAIN * rng.standard_normal()) + OFFSET * mean * rng.standard_normal()
    force += NOISE * mean * rng.standard_normal(rows)
    told = {**truth, "peak_friction_deg": 44.0, "residual_friction_deg": 30.0, "mobilization_length_mm": 3.0}
    return Made(u, force, NOISE * mean, scene_of(told), SharedErrors(OFFSET * mean, GAIN), ALLOWED, truth)


def fitted(setting: Setting, seed: int) -> Answer:
    """The fit of one record."""
    made = record(seed, setting.rows)
    true = np.array([made.truth[name] for name in PARAMETERS])
    with patch.multiple(search, STARTS=setting.starts, SAMPLES=setting.cover):
        found, seconds = timed(
            lambda: fit_soil(
                made.u_mm, made.force_N, made.noise_std_N, made.scene, shared=made.shared,
                discrepancy=setting.allowed,
            ),
            1,
        )  # fmt: skip
    holds = (found.interval_95[:, 0] <= true) & (true <= found.interval_95[:, 1])
    error = found.values - true
    return Answer(error[:2], error[2] / true[2], found.std[:2], holds, seconds)


def searched(cost: Callable[[Floats], float], truth: Floats) -> tuple[Floats, float]:
    """Errors of the angles, degrees, and of the length, relative, at the best end of the simplex searches."""
    ends, costs = searches(cost, SIMPLEX_STARTS)
    error = ends[int(np.nanargmin(costs))] - truth
    return error[:2], float(np.exp(error[2]) - 1.0)


def objective_answers(seed: int) -> dict[str, Answer]:
    """Every objective on one record."""
    made = record(seed, DEFAULT.rows)
    truth = np.array([made.truth[name] for name in PARAMETERS])
    truth[2] = np.log(truth[2])
    answers = {}
    for name, cost in objectives(made).items():
        (angles, length), seconds = timed(lambda cost=cost: searched(cost, truth), 1)
        answers[name] = Answer(angles, length, np.full(2, np.nan), np.full(3, np.nan), seconds)
    return answers


def setting_rows(*, quick: bool = False) -> list[dict[str, Any]]:
    """A row a setting; the default is measured once and stands in every family."""
    seeds = QUICK_SEEDS if quick else SEEDS
    rows, known = [], {}
    for family, members in FAMILIES.items():
        for name, setting in list(members.items())[:: 2 if quick else 1]:
            if setting not in known:
                known[setting] = [fitted(setting, seed) for seed in seeds]
            rows.append(row_of(family, name, setting == DEFAULT, known[setting]))
            print("  ".join(f"{cell!s:>12}" for cell in rows[-1].values()), flush=True)
    each = [objective_answers(seed) for seed in seeds]
    for name in each[0]:
        default = name == "registered"  # what the fit makes least
        rows.append(row_of("objective, simplex", name, default, [answers[name] for answers in each]))
        print("  ".join(f"{cell!s:>12}" for cell in rows[-1].values()), flush=True)
    return rows


def row_of(family: str, name: str, default: bool, answers: Sequence[Answer]) -> dict[str, Any]:
    """Root mean squares of the errors over records, medians of the times."""
    angles = float(np.sqrt(np.mean([a.angles_deg**2 for a in answers])))
    length = 100.0 * float(np.sqrt(np.mean([a.length**2 for a in answers])))
    stated = float(np.sqrt(np.mean([a.stated_deg**2 for a in answers])))
    holds = 100.0 * float(np.mean([a.holds for a in answers]))
    cpu, wall = np.median([a.seconds for a in answers], axis=0)
    numbers = [f"{v:.4g}" if np.isfinite(v) else "" for v in (angles, length, stated, holds, cpu, wall)]
    cells = (family, name, default, len(answers), *numbers)
    return dict(zip(SETTING_COLUMNS, cells, strict=True))
