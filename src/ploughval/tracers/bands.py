"""Shear bands from the motion between photographs: a moving block, still sand, a line through the tip."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import xarray as xr

from ploughval.axes import BAND_COLUMNS, INCREMENT_COLUMNS, Status
from ploughval.scene import Scene
from ploughval.tracers.episodes import Episode, divide
from ploughval.tracers.line import BandLine, fit_line
from ploughval.tracers.view import Floats

NO_BAND = -1
_BETWEEN = 0.25  # of the angle between two lines: sand nearer to either may have moved with both
_LEAST_BETWEEN = 4  # points between two lines that place a switch
_LEAST_SHARE_STD = 0.02  # of an increment: better than this a switch is not placed
_LEAST_TRAVEL_STDS = 5.0  # travel of an increment, in standard deviations of a point's motion


@dataclass(frozen=True, slots=True, eq=False)
class BandFindings:
    """Shear bands of a test.

    Attributes
    ----------
    bands : DataFrame of BAND_COLUMNS
        One row a band; beta and outcrop are those at its start. Empty without bands.
    increments : DataFrame
        INCREMENT_COLUMNS. frame and u_mm are those of the increment's start, beta and outcrop those
        half-way through it; band is -1 where the increment belongs to none, NaN values could not be had.
    """

    bands: pd.DataFrame
    increments: pd.DataFrame


def find_bands(tracks: xr.Dataset, surface: pd.DataFrame, scene: Scene) -> BandFindings:
    """Shear bands from the increments of motion between successive photographs.

    Parameters
    ----------
    tracks : Dataset
        As in tracks.nc; points whose status is not OK are left out.
    surface : DataFrame
        SURFACE_COLUMNS, and std_mm where it is known: the free surface, on which a band comes out.
    scene : Scene
        [bands] and the depth of the blade.

    Returns
    -------
    BandFindings
    """
    pairs = _pairs(tracks)
    rows = [_increment(tracks, surface, scene, a, b) for a, b in pairs]
    table = pd.DataFrame(rows, columns=[*INCREMENT_COLUMNS[:-1], "outcrop_y_mm"], dtype=np.float64)
    episodes = divide(table, least_slip_mm=scene.bands.min_slip_mm, depth_mm=scene.blade.depth_mm)
    band = np.full(len(table), NO_BAND)
    for number, episode in enumerate(episodes):
        band[episode.rows] = number
    table["band"] = band
    starts = [_start(tracks, pairs, table, episodes, number) for number in range(len(episodes))]
    episodes = [_as_it_began(tracks, pairs, surface, episode) for episode in episodes]
    bands = pd.DataFrame(
        [_band(number, table, episodes, starts) for number in range(len(episodes))],
        columns=list(BAND_COLUMNS),
    )
    return BandFindings(bands.astype({"band": int}), table[list(INCREMENT_COLUMNS)])


def _start(
    tracks: xr.Dataset,
    pairs: list[tuple[int, int]],
    table: pd.DataFrame,
    episodes: list[Episode],
    number: int,
) -> tuple[float, float]:
    """Displacement at which a band began, and its std, mm.

    Sand between the lines of two bands rests until the new one takes over: how far it moves in the last
    increment of the old band and the first of the new is the travel that was left after the switch.
    """
    rows = table.loc[[*episodes[number - 1].rows[-1:], episodes[number].rows[0]]] if number else None
    first = table.loc[episodes[number].rows[0]]
    u0, du = float(first["u_mm"]), float(first["du_mm"])
    if rows is None:
        return u0, 0.0
    found = [
        _moved_between(
            *_motion(tracks, *pairs[index])[:2], float(row["u_mm"] + row["du_mm"] / 2), episodes, number
        )
        for index, (_, row) in zip(rows.index.tolist(), rows.iterrows(), strict=True)
    ]
    if not np.isfinite(found).all() or len(episodes[number].rows) == 1:
        return u0 + du / 2, du / np.sqrt(12.0)
    left, std = np.sum(found, axis=0)
    least = float(rows["u_mm"].iloc[0])
    return float(np.clip(u0 + du - left, least, u0 + du)), max(float(std), _LEAST_SHARE_STD * du)


def _moved_between(
    place: Floats, moved: Floats, tip: float, episodes: list[Episode], number: int
) -> tuple[float, float]:
    """Median horizontal motion of sand between a band's line and the one before, and its std, mm."""
    angle = np.arctan2(place[:, 1], place[:, 0] - tip)
    old, new = (np.arctan2(e.outcrop_y_mm, e.outcrop_x_mm - tip) for e in episodes[number - 1 : number + 1])
    margin = _BETWEEN * (old - new)
    motion = moved[(angle > new + margin) & (angle < old - margin) & (place[:, 0] > tip), 0]
    if len(motion) < _LEAST_BETWEEN:
        return np.nan, np.nan
    middle = float(np.median(motion))
    return middle, 1.4826 * float(np.median(np.abs(motion - middle))) / np.sqrt(len(motion))


def _as_it_began(
    tracks: xr.Dataset, pairs: list[tuple[int, int]], surface: pd.DataFrame, episode: Episode
) -> Episode:
    """The band with the height of its outcrop in the last photograph before it moved anything."""
    frame = _number(tracks, pairs[episode.rows[0]][0])
    line = surface[surface["frame"] == frame].dropna(subset=["x_mm", "y_mm"])
    line = line.sort_values("x_mm", kind="stable")
    y = _height(line[["x_mm", "y_mm"]].to_numpy(float), episode.outcrop_x_mm)
    if not np.isfinite(y):
        return episode
    std = float(np.interp(episode.outcrop_x_mm, line["x_mm"], line["std_mm"])) if "std_mm" in line else 0.0
    return replace(episode, outcrop_y_mm=y, outcrop_y_std_mm=std)


