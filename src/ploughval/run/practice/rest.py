"""What rests in a test: photographs before motion, and sand that the blade has not reached."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.run.findings import Findings
from ploughval.run.practice.analysis import side_px
from ploughval.scene import Scene

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

RESTING_PX = 0.05
"""A photograph in which the blade has moved by less since the first one shows the sand at rest."""
EARLY = 10
"""Photographs that are looked at where none shows the whole sand at rest: sand may creep later on."""
_ROBUST = 1.4826


@dataclass(frozen=True, slots=True)
class Rest:
    """Photographs and sand of a test that rest.

    Attributes
    ----------
    frames : tuple of int, in which sand is looked at, the first one not among them
    whole : bool, whether all sand rests in them; else only what lies beyond ``outcrop_mm``
    first : int, the photograph that motion is counted from
    outcrop_mm : (F,) float, farthest outcrop so far; NaN: not known
    margin_mm : float, one subset: so far from what moves sand is taken to rest
    depth_mm : float
    """

    frames: tuple[int, ...]
    whole: bool
    first: int
    outcrop_mm: Floats
    margin_mm: float
    depth_mm: float

    def ahead(self, frame: int, x_mm: Floats) -> Mask:
        """Whether places along the travel lie ahead of all that has moved, in a photograph of ``frames``."""
        if self.whole:
            return np.asarray(x_mm > self.margin_mm)
        limit = self.outcrop_mm[frame]
        return np.asarray(x_mm > limit + self.margin_mm) & bool(np.isfinite(limit))

    def points(self, frame: int, x0_mm: Floats, y0_mm: Floats) -> Mask:
        """Whether points of the sand rest in a photograph of ``frames``."""
        within = y0_mm < self.depth_mm - self.margin_mm
        if self.whole:
            return np.asarray(within & (x0_mm > self.margin_mm))
        return np.asarray((y0_mm < -self.margin_mm) | (within & self.ahead(frame, x0_mm)))


def rest_of(scene: Scene, found: Findings) -> Rest | None:
    """Photographs and sand that rest; None without photographs or displacement."""
    u = found.frame_displacement_mm()
    if found.calibration is None or not np.isfinite(u).any():
        return None
    usable = [k for k in np.flatnonzero(np.isfinite(u)).tolist() if k not in found.lost_frames]
    if not usable:
        return None
    scale = found.calibration.mm_per_px
    first, *later = usable
    still = tuple(k for k in later if abs(u[k] - u[first]) < RESTING_PX * scale)
    moving = tuple(k for k in later if k not in still)[:EARLY]
    return Rest(
        frames=still or moving,
        whole=bool(still),
        first=first,
        outcrop_mm=_farthest_outcrop(found.band_table(), u),
        margin_mm=side_px(scene) * scale,
        depth_mm=scene.blade.depth_mm,
    )


def _farthest_outcrop(bands: pd.DataFrame | None, u_mm: Floats) -> Floats:
    """Farthest outcrop of the bands that have begun by each photograph, mm."""
    out = np.full(len(u_mm), np.nan)
    if bands is None or bands.empty:
        return out
    start, place = bands["u_start_mm"].to_numpy(float), bands["outcrop_x_mm"].to_numpy(float)
    for frame, u in enumerate(u_mm):
        begun = place[(start <= u) & np.isfinite(place)]
        if begun.size:
            out[frame] = begun.max()
    return out


def spread(values: Floats) -> float:
    """Standard deviation from the median absolute deviation; NaN for fewer than three values."""
    values = values[np.isfinite(values)]
    return _ROBUST * float(np.median(np.abs(values - np.median(values)))) if values.size > 2 else float("nan")


def off_line(x: Floats, y: Floats) -> Floats:
    """Distances in y from the straight line through points, least squares without the farthest of them."""
    if len(x) < 3:
        return np.full(len(x), np.nan)
    kept = np.ones(len(x), bool)
    rest = y
    for _ in range(3):
        if kept.sum() < 3 or np.ptp(x[kept]) == 0:
            break
        slope, height = np.polyfit(x[kept] - x.mean(), y[kept], 1)
        rest = y - height - slope * (x - x.mean())
        kept = np.abs(rest) <= 3 * max(spread(rest), 1e-12)
    return np.asarray(rest, np.float64)
