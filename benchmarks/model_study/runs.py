"""The runs of the model study: numerics, influences, rules, and a material-point run for comparison."""

import math
from typing import Any, get_args

import numpy as np
import pandas as pd

from model_study.costs import seconds
from ploughval.model import ForceHistory, History, force_history, simulate, simulate_many
from ploughval.model.mechanism import block_areas, block_force
from ploughval.model.settings import STEP_PER_TOLERANCE
from ploughval.model.surface import avalanche, move_block
from ploughval.scene import ModelTable, Scene

DEPTH_MM, GAMMA_KN_M3 = 30.0, 16.0
REFERENCE = {"peak_friction_deg": 50.0, "residual_friction_deg": 32.0, "mobilization_length_mm": 1.0}
TRAVEL_D, RULES_TRAVEL_D = 12.0, 6.5
SWITCHES = 3  # of which the tables tell
SANDS = {"50/32": {}, "36/32": {"peak_friction_deg": 36.0}}
FIXED_STEPS_D = np.geomspace(0.2, 5e-4, 14)
LIMIT_STEP_D = 5e-5
NODE_SPACINGS_D = np.geomspace(0.62, 0.012, 22)
NODE_STEPS_D = (1 / 16, 1 / 64, 1 / 256)
NODE_TRAVEL_D, NODE_LENGTH_D = 1.5, 8.0  # past the first switch of the reference


def scene_of(
    soil: dict[str, float] | None = None, *, depth_mm: float = DEPTH_MM, model: dict[str, Any] | None = None
) -> Scene:
    """The reference scene, a metre wide, with some of its soil, its depth or its [model] changed."""
    return Scene.model_validate(
        {
            "test": {"name": "study"},
            "blade": {"depth_mm": depth_mm, "width_mm": 1000.0},
            "soil": {"unit_weight_kN_m3": GAMMA_KN_M3, **REFERENCE, **(soil or {})},
            "model": model or {},
        }
    )


def directions() -> tuple[str, ...]:
    """Rules for the direction of a fresh band that the model offers."""
    field = ModelTable.model_fields.get("direction")
    return get_args(field.annotation) if field is not None else ()


# --- numerics -----------------------------------------------------------------------------------------------


def first_switch(u_mm: np.ndarray, force_N: np.ndarray, band: np.ndarray) -> tuple[float, float]:
    """Place and force of the first switch; NaN where there is none."""
    rows = np.flatnonzero(np.diff(band) > 0) + 1
    return (float(u_mm[rows[0]]), float(force_N[rows[0]])) if len(rows) else (math.nan, math.nan)


def fixed(scene: Scene, step_d: float, travel_d: float) -> ForceHistory:
    """One march with increments of a given length (shorter only where a band softens or switches)."""
    travel, tolerance = travel_d * scene.blade.depth_mm, step_d / STEP_PER_TOLERANCE
    return force_history(scene, displacement_mm=travel, tolerance=tolerance)


def increments() -> pd.DataFrame:
    """Error and time of the shipped march against its fixed increment."""
    rows = []
    for sand, soil in SANDS.items():
        scene, travel_d = scene_of(soil), 3.5
        limit = fixed(scene, LIMIT_STEP_D, travel_d)
        exact = first_switch(*limit)
        u = np.linspace(0.05 * DEPTH_MM, travel_d * DEPTH_MM, 4001)
        jumps = limit.u_mm[np.flatnonzero(np.diff(limit.band) > 0)]
        away = np.abs(u[:, None] - jumps).min(axis=1) > 0.15 * DEPTH_MM
        level = np.interp(u, limit.u_mm, limit.force_N)
        for step_d in FIXED_STEPS_D:
            found = fixed(scene, step_d, travel_d)
            place, force = first_switch(*found)
            gap = (np.interp(u, found.u_mm, found.force_N) / level - 1.0)[away]
            rows.append(
                {
                    "sand": sand,
                    "increment_d": step_d,
                    "increments": len(found.u_mm) - 1,
                    "time_ms": 1e3 * seconds(lambda h=step_d, s=scene, t=travel_d: fixed(s, h, t)),
                    "switch_u_d": place / DEPTH_MM,
                    "switch_u_error_pct": 100.0 * abs(place / exact[0] - 1.0),
                    "switch_P_error_pct": 100.0 * abs(force / exact[1] - 1.0),
                    "force_rms_error_pct": 100.0 * float(np.sqrt(np.mean(gap**2))),
                }
            )
    return pd.DataFrame(rows)


