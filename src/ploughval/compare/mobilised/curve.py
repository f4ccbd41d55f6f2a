"""Mobilised friction against slip at rows of the force, between the photographs too.

docs/theory-mobilised.md, section 2.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.face import lean_of
from ploughval.compare.force.curve import Curve
from ploughval.compare.mobilised.block import Block, block_of
from ploughval.compare.mobilised.inversion import mobilised_friction, slip_rate
from ploughval.compare.mobilised.outcrop import Outcrop, outcrop_of
from ploughval.compare.mobilised.sources import SOURCES, Response, incline_deg, input_stds, respond, weight_of
from ploughval.compare.mobilised.surface import SeenSurface
from ploughval.compare.mobilised.track import BlockTrack, track_block
from ploughval.scene import Scene, Soil

Floats = NDArray[np.float64]
CURVE_COLUMNS = (
    "band", "u_mm", "slip_mm", "slip_std_mm", "phi_deg", "phi_std_deg", "fresh_deg",
    *(f"{name}_deg" for name in SOURCES), "photographs_deg", "beta_deg", "weight_N", "force_N",
)  # fmt: skip
_FINE = 600  # steps a depth over which the force is averaged while the band may still soften ...
_FINE_DEPTHS = 0.25  # ... for so long after the photograph before its start
_COARSE = 60  # and afterwards


@dataclass(frozen=True, slots=True, eq=False)
class BandCurve:
    """Mobilised friction on one band at N travels.

    Attributes
    ----------
    band : int
    start_mm, start_low_mm, start_high_mm : float, mm
        Travel at which it took over, as the photographs place it, and the photographs about that.
    first : bool
        Whether the blade starts to move with this band: the force rises before it slips.
    row_mm : float, mm
        Travel between rows of the force's record.
    u_mm, width_mm : (N,) float, mm
        Middle and length of the travel over which the force is averaged.
    phi_deg : (N,) float, degrees
    stretch : (N,) float
        Slip for a millimetre of travel.
    response : Response
        Effects of the sources.
    beta_deg, weight_N, force_N : (N,) float
        Inclination, weight of the block, force P.
    """

    band: int
    start_mm: float
    start_low_mm: float
    start_high_mm: float
    first: bool
    row_mm: float
    u_mm: Floats
    width_mm: Floats
    phi_deg: Floats
    stretch: Floats
    response: Response
    beta_deg: Floats
    weight_N: Floats
    force_N: Floats

    def slip_at(self, origin_mm: float, u_mm: Floats) -> Floats:
        """Slip gathered from an origin to travels (docs/theory-mobilised.md, Eq. (3)).

        Parameters
        ----------
        origin_mm : float, mm
            Travel at which slip begins.
        u_mm : (M,) float, mm
            Travels.

        Returns
        -------
        (M,) float, mm
            Negative before the origin.
        """
        gathered = np.concatenate(
            [[0.0], np.cumsum((self.stretch[1:] + self.stretch[:-1]) / 2 * np.diff(self.u_mm))]
        )

        def total(u: Floats) -> Floats:
            inside = np.interp(u, self.u_mm, gathered)
            below, above = np.minimum(u - self.u_mm[0], 0.0), np.maximum(u - self.u_mm[-1], 0.0)
            return np.asarray(inside + below * self.stretch[0] + above * self.stretch[-1])

        return np.asarray(total(u_mm) - total(np.array([origin_mm])))


def band_curve(
    scene: Scene,
    force: Curve,
    bands: pd.DataFrame,
    band: int,
    surface: SeenSurface,
    increments: pd.DataFrame | None = None,
) -> BandCurve | None:
    """Mobilised friction on one band, from the photograph before its start to its end.

    Parameters
    ----------
    scene : Scene
        With [soil] and the blade.
    force : Curve
        Measured force over travel.
    bands : DataFrame
        BAND_COLUMNS, measured.
    band : int
        Row of it.
    surface : SeenSurface
        The measured surface.
    increments : DataFrame or None
        INCREMENT_COLUMNS, which show whether the outcrop creeps.

    Returns
    -------
    BandCurve or None
        None where force, outcrop or surface give no row.
    """
    soil, row = scene.soil, bands.iloc[band]
    assert soil is not None
    start, end = (float(row[name]) for name in ("u_start_mm", "u_end_mm"))
    outcrop = outcrop_of(row, increments)
    low, high = _about(surface.u_mm, start)
    seen, blocks = seen_blocks(scene, surface, outcrop, (low, end))
    first = band == int(np.argmin(bands["u_start_mm"].to_numpy()))
    # what a band does in the interval in which the next one starts is mixed with that one's slip
    later = bands["u_start_mm"].to_numpy(dtype=np.float64)
    follows = later[later > start]
    stop = end if not follows.size else min(end, _about(surface.u_mm, float(follows.min()))[0])
    if not (np.isfinite(outcrop.x_mm) and len(blocks)):
        return None
    u, width, F, noise = binned(force, low, stop, scene.blade.depth_mm)
    track = track_block(u, seen, blocks, outcrop.at(u), start)
    good = np.isfinite(track.area_mm2) & np.isfinite(F)
    if not good.any():
        return None
    u, width, F, noise = u[good], width[good], F[good], noise[good]
    track = track_block(u, seen, blocks, outcrop.at(u), start)
    stds = input_stds(scene, soil, force, surface, float(row["outcrop_std_mm"]))
    response = respond(scene, soil, stds, track, (F, noise))
    return _inverted(
        soil,
        scene,
        track,
        response,
        (int(row["band"]), start, low, high, first, force.step_mm / 2),
        (u, width, F),
    )


def _inverted(
    soil: Soil,
    scene: Scene,
    track: BlockTrack,
    response: Response,
    named: tuple[int, float, float, float, bool, float],
    rows: tuple[Floats, Floats, Floats],
) -> BandCurve:
    u, width, F = rows
    incline, weight, beta = incline_deg(scene, soil), weight_of(scene, soil, track), track.beta_deg
    P = F / np.cos(np.radians(incline))
    phi = mobilised_friction(P, weight, beta, incline)
    stretch = slip_rate(beta, scene.blade.inclination_deg)
    return BandCurve(*named, u, width, phi, stretch, response, beta, weight, P)


def seen_blocks(
    scene: Scene, surface: SeenSurface, outcrop: Outcrop, span_mm: tuple[float, float]
) -> tuple[Floats, list[Block]]:
    """Photographs in which a band's block is known.

    Parameters
    ----------
    scene : Scene
        Depth of the blade, and whether it leans.
    surface : SeenSurface
        What the photographs show.
    outcrop : Outcrop
        Of the band.
    span_mm : (float, float), mm
        Travels between which photographs are looked at.

    Returns
    -------
    (K,) float, mm, and list of K Block
        Travels of these photographs, and the blocks.
    """
    known, lean = [], lean_of(scene)
    for u, line in zip(surface.u_mm.tolist(), surface.lines, strict=True):
        if span_mm[0] - 1e-9 <= u <= span_mm[1] + 1e-9:
            block = block_of(line, u, float(outcrop.at(np.array([u]))[0]), scene.blade.depth_mm, lean)
            if block is not None:
                known.append((u, block))
    return np.array([u for u, _ in known]), [block for _, block in known]


def _about(seen_mm: Floats, u_mm: float) -> tuple[float, float]:
    """Travels of the photographs before and after a travel."""
    before, after = seen_mm[seen_mm <= u_mm + 1e-9], seen_mm[seen_mm > u_mm + 1e-9]
    return float(before.max(initial=seen_mm.min())), float(after.min(initial=seen_mm.max()))


def binned(force: Curve, low_mm: float, stop_mm: float, depth_mm: float) -> tuple[Floats, ...]:
    """Means of a force over steps of travel, fine where a band softens and coarse after it.

    Parameters
    ----------
    force : Curve
        Over travel.
    low_mm, stop_mm : float, mm
        Travel to cover.
    depth_mm : float, mm
        Steps are a 600th of it at first, at least the curve's own, and a 60th from a quarter of it on.

    Returns
    -------
    tuple of four (N,) float
        Middle and length of the step, mm; force and its noise, N.
    """
    fine = max(depth_mm / _FINE, force.step_mm)
    change = low_mm + _FINE_DEPTHS * depth_mm
    edges = np.concatenate(
        [
            np.arange(low_mm, min(change, stop_mm), fine),
            np.arange(min(change, stop_mm), stop_mm, max(depth_mm / _COARSE, fine)),
            [stop_mm],
        ]
    )
    inside = (force.u_mm >= low_mm) & (force.u_mm < stop_mm) & np.isfinite(force.force_N)
    u, F, noise = force.u_mm[inside], force.force_N[inside], force.noise_std_N[inside]
    place = np.searchsorted(edges, u, side="right") - 1
    count = np.bincount(place, minlength=len(edges))
    kept = count > 0

    def mean(values: Floats) -> Floats:
        return np.asarray(np.bincount(place, weights=values, minlength=len(edges))[kept] / count[kept])

    width = np.append(np.diff(edges), 0.0)[kept]
    return mean(u), np.maximum(width, force.step_mm), mean(F), np.sqrt(mean(noise**2) / count[kept])


def curve_table(curve: BandCurve, origin_mm: float, origin_std_mm: float) -> pd.DataFrame:
    """A band's curve as CURVE_COLUMNS, slip counted from an origin.

    Parameters
    ----------
    curve : BandCurve
        The band.
    origin_mm, origin_std_mm : float, mm
        Travel at which its slip began; rows before it have negative slip: the friction that the new band
        would have needed while the old one slipped.

    Returns
    -------
    DataFrame
        Parts of the standard uncertainty by source, with their signs.
    """
    response = curve.response
    parts = {f"{name}_deg": part for name, part in zip(SOURCES, response.shared, strict=True)}
    table = {
        "band": curve.band,
        "u_mm": curve.u_mm,
        "slip_mm": curve.slip_at(origin_mm, curve.u_mm),
        "slip_std_mm": origin_std_mm * curve.stretch[0],
        "phi_deg": curve.phi_deg,
        "phi_std_deg": response.std,
        "fresh_deg": response.fresh,
        **parts,
        "photographs_deg": np.sqrt((response.photographs**2).sum(axis=0)),
        "beta_deg": curve.beta_deg,
        "weight_N": curve.weight_N,
        "force_N": curve.force_N,
    }
    return pd.DataFrame(table)[list(CURVE_COLUMNS)]
