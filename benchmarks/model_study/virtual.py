"""The model beside a material-point run of the same scene: forces, bands, and the run's mobilised friction.

The run is read from a folder beside the repository (or from PLOUGHVAL_SHARED); nothing here is fitted to it.
"""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from model_study.runs import DEPTH_MM, GAMMA_KN_M3, by_nodes, directions, drawn, scene_of
from ploughval.model import simulate

WINDOW_MM = 0.5  # running mean of the run's force: its grid makes it ripple
FIRST_MM, SWITCH_MM = 2.0, (10.0, 35.0)  # where the first peak and the switch are looked for
NODE_MM, STEP_MM = 0.2, 0.05
RULES = (
    "least_force",
    "least_softened",
    "direction after Arthur",
    "least_force, friction after Davis",
    "least_softened, friction after Davis",
    "direction after Arthur, friction after Davis",
)


def readings(u_mm: np.ndarray, K: np.ndarray, switch: int) -> dict[str, float]:
    """First peak, trough, switch (its row is given) and second trough of a force history."""
    peak = int(np.argmax(np.where(u_mm < FIRST_MM, K, -np.inf)))
    dip = peak + int(np.argmin(K[peak : switch + 1]))
    low = switch + int(np.argmin(K[switch:]))
    return {
        "first_peak_K": float(K[peak]),
        "trough_K": float(K[dip]),
        "trough_u_mm": float(u_mm[dip]),
        "switch_K": float(K[switch]),
        "switch_u_mm": float(u_mm[switch]),
        "second_trough_K": float(K[low]),
        "mean_K": float(np.trapezoid(K, u_mm) / (u_mm[-1] - u_mm[0])),
    }


