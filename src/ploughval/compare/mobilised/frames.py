"""Friction mobilised in every photograph: band, surface and force at its moment."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.force.curve import Curve
from ploughval.compare.mobilised.curve import seen_blocks
from ploughval.compare.mobilised.inversion import mobilised_friction, slip_rate
from ploughval.compare.mobilised.outcrop import Outcrop, outcrop_of
from ploughval.compare.mobilised.sources import incline_deg, input_stds, respond, weight_of
from ploughval.compare.mobilised.surface import SeenSurface, seen_surface
from ploughval.compare.mobilised.track import track_block
from ploughval.scene import Scene

Floats = NDArray[np.float64]
MOBILISED_COLUMNS = (
    "frame", "u_mm", "band", "slip_mm", "phi_deg", "phi_std_deg", "beta_deg", "weight_N", "force_N", "status",
)  # fmt: skip


def mobilised_table(
    scene: Scene,
    force: Curve,
    bands: pd.DataFrame,
    surface: pd.DataFrame,
    origins_mm: Mapping[int, float] | None = None,
    increments: pd.DataFrame | None = None,
) -> pd.DataFrame:
    """Mobilised friction for every frame with a measured surface.

    The band's outcrop keeps its place in the box, so that the inclination in a frame follows from the
    outcrop, the height of the measured surface there and the tip.

    Parameters
    ----------
    scene : Scene
        Soil (unit weight, wall friction), blade (width, depth) and their uncertainties.
    force : Curve
        Measured force.
    bands : DataFrame
        BAND_COLUMNS, measured.
    surface : DataFrame
        SURFACE_COLUMNS, measured, and std_mm where it is known; rows of NaN are holes.
    origins_mm : mapping of int to float, mm, or None
        Travel at which the slip of a band began, by its number, where that is better known than its start.
    increments : DataFrame or None
        INCREMENT_COLUMNS, which show whether an outcrop creeps.

    Returns
    -------
    DataFrame
        MOBILISED_COLUMNS; NaN where any part is missing, and ``status`` names it: ok, no_band, no_force,
        no_surface, changing (the force at this photograph may be of two bands). ``phi_std_deg`` holds every
        source of docs/theory-mobilised.md, section 3.
    """
    if scene.soil is None:
        raise ValueError("mobilised friction needs [soil]")
    seen = seen_surface(surface)
    table = pd.DataFrame({"frame": seen.frames, "u_mm": seen.u_mm})
    for name in MOBILISED_COLUMNS[2:-1]:
        table[name] = np.nan
    table["force_N"] = force.at(seen.u_mm)[0] / np.cos(np.radians(incline_deg(scene, scene.soil)))
    table["status"] = "no_band"
    active = _active(seen.u_mm, bands)
    for row in range(len(bands)):
        outcrop = outcrop_of(bands.iloc[row], increments)
        _fill(table, scene, force, bands.iloc[row], outcrop, (seen, active == row))
    began = dict(zip(bands["band"].astype(int).tolist(), bands["u_start_mm"].tolist(), strict=True))
    origins = began | dict(origins_mm or {})
    table["slip_mm"] = _slip(table, origins, scene.blade.inclination_deg)
    changing = _changing(seen.u_mm, began, origins, force.step_mm) & (table["status"] == "ok").to_numpy()
    table.loc[changing, "status"] = "changing"
    table.loc[changing, ["phi_deg", "phi_std_deg"]] = np.nan
    return table[list(MOBILISED_COLUMNS)]


def _active(u_mm: Floats, bands: pd.DataFrame) -> NDArray[np.int64]:
    """Row of the band that is active at each travel, -1 where there is none with an outcrop."""
    active = np.full(len(u_mm), -1)
    outcrops = bands["outcrop_x_mm"].to_numpy(dtype=np.float64)
    for row, (start, end) in enumerate(bands[["u_start_mm", "u_end_mm"]].itertuples(index=False, name=None)):
        active[(start <= u_mm) & (u_mm <= end)] = row if np.isfinite(outcrops[row]) else -1
    return active


def _changing(
    u_mm: Floats, began: Mapping[int, float], origins: Mapping[int, float], step_mm: float
) -> NDArray[np.bool_]:
    """Frames between the start of a band in photographs and in the force, or within a step of the force."""
    changing = np.zeros(len(u_mm), bool)
    first = min(began.values(), default=np.nan)
    for band, start in began.items():
        if start > first:
            low, high = sorted((start, origins[band]))
            changing |= (u_mm > low - step_mm) & (u_mm < high + step_mm)
    return changing


def _fill(
    table: pd.DataFrame,
    scene: Scene,
    force: Curve,
    band: pd.Series,
    outcrop: Outcrop,
    seen: tuple[SeenSurface, NDArray[np.bool_]],
) -> None:
    """Write what is known of the frames in which a band is active."""
    soil = scene.soil
    rows, part = np.flatnonzero(seen[1]), seen[0].part(seen[1])
    if soil is None or not rows.size:
        return
    table.loc[rows, "band"] = float(band["band"])
    table.loc[rows, "status"] = "no_surface"
    u, blocks = seen_blocks(scene, part, outcrop, (-np.inf, np.inf))
    if not blocks:
        return
    known = rows[np.isin(part.u_mm, u)]
    track = track_block(u, u, blocks, outcrop.at(u), float("nan"))
    F, _ = force.at(u)
    noise = np.interp(u, force.u_mm, force.noise_std_N)
    weight, beta, incline = weight_of(scene, soil, track), track.beta_deg, incline_deg(scene, soil)
    stds = input_stds(scene, soil, force, seen[0], float(band["outcrop_std_mm"]))
    phi = mobilised_friction(F / np.cos(np.radians(incline)), weight, beta, incline)
    std = respond(scene, soil, stds, track, (F, noise)).std
    table.loc[known, "beta_deg"], table.loc[known, "weight_N"] = beta, weight
    table.loc[known, "phi_deg"], table.loc[known, "phi_std_deg"] = (
        phi,
        np.where(np.isfinite(phi), std, np.nan),
    )
    table.loc[known, "status"] = np.where(np.isfinite(F), "ok", "no_force")


def _slip(table: pd.DataFrame, starts: Mapping[int, float], inclination_deg: float) -> Floats:
    """Slip gathered on the active band since it began, mm: the integral over its frames."""
    slip = np.full(len(table), np.nan)
    for number, start in starts.items():
        part = table[(table["band"] == number) & table["beta_deg"].notna()]
        if part.empty:
            continue
        u = part["u_mm"].to_numpy(dtype=np.float64)
        rate = slip_rate(part["beta_deg"].to_numpy(dtype=np.float64), inclination_deg)
        steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(u)
        slip[part.index.to_numpy()] = np.cumsum(np.append((u[0] - start) * rate[0], steps))
    return slip