def nodes() -> pd.DataFrame:
    """First switch against node spacing: nodes as the only outcrops, and the polyline with nodes added."""
    scene = scene_of()
    limit = fixed(scene, LIMIT_STEP_D, NODE_TRAVEL_D)
    exact = np.array(first_switch(*limit)) / [1.0, 1e-6 * GAMMA_KN_M3 * scene.blade.width_mm]
    P0 = 0.5 * DEPTH_MM**2 * math.tan(math.radians(70.0)) ** 2  # Rankine, 50 degrees, over the unit weight
    plain = np.array(first_switch(*force_history(scene)))
    rows = []
    for spacing in NODE_SPACINGS_D:
        x = np.arange(0.0, 45.0, spacing) * DEPTH_MM
        noded = scene_of(model={"initial_surface_mm": [(float(v), DEPTH_MM) for v in x]})
        shipped = np.array(first_switch(*force_history(noded)))
        for step_d in NODE_STEPS_D:
            u, P, _, band = by_nodes(spacing * DEPTH_MM, step_d * DEPTH_MM)
            found = np.array(first_switch(u, P, band))
            rows.append(
                {
                    "node_spacing_d": spacing,
                    "increment_d": step_d,
                    "by_nodes_P0_error_pct": 100.0 * (P[0] / P0 - 1.0),
                    "by_nodes_switch_u_error_pct": 100.0 * (found[0] / exact[0] - 1.0),
                    "by_nodes_switch_P_error_pct": 100.0 * (found[1] / exact[1] - 1.0),
                    "polyline_switch_u_change_pct": 100.0 * (shipped[0] / plain[0] - 1.0),
                    "polyline_switch_P_change_pct": 100.0 * (shipped[1] / plain[1] - 1.0),
                }
            )
    return pd.DataFrame(rows)


