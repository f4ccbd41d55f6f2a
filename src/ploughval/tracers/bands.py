"""Shear bands from the motion between photographs: a moving block, still sand, a line through the tip."""

import logging
from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr

from ploughval.axes import BAND_COLUMNS, INCREMENT_COLUMNS
from ploughval.scene import Scene
from ploughval.tracers.episodes import Episode, divide
from ploughval.tracers.increment import Motion, frame_number, motion_of, pairs_of
from ploughval.tracers.line import BandLine, fit_line
from ploughval.tracers.mechanism import Mechanism, judge
from ploughval.tracers.outcrop import NO_SURFACE, height, lines_of, outcrop
from ploughval.tracers.scatter import common_scale, widened
from ploughval.tracers.switches import as_it_began, start_of
from ploughval.tracers.view import Floats

log = logging.getLogger(__name__)

NO_BAND = -1
_HIDDEN = (2, 0.1)  # increments with a band and no outcrop, at least, and of those with a band: said
_LEAST_TRAVEL_STDS = 5.0  # travel of an increment, in standard deviations of a point's motion
_LEAST_POINTS = 8
_LEAST_INCREMENTS = 5  # that tell how well the blade's displacement is known


@dataclass(frozen=True, slots=True, eq=False)
class BandFindings:
    """Shear bands of a test.

    Attributes
    ----------
    bands : DataFrame of BAND_COLUMNS
        One row a band; beta and outcrop are those at its start. Empty without bands.
    increments : DataFrame
        INCREMENT_COLUMNS. frame and u_mm are those of the increment's start, beta and outcrop those
        half-way through it, velocity the block's for a millimetre of the blade's travel; band is -1 where the
        increment belongs to none, NaN values could not be had, nor an empty mechanism be told.
    """

    bands: pd.DataFrame
    increments: pd.DataFrame


def find_bands(tracks: xr.Dataset, surface: pd.DataFrame, scene: Scene) -> BandFindings:
    """Shear bands from the increments of motion between successive photographs.

    Parameters
    ----------
    tracks : Dataset
        As in tracks.nc; points whose status is not OK have no motion.
    surface : DataFrame
        SURFACE_COLUMNS, and std_mm where it is known: the free surface, on which a band comes out.
    scene : Scene
        [bands], the depth of the blade, and the side of a subset.

    Returns
    -------
    BandFindings
    """
    pairs = pairs_of(tracks)
    motions = [motion_of(tracks, scene, a, b) for a, b in pairs]
    lines = lines_of(surface)
    rows = [_increment(tracks, lines, pair, motion) for pair, motion in zip(pairs, motions, strict=True)]
    table = _with_scatter(_with_displacement_std(pd.DataFrame(rows, columns=_COLUMNS).astype(_TYPES)))
    episodes = divide(table, least_slip_mm=scene.bands.min_slip_mm, depth_mm=scene.blade.depth_mm)
    band = np.full(len(table), NO_BAND)
    for number, episode in enumerate(episodes):
        band[episode.rows] = number
    table["band"] = band
    _say_hidden(table)
    _scale_stds(table)
    starts = [start_of(motions, table, episodes, number) for number in range(len(episodes))]
    _name_switches(table, [start for start, _ in starts[1:]])
    began = [as_it_began(e, lines.get(int(table["frame"].loc[e.rows[0]]), NO_SURFACE)) for e in episodes]
    bands = pd.DataFrame(
        [_band(number, table, began, starts) for number in range(len(episodes))], columns=list(BAND_COLUMNS)
    )
    return BandFindings(bands.astype({"band": int}), table[list(INCREMENT_COLUMNS)])


def _say_hidden(table: pd.DataFrame) -> None:
    """Bands that come out where no surface is seen are in no row of the bands: said."""
    seen = table["beta_deg"].notna()
    hidden = int((seen & table["outcrop_x_mm"].isna() & (table["band"] == NO_BAND)).sum())
    if hidden >= _HIDDEN[0] and hidden >= _HIDDEN[1] * seen.sum():
        log.warning(
            "bands: in %d of %d increments a band is seen whose outcrop is not: it comes out where the "
            "photographs show no surface. increments.csv has its inclination, bands.csv leaves it out",
            hidden,
            int(seen.sum()),
        )


_COLUMNS = [
    *(name for name in INCREMENT_COLUMNS if name != "band"),
    "outcrop_y_mm",
    "outcrop_shared_mm",
    "outcrop_own_mm",
]
_TYPES = {name: np.float64 for name in _COLUMNS if name != "mechanism"}


