"""The mound frame by frame, of a measured surface and of a model run, read in the same way."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ploughval.compare.mound.shape import Floats, Mound, Reading, mound_of

if TYPE_CHECKING:
    from ploughval.model import History

MOUND_COLUMNS = (
    "source", "frame", "u_mm", "crest_mm", "crest_std_mm", "crest_x_mm", "crest_x_std_mm", "face_mm",
    "face_std_mm", "front_mm", "front_std_mm", "flank_deg", "flank_std_deg", "slope_deg", "slope_std_deg",
    "area_mm2", "area_std_mm2",
)  # fmt: skip
_AT_REST_DEPTHS = 0.05  # a first surface seen later than this is not the initial one
_STILL_DEPTHS, _STILL_SHARE = 1.0, 0.02  # at its far end so much of a surface has not moved by so little
_GAP_DEPTHS = 0.2  # over a wider gap a measured surface is not known
_TO_STD = 1.4826  # of a median deviation
_OF_STATED = 2.0  # measured against exact surfaces of made tests (docs/theory-comparison-lines.md, section 3)
_LEAST_POINTS = 8
_LEAST_NOISE = 0.005
_LEAST_STEP, _MOST_STEP = 0.005, 0.05  # depths
_SHARED_DEPTHS = 0.5  # a measured surface is read from straight pieces: so long its error is the same


def lines_of(surface: pd.DataFrame) -> dict[int, tuple[float, Floats]]:
    """Travel and surface (M, 2) of each frame, in order of x, finite points alone."""
    known = surface.dropna(subset=["x_mm", "y_mm", "u_mm"]).sort_values(["frame", "x_mm"], kind="stable")
    values = known[["frame", "u_mm", "x_mm", "y_mm"]].to_numpy(dtype=np.float64)
    starts = np.flatnonzero(np.diff(values[:, 0], prepend=np.nan) != 0)
    parts = np.split(values, starts[1:]) if len(values) else []
    return {int(part[0, 0]): (float(part[0, 1]), np.ascontiguousarray(part[:, 2:])) for part in parts}


def rest_of(lines: Mapping[int, tuple[float, Floats]], depth_mm: float) -> tuple[Floats, bool]:
    """The initial surface, and whether it was measured: else it is taken level at the stated depth."""
    u_mm, first = lines[min(lines)]
    if u_mm <= _AT_REST_DEPTHS * depth_mm and len(first) > 1:
        return first, True
    return np.array([[first[0, 0], depth_mm], [first[-1, 0], depth_mm]]), False


def reading_of(surface: pd.DataFrame, rest: Floats, depth_mm: float, lean: float = 0.0) -> Reading:
    """Spacing and noise of measured surfaces.

    Parameters
    ----------
    surface : DataFrame
        SURFACE_COLUMNS; ``std_mm`` and ``calibration_std_mm`` where they are known.
    rest : (K, 2) float
        The initial surface.
    depth_mm : float
        Depth of the tip.
    lean : float
        Tangent of the face's inclination.

    Returns
    -------
    Reading
        The noise is that of a height above the initial surface: the stated one of both surfaces and as much
        for what straight pieces round at corners; or how the far end of the surface, which has not moved,
        seems to move. Sand at rest in a still camera hides most of it there, so without a stated one it is
        at least _LEAST_NOISE of the depth.
    """
    lines = [line for _, line in lines_of(surface).values() if len(line) > 1]
    step = float(np.median(np.concatenate([np.diff(line[:, 0]) for line in lines]))) if lines else 0.0
    step = float(np.clip(step, _LEAST_STEP * depth_mm, _MOST_STEP * depth_mm))
    seeming = [_still_noise(line, rest, depth_mm) for line in lines]
    noise = float(np.nanmedian(seeming)) if np.isfinite(seeming).any() else 0.0
    stated = _median(surface, "std_mm")
    noise = max(noise, _OF_STATED * stated if stated > 0 else _LEAST_NOISE * depth_mm)
    return Reading(depth_mm, step, noise, _SHARED_DEPTHS * depth_mm, _scale_std(surface, depth_mm), lean)


def _still_noise(line: Floats, rest: Floats, depth_mm: float) -> float:
    """How far the far end of a surface seems to have moved; NaN where it has, or is hardly seen."""
    x, y = line[line[:, 0] >= line[-1, 0] - _STILL_DEPTHS * depth_mm].T
    if len(x) < _LEAST_POINTS:
        return float("nan")
    change = y - np.interp(x, rest[:, 0], rest[:, 1])
    level = float(np.median(change))
    if abs(level) > _STILL_SHARE * depth_mm:
        return float("nan")
    return float(np.hypot(_TO_STD * np.median(np.abs(change - level)), level))


def _scale_std(surface: pd.DataFrame, depth_mm: float) -> float:
    """Relative uncertainty of lengths that the calibration leaves, from that of places far from the tip."""
    if "calibration_std_mm" not in surface:
        return 0.0
    far = np.hypot(surface["x_mm"], surface["y_mm"])
    return _median((surface[far > depth_mm]).assign(share=surface["calibration_std_mm"] / far), "share")


def _median(table: pd.DataFrame, name: str) -> float:
    """Median of a column's known values; 0 without any."""
    known = table[name].dropna() if name in table else pd.Series(dtype=np.float64)
    return float(known.median()) if len(known) else 0.0


def measured_mounds(
    lines: Mapping[int, tuple[float, Floats]], rest: Floats, reading: Reading
) -> dict[int, Mound]:
    """The mound in each frame of a measured surface."""
    widest = _GAP_DEPTHS * reading.depth_mm
    return {
        frame: mound_of(line, rest, u, reading, widest_gap_mm=widest) for frame, (u, line) in lines.items()
    }


def predicted_mounds(one: "History", travel: Mapping[int, float], reading: Reading) -> dict[int, Mound]:
    """The mound of a model run at the travels of frames, as far as it reaches."""
    end = float(one.force["u_mm"].iloc[-1])
    rest = np.asarray(one.surface(0.0), dtype=np.float64)
    return {
        frame: mound_of(np.asarray(one.surface(max(u, 0.0)), dtype=np.float64), rest, max(u, 0.0), reading)
        for frame, u in travel.items()
        if u <= end
    }


def mound_rows(source: str, mounds: Mapping[int, Mound], travel: Mapping[int, float]) -> pd.DataFrame:
    """Mounds as rows of MOUND_COLUMNS."""
    rows = [
        (source, frame, travel[frame], *mound.crest, *mound.crest_x, *mound.face, *mound.front, *mound.flank,
         *mound.slope, *mound.area)
        for frame, mound in mounds.items()
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=list(MOUND_COLUMNS))