def by_nodes(
    spacing_mm: float,
    step_mm: float,
    *,
    travel_mm: float = NODE_TRAVEL_D * DEPTH_MM,
    direction_deg: float | None = None,
    soil: dict[str, float] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The paper's search: bands to nodes only, fixed increments, a switch noticed at the end of one.

    ``direction_deg`` is the friction angle at which the cheapest direction of a fresh band is sought; None:
    the peak. Returns displacement, P / unit weight, tan beta and band of every increment, and of the
    end.
    """
    made = scene_of(soil).soil
    peak, residual = made.peak_friction_deg, made.residual_friction_deg
    seek = peak if direction_deg is None else direction_deg
    x = np.arange(0.0, NODE_LENGTH_D * DEPTH_MM + spacing_mm, spacing_mm)
    surface = np.column_stack([x, np.full(len(x), DEPTH_MM)])
    u, outcrop, slip, band, rows = 0.0, math.nan, 0.0, -1, []
    while True:
        reach = surface[1:, 0] - u
        beta = np.degrees(np.arctan2(surface[1:, 1], reach))
        area = block_areas(surface, u)[1:]
        best = int(np.argmin(block_force(area, beta, seek)))
        fresh = float(block_force(area[best], beta[best], peak))
        active = math.inf
        if band >= 0:
            place = int(np.searchsorted(surface[:, 0], outcrop))
            top = float(np.interp(outcrop, surface[:, 0], surface[:, 1]))
            block = np.vstack([surface[:place], [[outcrop, top]]])
            phi = peak - (peak - residual) * min(slip / made.mobilization_length_mm, 1.0)
            tan_beta = top / (outcrop - u)
            active = float(block_force(block_areas(block, u)[-1], math.degrees(math.atan(tan_beta)), phi))
        if fresh < active:
            outcrop, slip, band = float(surface[best + 1, 0]), 0.0, band + 1
            tan_beta = surface[best + 1, 1] / (outcrop - u)
        rows.append((u, min(fresh, active), tan_beta, band))
        if u >= travel_mm - 1e-9:
            return tuple(np.array(rows).T)
        surface = avalanche(move_block(surface, outcrop, tan_beta, step_mm), made.slope_of_repose_deg)
        slip += step_mm * math.hypot(1.0, tan_beta)
        u += step_mm


# --- influences ---------------------------------------------------------------------------------------------


def told(history: History, depth_mm: float) -> dict[str, float]:
    """Switches, lengths, forces and troughs of a history in depths and in its first force."""
    bands, force = history.bands, history.force
    P = force["force_N"].to_numpy() / history.P0_N
    number = history.marched.rows[:, 6].astype(int)
    starts = bands["u_start_mm"].to_numpy() / depth_mm
    row: dict[str, float] = {"P0_N_per_m": history.P0_N, "first_P_P0": float(P[0])}
    row["slip_0_d"] = float(bands["slip_mm"].iloc[0]) / depth_mm
    first = np.searchsorted(number, np.arange(len(bands)))
    for k in range(SWITCHES + 1):
        there = k < len(bands)
        row[f"beta_{k}_deg"] = float(bands["beta_deg"].iloc[k]) if there else math.nan
        reach = (bands["outcrop_x_mm"].iloc[k] / depth_mm - starts[k]) if there else math.nan
        row[f"reach_{k}_d"] = float(reach)
        whole = k + 1 < len(bands)  # the band's life is over
        row[f"trough_{k}_P0"] = float(P[number == k].min()) if whole else math.nan
    for k in range(1, SWITCHES + 1):
        there = k < len(bands)
        row[f"switch_{k}_d"] = float(starts[k]) if there else math.nan
        row[f"length_{k}_d"] = float(starts[k] - starts[k - 1]) if there else math.nan
        row[f"peak_{k}_P0"] = float(P[first[k]]) if there else math.nan
    return row


def sloping(angle_deg: float) -> dict[str, Any]:
    """[model] with a surface that rises or falls from the blade on, and never below a tenth of the depth."""
    x = np.linspace(0.0, 40.0 * DEPTH_MM, 401)
    y = np.maximum(DEPTH_MM + x * math.tan(math.radians(angle_deg)), 0.1 * DEPTH_MM)
    return {"initial_surface_mm": [(float(a), float(b)) for a, b in zip(x, y, strict=True)]}


def stepped(height_d: float) -> dict[str, Any]:
    """[model] with a step in the surface two depths ahead of the blade."""
    points = [(0.0, 1.0), (2.0, 1.0), (2.01, 1.0 + height_d), (60.0, 1.0 + height_d)]
    return {"initial_surface_mm": [(x * DEPTH_MM, y * DEPTH_MM) for x, y in points]}


def influence_scenes() -> list[tuple[str, float, Scene]]:
    """Parameter, value and scene of every run of the influence study."""
    runs: list[tuple[str, float, Scene]] = []
    simple = {
        "peak_friction_deg": np.linspace(34.0, 54.0, 21),
        "residual_friction_deg": np.linspace(24.0, 48.0, 25),
        "wall_friction_deg": np.linspace(0.0, 15.0, 16),
        "repose_deg": np.linspace(20.0, 50.0, 16),
        "unit_weight_kN_m3": np.array([10.0, 16.0, 22.0]),
    }
    for name, values in simple.items():
        for value in values.tolist():
            # repose and residual friction are one number in the paper; here one moves at a time
            runs.append((name, value, scene_of({"repose_deg": 32.0, name: value})))
    for share in np.geomspace(0.003, 6.0, 23).tolist():
        runs.append(("softening_d", share, scene_of({"mobilization_length_mm": share * DEPTH_MM})))
    for depth in (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 10000.0):
        runs.append(("depth_mm", depth, scene_of(depth_mm=depth)))
    for angle in np.linspace(-4.0, 16.0, 21).tolist():
        runs.append(("surface_slope_deg", angle, scene_of(model=sloping(angle))))
    for height in np.linspace(-0.5, 0.5, 21).tolist():
        runs.append(("step_height_d", height, scene_of(model=stepped(height))))
    return runs


def influences() -> pd.DataFrame:
    """What one parameter at a time does to the lengths and forces of the saw-tooth."""
    rows = []
    for name, value, scene in influence_scenes():
        depth = scene.blade.depth_mm
        history = simulate(scene, displacement_mm=TRAVEL_D * depth)
        rows.append({"parameter": name, "value": value, **told(history, depth)})
    return pd.DataFrame(rows)


def friction_map() -> pd.DataFrame:
    """First switch over peak and residual friction angles, from many runs at once."""
    peaks, residuals = np.linspace(30.0, 54.0, 49), np.linspace(20.0, 44.0, 49)
    pairs = [(p, r) for p in peaks.tolist() for r in residuals.tolist() if p - r >= 1.0]
    scenes = [
        scene_of({"peak_friction_deg": p, "residual_friction_deg": r, "repose_deg": 32.0}) for p, r in pairs
    ]
    runs = simulate_many(scenes, displacement_mm=3.0 * DEPTH_MM, tolerance=3e-3, workers=2)
    rows = []
    for (peak, residual), run in zip(pairs, runs, strict=True):
        u, P = first_switch(*run) if isinstance(run, ForceHistory) else (math.nan, math.nan)
        ratio = math.tan(math.radians(45 + peak / 2)) ** 2 / math.tan(math.radians(45 + residual / 2)) ** 2
        start = run.force_N[0] if isinstance(run, ForceHistory) else math.nan
        rows.append(
            {
                "peak_friction_deg": peak,
                "residual_friction_deg": residual,
                "passive_ratio": ratio,
                "switch_1_d": u / DEPTH_MM,
                "peak_1_P0": P / start,
            }
        )
    return pd.DataFrame(rows)


def drawn(band: np.ndarray) -> np.ndarray:
    """Rows (R,) bool that a figure needs: all about the start of a band, one in eight elsewhere."""
    starts = np.flatnonzero(np.diff(band, prepend=-1.0))
    near = np.abs(np.arange(len(band))[:, None] - starts).min(axis=1)
    return (near <= 16) | (np.arange(len(band)) % 8 == 0) | (np.arange(len(band)) == len(band) - 1)


def rule_histories() -> tuple[pd.DataFrame, pd.DataFrame]:
    """Force histories for the rules of the outcrop and of the direction, and what they tell."""
    rules: dict[str, dict[str, Any]] = {
        "stationary": {"outcrop": "stationary"},
        "riding": {"outcrop": "riding"},
        **{name: {"direction": name} for name in directions()},
    }
    tables, rows = [], []
    for rule, model in rules.items():
        for sand, soil in SANDS.items():
            history = simulate(scene_of(soil, model=model), displacement_mm=RULES_TRAVEL_D * DEPTH_MM)
            marched = history.marched.rows
            mean = np.trapezoid(history.force["force_N"], marched[:, 0]) / (history.end_mm * history.P0_N)
            line = {"rule": rule, "sand": sand, "bands": len(history.bands), "mean_P_P0": mean}
            rows.append({**line, **told(history, DEPTH_MM)})
            tables.append(
                pd.DataFrame(
                    {
                        "rule": rule,
                        "sand": sand,
                        "u_d": marched[:, 0] / DEPTH_MM,
                        "P_P0": history.force["force_N"] / history.P0_N,
                        "beta_deg": history.force["beta_deg"],
                        "band": marched[:, 6].astype(int),
                    }
                )[drawn(marched[:, 6])]
            )
    return pd.concat(tables), pd.DataFrame(rows)