def _increment(
    tracks: xr.Dataset, lines: dict[int, Floats], pair: tuple[int, int], motion: Motion
) -> dict[str, object]:
    """One row of the table of increments; what could not be had is left out."""
    u0, u1 = (float(tracks["u_mm"].to_numpy()[k]) for k in pair)
    row: dict[str, object] = {"frame": frame_number(tracks, pair[0]), "u_mm": u0, "du_mm": u1 - u0}
    noise = float(np.median(motion.std)) if len(motion.std) else np.nan
    resolved = noise * _LEAST_TRAVEL_STDS < 1 and len(motion.place) >= _LEAST_POINTS
    line = fit_line(motion) if resolved else None
    verdict = judge(motion, line, resolved=resolved)
    row |= {"mechanism": str(verdict.mechanism or ""), "evidence": verdict.evidence}
    if line is None:
        return row
    surfaces = [lines.get(frame_number(tracks, k), NO_SURFACE) for k in pair]
    ends = np.array([outcrop(s, (u0 + u1) / 2, line.beta_deg) for s in surfaces])
    x, per_degree, std = ends.mean(axis=0)
    slip = (u1 - u0) * float(np.hypot(*line.velocity))
    beta_std = float(np.hypot(line.std_deg, verdict.spread_deg))
    return row | {
        "beta_deg": line.beta_deg,
        "beta_std_deg": beta_std,
        "outcrop_x_mm": x,
        "outcrop_std_mm": np.hypot(per_degree * beta_std, std),
        "outcrop_own_mm": np.hypot(per_degree * line.std_deg, std),
        "outcrop_shared_mm": per_degree * line.shared_std_deg,
        "outcrop_y_mm": height(surfaces[0], x)[0],
        "slip_mm": slip,
        **_velocity(line),
    }


def _name_switches(table: pd.DataFrame, starts: list[float]) -> None:
    """Call an increment within which a band took over from another by what it is, where one was not enough.

    Alone it may as well have sheared along the blade, if the old band was steep, or nowhere sharply.
    """
    for start in starts:
        within = (table["u_mm"] <= start) & (start < table["u_mm"] + table["du_mm"])
        vague = table["mechanism"].isin([Mechanism.SHEAR_ALONG_BLADE, Mechanism.DIFFUSE])
        table.loc[within & vague, "mechanism"] = str(Mechanism.TWO_BANDS)


def _velocity(line: BandLine) -> dict[str, float]:
    values = np.column_stack([line.velocity, line.velocity_std]).ravel()
    names = ("velocity_x", "velocity_x_std", "velocity_y", "velocity_y_std")
    return dict(zip(names, values.tolist(), strict=True))


def _with_scatter(table: pd.DataFrame) -> pd.DataFrame:
    """Standard deviations that cover how angles and outcrops scatter from increment to increment."""
    middle = (table["u_mm"] + table["du_mm"] / 2).to_numpy()
    vague = ~table["mechanism"].isin([Mechanism.ONE_BAND]).to_numpy()
    for value, std in (
        ("beta_deg", "beta_std_deg"),
        ("outcrop_x_mm", "outcrop_std_mm"),
        ("outcrop_x_mm", "outcrop_own_mm"),
    ):
        table[std] = widened(middle, table[value].to_numpy(), table[std].to_numpy(), vague)
    return table


def _scale_stds(table: pd.DataFrame) -> None:
    """Multiply stds of angles and outcrops by how increments of one band scatter beyond them.

    docs/theory-bands.md, Eq. (17).
    """
    middle = (table["u_mm"] + table["du_mm"] / 2).to_numpy()
    for value, std in (("beta_deg", "beta_std_deg"), ("outcrop_x_mm", "outcrop_std_mm")):
        columns = table[value].to_numpy(), table[std].to_numpy(), table["band"].to_numpy()
        table[std] *= common_scale(middle, *columns)


def _with_displacement_std(table: pd.DataFrame) -> pd.DataFrame:
    """Add to the velocities' std what the blade's displacement is uncertain by.

    The block goes with the blade: how far its motion scatters about the blade's from increment to increment,
    beyond its own noise, is put down to the displacement (docs/theory-bands.md, Eq. (10)).
    """
    known = table.dropna(subset=["velocity_x", "velocity_x_std"])
    if len(known) < _LEAST_INCREMENTS:
        return table
    off = (known["velocity_x"] - known["velocity_x"].median()) * known["du_mm"]
    scatter = 1.4826 * float(np.median(np.abs(off)))
    own = float(np.median(known["velocity_x_std"] * known["du_mm"]))
    relative = np.sqrt(max(scatter**2 - own**2, 0.0)) / table["du_mm"]
    for axis in ("x", "y"):
        value, std = f"velocity_{axis}", f"velocity_{axis}_std"
        table[std] = np.hypot(table[std], relative * table[value])
    return table


def _band(
    number: int, table: pd.DataFrame, episodes: list[Episode], starts: list[tuple[float, float]]
) -> tuple[float, ...]:
    """One row of BAND_COLUMNS."""
    episode, (start, start_std) = episodes[number], starts[number]
    rows = table.loc[episode.rows]
    first, last = rows.iloc[0], rows.iloc[-1]
    end = float(last["u_mm"] + last["du_mm"])
    if number + 1 < len(episodes):
        after = table.loc[episodes[number + 1].rows[0]]
        if after["u_mm"] <= end + 1e-9:  # nothing between: it ends where the next begins
            end = starts[number + 1][0]
    x, y = episode.outcrop_x_mm, episode.outcrop_y_mm
    beta = np.degrees(np.arctan2(y, x - start))
    along, up = np.hypot(episode.outcrop_std_mm, start_std), episode.outcrop_y_std_mm
    beta_std = np.degrees(np.hypot(y * along, (x - start) * up) / (y**2 + (x - start) ** 2))
    slip = float(rows["slip_mm"].sum())
    slip -= (start - first["u_mm"]) / first["du_mm"] * first["slip_mm"]  # what was the other band's
    slip += (end - last["u_mm"] - last["du_mm"]) / last["du_mm"] * last["slip_mm"]
    return (number, start, end, beta, beta_std, x, episode.outcrop_std_mm, slip)
