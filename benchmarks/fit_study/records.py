"""Made force records with known soil and drawn errors, for the studies of the fit."""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.model import force_history
from ploughval.model.fit import Discrepancy, SharedErrors
from ploughval.scene import Scene
from virtual.folder import virtual_folder

Floats = NDArray[np.float64]

FINE = 1e-5  # tolerance of the model that makes a record: its error is nothing beside the noise
WIDTH_MM = 218.0


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """A record, what a laboratory would tell of it, and the truth."""

    u_mm: Floats
    force_N: Floats
    noise_std_N: float
    scene: Scene
    shared: SharedErrors
    discrepancy: Discrepancy
    truth: dict[str, float]


@dataclass(frozen=True, slots=True)
class Errors:
    """Relative standard deviations of what is drawn, and what is told of it.

    ``together``: rows over which the noise is correlated; its std is told, the correlation is not.
    """

    noise: tuple[float, float] = (0.005, 0.03)
    offset: float = 0.03
    gain: float = 0.01
    depth: float = 0.005
    travel: float = 0.0
    force: float = 0.0
    together: float = 1.0


def scene_of(
    soil: dict[str, float], depth_mm: float = 30.0, depth_std_mm: float = 0.0, **model: object
) -> Scene:
    """A scene with level sand."""
    blade = {"depth_mm": depth_mm, "width_mm": WIDTH_MM, "depth_std_mm": depth_std_mm}
    tables = {"test": {"name": "made"}, "blade": blade, "soil": soil, "model": model}
    return Scene.model_validate(tables)


def draw_soil(rng: np.random.Generator) -> dict[str, float]:
    """A soil with a drop between its friction angles."""
    peak = float(rng.uniform(36.0, 54.0))
    return {
        "unit_weight_kN_m3": float(rng.uniform(14.0, 17.0)),
        "peak_friction_deg": peak,
        "residual_friction_deg": float(rng.uniform(28.0, min(34.0, peak - 4.0))),
        "mobilization_length_mm": float(np.exp(rng.uniform(np.log(0.5), np.log(5.0)))),
    }


def made_record(rng: np.random.Generator, errors: Errors) -> Made:
    """A record of a drawn soil: the model, stretched and bent as drawn, and what a rig adds."""
    truth, depth = draw_soil(rng), float(rng.uniform(25.0, 40.0))
    travel, rows = depth * float(rng.uniform(1.2, 2.5)), int(rng.integers(200, 500))
    true_depth = depth * (1.0 + errors.depth * float(rng.standard_normal()))
    history = force_history(scene_of(truth, true_depth), displacement_mm=1.6 * travel, tolerance=FINE)
    u = np.linspace(0.0, travel, rows)
    starts = history.u_mm[np.flatnonzero(np.diff(history.band)) + 1]
    travelled = stretched(u, starts, truth["mobilization_length_mm"], rng, errors.travel)
    force = np.interp(travelled, history.u_mm, history.force_N)
    force = force * (1.0 + errors.force * wave(u, 0.5 * depth, rng))
    noise = float(rng.uniform(*errors.noise) * force.mean())
    offset = errors.offset * force.mean()
    force = force * (1.0 + errors.gain * rng.standard_normal()) + offset * rng.standard_normal()
    force = force + noise * coloured(rows, errors.together, rng)
    told = {**truth, "peak_friction_deg": 45.0, "residual_friction_deg": 30.0, "mobilization_length_mm": 2.0}
    shared = SharedErrors(offset, errors.gain)
    return Made(
        u, force, noise, scene_of(told, depth, errors.depth * depth), shared,
        Discrepancy(errors.travel, errors.force), truth,
    )  # fmt: skip


def stretched(
    u_mm: Floats, starts_mm: Floats, soft_mm: float, rng: np.random.Generator, std: float
) -> Floats:
    """Travel of the model at travel of the record, whose teeth are longer or shorter by a relative std.

    The softening after a switch keeps its length: it is a property of the sand.
    """
    model = np.concatenate([[0.0], starts_mm])
    lengths = np.diff(model) * (1.0 + std * rng.standard_normal(len(starts_mm)))
    record = np.concatenate([[0.0], np.cumsum(lengths)])
    soft = np.append(np.minimum(soft_mm, 0.5 * np.minimum(np.diff(model), lengths)), soft_mm)
    ends = np.column_stack([record, record + soft]).ravel(), np.column_stack([model, model + soft]).ravel()
    return np.asarray(np.interp(u_mm, *(np.append(side, side[-1] + 1e3) for side in ends)))


def wave(u_mm: Floats, spacing_mm: float, rng: np.random.Generator) -> Floats:
    """A curve through standard normal numbers, one every ``spacing_mm``."""
    knots = np.arange(0.0, u_mm[-1] + spacing_mm, spacing_mm)
    return np.asarray(np.interp(u_mm, knots, rng.standard_normal(len(knots))))


def coloured(count: int, together: float, rng: np.random.Generator) -> Floats:
    """Noise of unit variance whose integrated autocorrelation is so many rows (autoregressive)."""
    share = (together - 1.0) / (together + 1.0)
    noise = rng.standard_normal(count)
    for k in range(1, count):
        noise[k] = share * noise[k - 1] + math.sqrt(1.0 - share**2) * noise[k]
    return noise


def virtual_record(rule: str) -> tuple[Made, pd.DataFrame] | None:
    """The force of the material-point run, where it is at hand, as a record."""
    folder = virtual_folder()
    if folder is None:
        return None
    table = pd.read_csv(folder / "mpm_d30_s2_force.csv")
    u = 1e3 * table["u_m"].to_numpy()
    force = 1e-3 * WIDTH_MM * table["P_front_N_per_m"].to_numpy()
    place = np.unique((u / 0.1).astype(int), return_inverse=True)[1]
    u, force = (np.bincount(place, v) / np.bincount(place) for v in (u, force))
    truth = {
        "unit_weight_kN_m3": 16.0,
        "peak_friction_deg": 50.0,
        "residual_friction_deg": 32.0,
        "mobilization_length_mm": 1.0,
    }
    second = np.diff(force, 2)
    noise = float(1.4826 * np.median(np.abs(second - np.median(second))) / math.sqrt(6.0))
    told = {**truth, "peak_friction_deg": 45.0, "residual_friction_deg": 30.0, "mobilization_length_mm": 2.0}
    scene = scene_of(told, direction=rule)
    return Made(u, force, noise, scene, SharedErrors(), Discrepancy(), truth), table


def paper_soil() -> dict[str, float]:
    """The soil that Kashizadeh et al. (2014) found for their sand by eye."""
    return {
        "unit_weight_kN_m3": 15.7,
        "peak_friction_deg": 50.0,
        "residual_friction_deg": 32.0,
        "mobilization_length_mm": 1.0,
    }
