"""Friction mobilised on the band from measured force, surface and band: the mechanism (eq. 1) inverted."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.force.curve import Curve
from ploughval.scene import Scene, Soil

Floats = NDArray[np.float64]
MOBILISED_COLUMNS = (
    "frame", "u_mm", "band", "slip_mm", "phi_deg", "phi_std_deg", "beta_deg", "weight_N", "force_N", "status",
)  # fmt: skip
_GAP_DEPTHS = 0.1  # a hole in the measured surface wider than this leaves the weight unknown


@dataclass(frozen=True, slots=True)
class _Block:
    beta_deg: float
    weight_N: float


def mobilised_friction(
    force_N: float | Floats,
    weight_N: float | Floats,
    beta_deg: float | Floats,
    wall_friction_deg: float = 0.0,
) -> Floats:
    """Friction angle at which a block of a weight on a band slides under the blade's force P, in degrees.

    Equilibrium of the block, P = W t / (cos phi_w - sin phi_w t) with t = tan(beta + phi), solved:
    t = P cos phi_w / (W + P sin phi_w). The paper's eq. (1) prints beta + phi_w in the denominator;
    equilibrium has beta + phi there.

    >>> float(mobilised_friction(10.0, 10.0, 20.0).round(9))
    25.0
    """
    wall = np.radians(wall_friction_deg)
    P, W = np.asarray(force_N, dtype=np.float64), np.asarray(weight_N, dtype=np.float64)
    return np.asarray(np.degrees(np.arctan2(P * np.cos(wall), W + P * np.sin(wall))) - beta_deg)


def mobilised_table(scene: Scene, force: Curve, bands: pd.DataFrame, surface: pd.DataFrame) -> pd.DataFrame:
    """Mobilised friction for every frame with a measured surface.

    The band's outcrop keeps its place in the box, so that the inclination in a frame follows from the
    outcrop, the height of the measured surface there and the tip.

    Parameters
    ----------
    scene : Scene
        Soil (unit weight, wall friction) and blade (width, depth).
    force : Curve
        Measured force.
    bands : DataFrame
        BAND_COLUMNS, measured.
    surface : DataFrame
        SURFACE_COLUMNS, measured; rows of NaN are holes.

    Returns
    -------
    DataFrame
        MOBILISED_COLUMNS; NaN where any part is missing, and ``status`` names it: ok, no_band, no_force,
        no_surface. ``phi_std_deg`` holds force, outcrop and unit weight.
    """
    soil = scene.soil
    if soil is None:
        raise ValueError("mobilised friction needs [soil]")
    rows = []
    for frame, part in surface.groupby("frame", sort=True):
        u = float(part["u_mm"].iloc[0])
        line = part[["x_mm", "y_mm"]].to_numpy(dtype=np.float64)
        rows.append((frame, u, *_one_frame(scene, soil, force, bands, line, u)))
    columns = [name for name in MOBILISED_COLUMNS if name != "slip_mm"]
    table = pd.DataFrame(rows, columns=columns)
    table["slip_mm"] = _slip(table, bands)
    return table[list(MOBILISED_COLUMNS)]


def _one_frame(
    scene: Scene, soil: Soil, force: Curve, bands: pd.DataFrame, line: Floats, u: float
) -> tuple[float, float, float, float, float, float, str]:
    """Band, phi, its std, beta, weight, force and status of one frame."""
    nan = float("nan")
    P, P_std = (float(v[0]) / soil.horizontal_share for v in force.at(np.array([u])))
    active = bands[(bands["u_start_mm"] <= u) & (u <= bands["u_end_mm"])]
    if len(active) == 0 or not np.isfinite(active["outcrop_x_mm"].iloc[-1]):
        return nan, nan, nan, nan, nan, P, "no_band"
    band = active.iloc[-1]
    number, x_out, x_std = float(band["band"]), float(band["outcrop_x_mm"]), float(band["outcrop_std_mm"])
    block = _block(scene, soil, line, u, x_out)
    if block is None:
        return number, nan, nan, nan, nan, P, "no_surface"
    if not np.isfinite(P):
        return number, nan, nan, block.beta_deg, block.weight_N, nan, "no_force"
    wall = soil.wall_friction_deg
    phi = float(mobilised_friction(P, block.weight_N, block.beta_deg, wall))
    heavier = block.weight_N * (1 + soil.unit_weight_std_kN_m3 / soil.unit_weight_kN_m3)
    parts = [
        float(mobilised_friction(P + P_std, block.weight_N, block.beta_deg, wall)) - phi,
        float(mobilised_friction(P, heavier, block.beta_deg, wall)) - phi,
    ]
    moved = _block(scene, soil, line, u, x_out - x_std) if np.isfinite(x_std) else None
    parts.append(
        nan if moved is None else float(mobilised_friction(P, moved.weight_N, moved.beta_deg, wall)) - phi
    )
    std = float(np.sqrt(np.sum(np.square(parts))))
    return number, phi, std, block.beta_deg, block.weight_N, P, "ok"


def _block(scene: Scene, soil: Soil, line: Floats, u: float, outcrop_x: float) -> _Block | None:
    """Sand between face, band and surface; None where the surface has a hole or the band no length."""
    allowed = _GAP_DEPTHS * scene.blade.depth_mm
    line = line[np.isfinite(line).all(axis=1)]
    line = line[np.argsort(line[:, 0], kind="stable")]
    if len(line) < 2 or outcrop_x <= u:
        return None
    x = line[:, 0]
    inner = np.diff(x)[(x[1:] > u) & (x[:-1] < outcrop_x)]
    if max(x[0] - u, outcrop_x - x[-1], *inner) > allowed:
        return None
    stations = np.concatenate([[u], x[(x > u) & (x < outcrop_x)], [outcrop_x]])
    heights = np.interp(stations, line[:, 0], line[:, 1])
    beta = np.arctan2(heights[-1], outcrop_x - u)
    above = heights - (stations - u) * np.tan(beta)
    area = float(np.trapezoid(above, stations))
    load = soil.surcharge_kPa * 1e-3 * (outcrop_x - u)  # kPa = 1e-3 N/mm2, per horizontal area
    weight = (soil.unit_weight_kN_m3 * 1e-6 * area + load) * scene.blade.width_mm  # kN/m3 = 1e-6 N/mm3
    return _Block(float(np.degrees(beta)), weight) if area > 0 and beta > 0 else None


def _slip(table: pd.DataFrame, bands: pd.DataFrame) -> Floats:
    """Slip gathered on the active band since it began, mm: the integral of du / cos beta over its frames."""
    slip = np.full(len(table), np.nan)
    starts = bands.set_index("band")["u_start_mm"]
    for band, part in table[table["beta_deg"].notna()].groupby("band", sort=True):
        u = part["u_mm"].to_numpy(dtype=np.float64)
        rate = 1 / np.cos(np.radians(part["beta_deg"].to_numpy(dtype=np.float64)))
        first = (u[0] - float(starts.loc[band])) * rate[0]
        steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(u)
        slip[part.index.to_numpy()] = np.cumsum(np.append(first, steps))
    return slip
