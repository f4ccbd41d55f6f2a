"""The scale of the photographs from the blade's travel: in px in the photographs, in mm in the log."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.run.clock import find_clock_offset

Floats = NDArray[np.float64]

_AGREE_PX, _AGREE_SHARE = 0.7, 0.003  # rms by which the two may differ: px, and share of the travel
_LEAST_PHOTOGRAPHS = 4
_EDGE_PX = 0.15  # standard uncertainty of an edge's place, at least
_MOVED_PX = 3.0


@dataclass(frozen=True, slots=True)
class ScaleGuess:
    """Scale, mm per px; its standard uncertainty; photograph clock minus log clock, s (NaN: not known).

    ``sure`` where photographs and log tell one motion; else the whole travels were held against each other.
    """

    mm_per_px: float
    std: float
    clock_offset_s: float
    sure: bool


def guess_scale(
    time_s: Floats, travel_px: Floats, log_time_s: Floats, log_u_mm: Floats, *, one_clock: bool
) -> ScaleGuess | None:
    """Scale from the blade's motion in a few photographs and in the log; None where either does not move.

    Parameters
    ----------
    time_s, travel_px : (K,) float, s and px
        Photographs, NaN where not known.
    log_time_s, log_u_mm : (N,) float, s and mm
        The log in order of time.
    one_clock : bool
        Whether the times may be taken as those of the log; another clock is tried where they do not agree.
    """
    known = np.isfinite(log_time_s) & np.isfinite(log_u_mm)
    log_t, log_u = log_time_s[known], log_u_mm[known]
    if not len(log_u) or not np.isfinite(travel_px).any():
        return None
    log_u = (log_u - log_u[0]) * np.sign(log_u[np.argmax(np.abs(log_u - log_u[0]))] - log_u[0])
    way_px, way_mm = float(np.nanmax(travel_px)), float(np.max(log_u))
    if way_px < _MOVED_PX or way_mm <= 0:
        return None
    kept = np.isfinite(time_s) & np.isfinite(travel_px)
    if kept.sum() >= _LEAST_PHOTOGRAPHS:
        t, x = time_s[kept], travel_px[kept]
        found = _on_one_clock(t, x, log_t, log_u, 0.0) if one_clock else None
        if found is None:
            fit = find_clock_offset(t, x * way_mm / way_px, log_t, log_u)
            found = _on_one_clock(t, x, log_t, log_u, fit.offset_s) if np.isfinite(fit.offset_s) else None
        if found is not None:
            return found
    return ScaleGuess(way_mm / way_px, np.nan, np.nan, False)


def _on_one_clock(
    t: Floats, x_px: Floats, log_t: Floats, log_u: Floats, offset_s: float
) -> ScaleGuess | None:
    """Straight line of px against mm, through the photographs that the log covers; None where it is none."""
    u = np.interp(t - offset_s, log_t, log_u, left=np.nan, right=np.nan)
    kept = np.isfinite(u)
    if kept.sum() < _LEAST_PHOTOGRAPHS or np.ptp(u[kept]) <= 0:
        return None
    u, x = u[kept], x_px[kept]
    design = np.column_stack([u, np.ones(len(u))])
    (px_per_mm, start), *_ = np.linalg.lstsq(design, x, rcond=None)
    rms = float(np.sqrt(np.sum((x - design @ [px_per_mm, start]) ** 2) / (len(u) - 2)))
    if px_per_mm <= 0 or rms > _AGREE_PX + _AGREE_SHARE * np.ptp(x):
        return None
    std = max(rms, _EDGE_PX) * float(np.sqrt(np.linalg.inv(design.T @ design)[0, 0]))
    return ScaleGuess(float(1 / px_per_mm), float(std / px_per_mm**2), offset_s, True)
