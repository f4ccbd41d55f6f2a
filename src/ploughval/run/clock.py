"""Blade displacement at each photograph: from the log, from the photographs themselves, or from the speed."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ploughval.scene import Scene

Floats = NDArray[np.float64]
MOVED = 0.02  # share of the whole travel beyond which the blade counts as moving
STRAY = 5.0  # robust standard deviations beyond which a frame does not count
LEAST_FRAMES = 4  # photographs from which offset and scale can be told
MOST_SCALE = 0.2  # share by which the travels in photographs and log differ at most, else they are not one


@dataclass(frozen=True, slots=True)
class Displacement:
    """Blade displacement of each frame."""

    u_mm: Floats  # (F,), NaN where unknown
    source: str  # "log", "photographs", "speed" or "unknown"
    clock_offset_s: float  # photograph clock minus log clock; NaN where no log
    clock_offset_std_s: float
    difference_rms_mm: float  # blade in the photographs minus log; NaN where either is missing
    scale: float = np.nan  # travel of the blade in the photographs over that in the log, and its std
    scale_std: float = np.nan


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
    offset_std = 0.0
    given = scene.camera.clock_offset_s if scene.camera is not None else 0.0
    log_time, log_u = log["time_s"].to_numpy(float), log["u_mm"].to_numpy(float)
    kept = np.isfinite(log_time) & np.isfinite(log_u)
    log_time, log_u = log_time[kept], log_u[kept]
    if log_time.size < 2:
        return None
    fit = find_clock_offset(time_s, blade_x_mm, log_time, log_u)
    if given == "auto":
        offset, offset_std = fit.offset_s, fit.offset_std_s
    else:
        offset = float(given)
    if not np.isfinite(offset):
        return None
    u = _interpolate(time_s - offset, log_time, log_u)
    difference = blade_x_mm - u
    known = np.isfinite(difference)
    rms = float(np.sqrt(np.mean(difference[known] ** 2))) if known.any() else np.nan
    return Displacement(u, "log", offset, offset_std, rms, fit.scale, fit.scale_std)


@dataclass(frozen=True, slots=True)
class ClockFit:
    """Photographs against the log: u in the photographs = scale x u in the log, offset_s later.

    Attributes
    ----------
    offset_s, offset_std_s : float
        Photograph clock minus log clock, and its standard deviation; NaN where nothing tells them.
    scale, scale_std : float
        Travel of the blade in the photographs over that in the log.
    """

    offset_s: float
    offset_std_s: float
    scale: float
    scale_std: float


MOST_OFFSETS = 1e6
"""Offsets, a quarter of an interval apart, that are tried; clocks further apart are not of one test."""
UNTOLD = ClockFit(np.nan, np.nan, np.nan, np.nan)


def find_clock_offset(time_s: Floats, blade_x_mm: Floats, log_time_s: Floats, log_u_mm: Floats) -> ClockFit:
    """Offset of the photographs' clock from the log's, from the blade seen in both.

    The scale is fitted with it: a scale that is wrong by 1 % would else move the clocks apart by 1 % of
    half the travel's time.

    Parameters
    ----------
    time_s, blade_x_mm : (F,) float, s and mm
        Photographs: time by the camera's clock and blade face (NaN where not found).
    log_time_s, log_u_mm : (K,) float, s and mm
        Log, in order of time.

    Returns
    -------
    ClockFit
        Least squares over the frames, strays left out; NaN where nothing moves in
        either, or where no offset brings the two together.
    """
    known = np.isfinite(time_s) & np.isfinite(blade_x_mm)
    t, x = time_s[known], blade_x_mm[known]
    travel = float(np.ptp(log_u_mm)) if len(log_u_mm) else 0.0
    if len(t) < LEAST_FRAMES or travel <= 0 or np.ptp(x) <= MOVED * travel:
        return UNTOLD

    def read(offset: float) -> Floats:
        return np.interp(t - offset, log_time_s, log_u_mm)

    def misfit(offset: float, weight: Floats) -> float:
        u = read(offset)
        return float(np.sum(weight * (x - _scale(u, x, weight) * u) ** 2))

    even, step = np.ones(len(t)), float(np.median(np.diff(t))) / 4
    if not float(np.ptp(t) + np.ptp(log_time_s)) < MOST_OFFSETS * step:
        return UNTOLD
    coarse = np.arange(t[0] - log_time_s[-1], t[-1] - log_time_s[0] + step, step)
    offset, weight = float(coarse[int(np.argmin([misfit(float(c), even) for c in coarse]))]), even
    for _ in range(4):
        bounds = (offset - 2 * step, offset + 2 * step)
        found = minimize_scalar(
            misfit, args=(weight,), bounds=bounds, method="bounded", options={"xatol": 1e-6}
        )
        offset = float(found.x)
        u = read(offset)
        scale = _scale(u, x, weight)
        rest = x - scale * u
        weight = (np.abs(rest) <= STRAY * max(1.4826 * float(np.median(np.abs(rest))), 1e-9)).astype(float)
    if abs(scale - 1) > MOST_SCALE:
        return UNTOLD
    speed = -scale * _slope(read, offset, step / 50)
    offset_std, scale_std = _stds(np.column_stack([speed, u]), rest, weight)
    return ClockFit(offset, offset_std, scale, scale_std)


def _scale(u: Floats, x: Floats, weight: Floats) -> float:
    """Factor on u that fits x best."""
    square = float(np.sum(weight * u * u))
    return float(np.sum(weight * u * x)) / square if square > 0 else 1.0


def _slope(read: Callable[[float], Floats], offset: float, step: float) -> Floats:
    """Rate of the log's displacement at each photograph, mm/s."""
    return (read(offset - step) - read(offset + step)) / (2 * step)


def _stds(jacobian: Floats, rest: Floats, weight: Floats) -> tuple[float, float]:
    """Standard deviations of offset and scale from the residuals' own scatter; NaN where not fixed."""
    normal = jacobian.T @ (weight[:, None] * jacobian)
    if np.linalg.matrix_rank(normal) < len(normal):
        return np.nan, np.nan
    variance = float(np.sum(weight * rest**2)) / max(float(weight.sum()) - len(normal), 1.0)
    offset_std, scale_std = np.sqrt(variance * np.diag(np.linalg.inv(normal)))
    return float(offset_std), float(scale_std)


def _interpolate(t: Floats, log_time_s: Floats, log_u_mm: Floats) -> Floats:
    """Log displacement at times t; NaN outside the log."""
    return np.interp(t, log_time_s, log_u_mm, left=np.nan, right=np.nan)
