"""Blade displacement at each photograph: from the log, from the photographs themselves, or from the speed."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ploughval.scene import Scene

Floats = NDArray[np.float64]
MOVED = 0.02  # share of the whole travel beyond which the blade counts as moving


@dataclass(frozen=True, slots=True)
class Displacement:
    """Blade displacement of each frame."""

    u_mm: Floats  # (F,), NaN where unknown
    source: str  # "log", "photographs", "speed" or "unknown"
    clock_offset_s: float  # photograph clock minus log clock; NaN where no log
    clock_offset_std_s: float
    difference_rms_mm: float  # blade in the photographs minus log; NaN where either is missing


def frame_displacement(
    scene: Scene, time_s: Floats, blade_x_mm: Floats, log: pd.DataFrame | None
) -> Displacement:
    """Blade displacement at each photograph.

    Parameters
    ----------
    scene : Scene
        Gives the clock offset and the blade's speed.
    time_s : (F,) float, s
        Times of the photographs by the camera's clock, NaN where unknown.
    blade_x_mm : (F,) float, mm
        Blade face found in the photographs, NaN where not found.
    log : DataFrame or None
        Columns time_s and u_mm of the load cells' log.

    Returns
    -------
    Displacement
        From the log where there is one and the times are known; else from the photographs;
        else from the speed.
    """
    timed = bool(np.isfinite(time_s).any())
    if log is not None and timed and len(log) > 1:
        found = _from_log(scene, time_s, blade_x_mm, log)
        if found is not None:
            return found
    if np.isfinite(blade_x_mm).any():
        start = blade_x_mm[np.isfinite(blade_x_mm)][0]
        return Displacement(blade_x_mm - start, "photographs", np.nan, np.nan, np.nan)
    if timed and scene.blade.speed_mm_s is not None:
        elapsed = time_s - time_s[np.isfinite(time_s)][0]
        return Displacement(elapsed * scene.blade.speed_mm_s, "speed", np.nan, np.nan, np.nan)
    return Displacement(np.full(len(time_s), np.nan), "unknown", np.nan, np.nan, np.nan)


def _from_log(scene: Scene, time_s: Floats, blade_x_mm: Floats, log: pd.DataFrame) -> Displacement | None:
    """From the log, or None where the clocks cannot be brought together."""
    offset, offset_std = 0.0, 0.0
    given = scene.camera.clock_offset_s if scene.camera is not None else 0.0
    log_time, log_u = log["time_s"].to_numpy(float), log["u_mm"].to_numpy(float)
    kept = np.isfinite(log_time) & np.isfinite(log_u)
    log_time, log_u = log_time[kept], log_u[kept]
    if given == "auto":
        offset, offset_std = find_clock_offset(time_s, blade_x_mm, log_time, log_u)
    else:
        offset = float(given)
    if not np.isfinite(offset):
        return None
    u = _interpolate(time_s - offset, log_time, log_u)
    difference = blade_x_mm - u
    known = np.isfinite(difference)
    rms = float(np.sqrt(np.mean(difference[known] ** 2))) if known.any() else np.nan
    return Displacement(u, "log", offset, offset_std, rms)


def find_clock_offset(
    time_s: Floats, blade_x_mm: Floats, log_time_s: Floats, log_u_mm: Floats
) -> tuple[float, float]:
    """Offset of the photographs' clock from the log's, from the blade seen in both.

    Parameters
    ----------
    time_s, blade_x_mm : (F,) float, s and mm
        Photographs: time by the camera's clock and blade face (NaN where not found).
    log_time_s, log_u_mm : (K,) float, s and mm
        Log, in order of time.

    Returns
    -------
    offset_s, std_s : float
        Photograph clock minus log clock, least squares over the frames in motion, and its standard
        deviation; NaN where nothing moves in either.
    """
    known = np.isfinite(time_s) & np.isfinite(blade_x_mm)
    t, x = time_s[known], blade_x_mm[known]
    travel = float(np.ptp(log_u_mm)) if len(log_u_mm) else 0.0
    if len(t) < 3 or travel <= 0 or np.ptp(x) <= MOVED * travel:
        return np.nan, np.nan

    def misfit(offset: float) -> float:
        u = np.interp(t - offset, log_time_s, log_u_mm)
        return float(np.mean((x - u) ** 2))

    span = (t[0] - log_time_s[-1], t[-1] - log_time_s[0])
    step = float(np.median(np.diff(t))) / 4
    coarse = np.arange(span[0], span[1] + step, step)
    best = coarse[int(np.argmin([misfit(float(value)) for value in coarse]))]
    found = minimize_scalar(
        misfit, bounds=(best - 2 * step, best + 2 * step), method="bounded", options={"xatol": 1e-6}
    )
    offset = float(found.x)
    speed = np.gradient(np.interp(t - offset, log_time_s, log_u_mm), t)
    information = float(np.sum(speed**2))
    std = np.sqrt(found.fun * len(t) / max(len(t) - 1, 1) / information) if information > 0 else np.nan
    return offset, float(std)


def _interpolate(t: Floats, log_time_s: Floats, log_u_mm: Floats) -> Floats:
    """Log displacement at times t; NaN outside the log."""
    return np.interp(t, log_time_s, log_u_mm, left=np.nan, right=np.nan)