def run_soil(folder: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Soil of the model and the raw settings of the run."""
    meta = json.loads((folder / "mpm_d30_s2_meta.json").read_text())
    soil = {
        "peak_friction_deg": meta["phi_peak"],
        "residual_friction_deg": meta["phi_res"],
        "mobilization_length_mm": 1e3 * meta["slip_to_residual"],
    }
    return soil, meta


def measured(folder: Path) -> tuple[pd.DataFrame, dict[str, Any]]:
    """K against u of the run, smoothed, and its readings."""
    force = pd.read_csv(folder / "mpm_d30_s2_force.csv")
    u, K = 1e3 * force["u_m"].to_numpy(), force["P_front_over_half_gamma_d2"].to_numpy()
    grid = np.arange(0.0, u[-1], 0.1)
    smooth = np.array([K[np.abs(u - g) <= 0.5 * WINDOW_MM].mean() for g in grid])
    between = (grid >= SWITCH_MM[0]) & (grid <= SWITCH_MM[1])
    read = readings(grid, smooth, int(np.argmax(np.where(between, smooth, -np.inf))))
    read["first_peak_K"] = float(K[u < FIRST_MM].max())  # too sharp for the running mean
    beta = pd.read_csv(folder / "mpm_d30_s2_bands.csv")["inclination_deg"].to_numpy()
    change = int(np.argmax(np.diff(beta) < -10.0)) + 1
    place, level = (
        np.r_[u[u < FIRST_MM], grid[grid >= FIRST_MM]],
        np.r_[K[u < FIRST_MM], smooth[grid >= FIRST_MM]],
    )
    table = pd.DataFrame({"history": "material points", "u_mm": place, "K": level})
    return table, {"history": "material points", **read, "beta_0_deg": beta[0], "beta_1_deg": beta[change]}


def modelled(name: str, folder: Path) -> tuple[pd.DataFrame, dict[str, Any]]:
    """K against u of the model under one rule, and its readings.

    The rules that the model does not offer are run node by node (``by_nodes``).
    """
    soil, meta = run_soil(folder)
    travel = 1e3 * meta["u_end"]
    peak, residual, psi = meta["phi_peak"], meta["phi_res"], meta["psi_peak"]
    if "Davis" in name:
        soil["repose_deg"] = residual
        soil["peak_friction_deg"], soil["residual_friction_deg"] = davis(peak, psi), davis(residual, 0.0)
    # level sand: a fresh band leaves at 45 degrees less half the angle sought
    sought = {"softened": residual, "Arthur": 0.5 * (peak + psi)}
    angle = next((value for key, value in sought.items() if key in name), None)
    shipped = next((rule for rule in directions() if rule in name), None)
    if shipped or angle is None:
        scene = scene_of(soil, model={"direction": shipped} if shipped else {})
        history = simulate(scene, displacement_mm=travel)
        u, band = history.marched.rows[:, 0], history.marched.rows[:, 6]
        K = history.force["force_N"].to_numpy() / (0.5e-3 * GAMMA_KN_M3 * DEPTH_MM**2)
        beta = history.force["beta_deg"].to_numpy()
    else:
        u, P, tan_beta, band = by_nodes(NODE_MM, STEP_MM, travel_mm=travel, direction_deg=angle, soil=soil)
        K, beta = 2.0 * P / DEPTH_MM**2, np.degrees(np.arctan(tan_beta))
    starts = np.flatnonzero(np.diff(band, prepend=-1.0) > 0)
    row = {
        "history": name,
        **readings(u, K, int(starts[1])),
        "beta_0_deg": beta[0],
        "beta_1_deg": beta[starts[1]],
    }
    return pd.DataFrame({"history": name, "u_mm": u, "K": K})[drawn(band)], row


def davis(friction_deg: float, dilation_deg: float) -> float:
    """Friction on a plane of slip in sand whose dilation is less than its friction (Davis 1968), degrees."""
    phi, psi = math.radians(friction_deg), math.radians(dilation_deg)
    return math.degrees(math.atan(math.sin(phi) * math.cos(psi) / (1.0 - math.sin(phi) * math.sin(psi))))


def histories(folder: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """K against u of the run and of the model's rules, and what they read."""
    results = [measured(folder), *(modelled(name, folder) for name in RULES)]
    return pd.concat([table for table, _ in results]), pd.DataFrame([row for _, row in results])


def mobilised(folder: Path) -> pd.DataFrame:
    """Friction that balances the run's own blocks, from the particles above its band and the band's angle."""
    frames = np.load(folder / "mpm_d30_s2_frames.npz")
    force = pd.read_csv(folder / "mpm_d30_s2_force.csv")
    u, K = 1e3 * force["u_m"].to_numpy(), force["P_front_over_half_gamma_d2"].to_numpy()
    bands = pd.read_csv(folder / "mpm_d30_s2_bands.csv")
    area = (2e3 * float(frames["r"][0])) ** 2  # of one particle, mm2
    rows = []
    beta = bands["inclination_deg"].to_numpy()
    change = int(np.argmax(np.diff(beta) < -10.0)) + 1
    early = u < FIRST_MM
    switch = measured(folder)[1]
    events = [("first peak", 0, 0, float(K[early].max()), float(u[early][K[early].argmax()]))]
    for k, end in enumerate(bands["u1_m"]):
        level = float(K[np.abs(u - 1e3 * end) <= 0.5 * WINDOW_MM].mean())
        events.append(("between bands" if k == change - 1 else "", k + 1, k, level, 1e3 * float(end)))
    # the second band as it takes over: its inclination, the block of the frame before
    events.append(("second peak", change - 1, change, switch["switch_K"], switch["switch_u_mm"]))
    for event, frame, interval, level, place in events:
        angle = float(beta[interval])
        tip_x, _, tip_y = 1e3 * frames["blade"][frame]
        x, y = (1e3 * frames["xy"][frame] - [tip_x, tip_y]).T
        block = area * float(np.sum((x > 0.0) & (y > x * math.tan(math.radians(angle)))))
        balance = math.degrees(math.atan(level * 0.5 * DEPTH_MM**2 / block)) - angle
        row = {"event": event, "u_mm": place, "K": level, "beta_deg": angle, "block_mm2": block}
        rows.append({**row, "friction_deg": balance})
    return pd.DataFrame(rows)


def transient(folder: Path) -> dict[str, float]:
    """What speed can have added to the forces of the run, from a run at three times the speed."""
    _, meta = run_soil(folder)
    speed, depth = meta["v"], meta["depth"]
    faster, excess = 3.0, 0.26  # 60 mm/s instead of 20 mm/s: first peak 26 % higher
    return {
        "davis_peak_deg": davis(meta["phi_peak"], meta["psi_peak"]),
        "davis_residual_deg": davis(meta["phi_res"], 0.0),
        "faster_peak_excess_pct": 100.0 * excess,
        "steady_inertia_K": 2.0 * speed**2 / (9.81 * depth),
        "peak_excess_linear_pct": 100.0 * excess / (faster - 1.0),
        "peak_excess_square_pct": 100.0 * excess / (faster**2 - 1.0),
    }