def _band(
    number: int, table: pd.DataFrame, episodes: list[Episode], starts: list[tuple[float, float]]
) -> tuple[float, ...]:
    """One row of BAND_COLUMNS."""
    episode, (start, start_std) = episodes[number], starts[number]
    rows = table.loc[episode.rows]
    last = rows.iloc[-1]
    end = float(last["u_mm"] + last["du_mm"])
    if number + 1 < len(episodes):
        after = table.loc[episodes[number + 1].rows[0]]
        if after["u_mm"] <= end + 1e-9:  # nothing between: it ends where the next begins
            end = starts[number + 1][0]
    x, y = episode.outcrop_x_mm, episode.outcrop_y_mm
    beta = np.degrees(np.arctan2(y, x - start))
    along, up = np.hypot(episode.outcrop_std_mm, start_std), episode.outcrop_y_std_mm
    beta_std = np.degrees(np.hypot(y * along, (x - start) * up) / (y**2 + (x - start) ** 2))
    first = rows.iloc[0]
    slip = float(rows["slip_mm"].sum())
    slip -= (start - first["u_mm"]) / first["du_mm"] * first["slip_mm"]  # what was the other band's
    slip += (end - last["u_mm"] - last["du_mm"]) / last["du_mm"] * last["slip_mm"]
    return (number, start, end, beta, beta_std, x, episode.outcrop_std_mm, slip)


def _pairs(tracks: xr.Dataset) -> list[tuple[int, int]]:
    """Successive frames in which blade and points were seen."""
    seen = np.isfinite(tracks["u_mm"].to_numpy()) & np.isfinite(tracks["x_mm"].to_numpy()).any(axis=1)
    frames = np.flatnonzero(seen)
    return list(zip(frames[:-1].tolist(), frames[1:].tolist(), strict=True))


def _increment(
    tracks: xr.Dataset, surface: pd.DataFrame, scene: Scene, first: int, last: int
) -> tuple[float, ...]:
    """One row of the table of increments, and the height of the outcrop."""
    u0, u1 = (float(tracks["u_mm"].to_numpy()[k]) for k in (first, last))
    frame = _number(tracks, first)
    place, moved, noise = _motion(tracks, first, last)
    line = None
    tip = (u0 + u1) / 2
    ahead = place[:, 0] > tip
    if u1 - u0 > _LEAST_TRAVEL_STDS * noise and ahead.sum() >= 8:
        line = fit_line(place[ahead] - [tip, 0.0], moved[ahead, 0] / (u1 - u0), noise / (u1 - u0))
    if line is None:
        return (frame, u0, u1 - u0, *[np.nan] * 5, np.nan)
    ends = [_outcrop(_line_of(surface, tracks, k), tip, line) for k in (first, last)]
    x, std = np.mean(ends, axis=0)
    y = _height(_line_of(surface, tracks, first), x)
    slip = (u1 - u0) / np.cos(np.radians(line.beta_deg))
    return (frame, u0, u1 - u0, line.beta_deg, line.std_deg, x, std, slip, y)


def _motion(tracks: xr.Dataset, first: int, last: int) -> tuple[Floats, Floats, float]:
    """Mean places (N, 2), motions (N, 2) and their typical std, mm, of points seen in both frames."""
    x, y = tracks["x_mm"].to_numpy(), tracks["y_mm"].to_numpy()
    ok = np.isin(tracks["status"].to_numpy()[[first, last]], (Status.OK, Status.REPLACED)).all(axis=0)
    before, after = (np.column_stack([x[k], y[k]]) for k in (first, last))
    good = ok & np.isfinite(before).all(axis=1) & np.isfinite(after).all(axis=1)
    before, after = before[good], after[good]
    std = tracks["std_mm"].to_numpy()[last, good]
    noise = float(np.nanmedian(std)) * np.sqrt(2) if np.isfinite(std).any() else 0.0
    return (before + after) / 2, after - before, noise


def _number(tracks: xr.Dataset, index: int) -> int:
    """Number of the frame that stands at a place in the tracks."""
    return int(tracks["frame"].to_numpy()[index]) if "frame" in tracks.coords else index


def _line_of(surface: pd.DataFrame, tracks: xr.Dataset, index: int) -> Floats:
    """Free surface in one frame, (M, 2) mm, in order of x."""
    seen = surface.loc[surface["frame"] == _number(tracks, index), ["x_mm", "y_mm"]].dropna()
    return seen.sort_values("x_mm", kind="stable").to_numpy(float)


def _height(surface: Floats, x_mm: float) -> float:
    """Height of the surface at a place, mm; NaN where it was not seen."""
    return (
        float(np.interp(x_mm, surface[:, 0], surface[:, 1], left=np.nan, right=np.nan))
        if len(surface)
        else np.nan
    )


def _outcrop(surface: Floats, tip: float, line: BandLine) -> tuple[float, float]:
    """Where the line leaves the sand: x and its std, mm; NaN where the surface was not seen."""
    x, y = surface.T
    slope = np.tan(np.radians(line.beta_deg))
    over = y - (x - tip) * slope
    out = np.flatnonzero((over[:-1] >= 0) & (over[1:] < 0) & (x[1:] > tip))
    if len(out) == 0:
        return np.nan, np.nan
    k = int(out[0])
    part = over[k] / (over[k] - over[k + 1])
    at = x[k] + part * (x[k + 1] - x[k])
    surface_slope = (y[k + 1] - y[k]) / (x[k + 1] - x[k])
    turn = np.radians(line.std_deg) * (at - tip) * (1 + slope**2)
    return float(at), float(turn / max(slope - surface_slope, 0.05))
