"""One sand by every numerical setting of the model, and by the paper's own search over nodes.

The reference is the shipped march at the finest tolerance. The search over nodes has bands to nodes only,
fixed increments as long as the nodes are apart, and notices a switch at the end of an increment.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ploughval.model import force_history, simulate
from ploughval.model.settings import STEP_PER_TOLERANCE
from ploughval.scene import ModelTable, Scene
from speed_error.timing import timed

Run = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]

DEPTH_MM, TRAVEL_D, LENGTH_D = 30.0, 3.0, 12.0
PEAK_DEG, RESIDUAL_DEG, MOBILIZATION_MM = 50.0, 32.0, 1.0
FINEST = 1e-5
DEFAULT = float(ModelTable().tolerance)
TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
ADDED_D = (1.0, 0.3, 0.1, 0.03)
NODES_D = (0.2, 0.1, 0.05, 0.025, 0.0125)
QUICK_NODES_D = NODES_D[:2]
ROUNDS, LEAST_S = 7, 0.02
SETTING_COLUMNS = (
    "family", "setting", "default", "switch_error_pct", "peak_error_pct", "force_rms_pct", "cpu_ms",
    "wall_ms",
)  # fmt: skip


def scene_of(surface_mm: list[tuple[float, float]] | None = None) -> Scene:
    """Sand of 50/32 degrees before a blade 30 mm deep and a metre wide."""
    return Scene.model_validate(
        {
            "test": {"name": "bench"},
            "blade": {"depth_mm": DEPTH_MM, "width_mm": 1000.0},
            "soil": {
                "unit_weight_kN_m3": 16.0,
                "peak_friction_deg": PEAK_DEG,
                "residual_friction_deg": RESIDUAL_DEG,
                "mobilization_length_mm": MOBILIZATION_MM,
            },
            "model": {} if surface_mm is None else {"initial_surface_mm": surface_mm},
        }
    )


def noded(spacing_d: float) -> Scene:
    """The same scene, its level surface given by nodes."""
    x = np.arange(0.0, LENGTH_D + spacing_d, spacing_d) * DEPTH_MM
    return scene_of([(float(v), DEPTH_MM) for v in x])


def by_nodes(spacing_d: float) -> Run:
    """Displacement mm, force over its first value, band; at every increment of the search over nodes."""
    from model_study.runs import by_nodes as searched  # which imports the bench that imports this module

    spacing_mm = spacing_d * DEPTH_MM
    u_mm, force, _, band = searched(spacing_mm, spacing_mm, travel_mm=TRAVEL_D * DEPTH_MM)
    return u_mm, force / force[0], band


def by_march(scene: Scene, tolerance: float) -> Run:
    """The same of one march of the shipped model."""
    found = force_history(scene, displacement_mm=TRAVEL_D * DEPTH_MM, tolerance=tolerance)
    return found.u_mm, found.force_N / found.force_N[0], found.band


def by_model(scene: Scene, tolerance: float) -> Run:
    """The same of a whole simulation: two marches, surfaces, stated error."""
    history = simulate(scene, displacement_mm=TRAVEL_D * DEPTH_MM, tolerance=tolerance)
    force = history.force["force_N"].to_numpy()
    return history.force["u_mm"].to_numpy(), force / force[0], history.marched.rows[:, 6]


def errors(found: Run, limit: Run) -> tuple[float, ...]:
    """Relative error of the first switch in place and force, and rms of the force away from it, per cent."""
    places = [_first_switch(run) for run in (found, limit)]
    jump = 100.0 * np.abs(np.array(places[0]) / np.array(places[1]) - 1.0)
    u = np.linspace(0.05 * DEPTH_MM, TRAVEL_D * DEPTH_MM, 2001)
    gap = np.interp(u, *found[:2]) / np.interp(u, *limit[:2]) - 1.0
    away = np.all(np.abs(u[:, None] - np.array(places)[:, 0]) > 0.1 * DEPTH_MM, axis=1)
    return float(jump[0]), float(jump[1]), 100.0 * float(np.sqrt(np.mean(gap[away] ** 2)))


def _first_switch(run: Run) -> tuple[float, float]:
    u, force, band = run
    rows = np.flatnonzero(np.diff(band) > 0) + 1
    return (float(u[rows[0]]), float(force[rows[0]])) if len(rows) else (math.nan, math.nan)


def setting_rows(*, quick: bool = False) -> list[dict[str, Any]]:
    """A row a setting."""
    plain = scene_of()
    limit = by_march(plain, FINEST)
    rows = []
    for tolerance in TOLERANCES:
        rows.append(_row("tolerance", tolerance, lambda t=tolerance: by_model(plain, t), limit))
    for tolerance in TOLERANCES:
        step_d = min(STEP_PER_TOLERANCE * tolerance, 0.25)
        rows.append(_row("increment, d", step_d, lambda t=tolerance: by_march(plain, t), limit))
    for spacing in ADDED_D:
        scene = noded(spacing)
        rows.append(_row("nodes added, d apart", spacing, lambda s=scene: by_model(s, DEFAULT), limit))
    for spacing in QUICK_NODES_D if quick else NODES_D:
        rows.append(
            _row("search over nodes, d apart", spacing, lambda s=spacing: by_nodes(s), limit, rounds=3)
        )
    return rows


def _row(
    family: str, setting: float, call: Callable[[], Any], limit: Any, *, rounds: int = ROUNDS
) -> dict[str, Any]:
    call()  # compiles
    found, seconds = timed(call, rounds, least_s=LEAST_S)
    default = (family == "tolerance" and setting == DEFAULT) or (
        family == "increment, d" and setting == STEP_PER_TOLERANCE * DEFAULT
    )
    values = (*errors(found, limit), 1e3 * seconds.cpu, 1e3 * seconds.wall)
    cells = (family, f"{setting:g}", default, *(f"{value:.4g}" for value in values))
    return dict(zip(SETTING_COLUMNS, cells, strict=True))
