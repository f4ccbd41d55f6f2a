"""Where a line through the tip leaves the sand (docs/theory-bands.md, section 5)."""

import numpy as np
import pandas as pd

from ploughval.tracers.view import Floats

_LEAST_SLOPE = 0.05  # between line and surface


NO_SURFACE = np.empty((0, 3))


def lines_of(surface: pd.DataFrame) -> dict[int, Floats]:
    """Free surface by frame, (M, 3) mm in order of x: x, y and its std, 0 where that is not known."""
    seen = surface.dropna(subset=["x_mm", "y_mm"]).sort_values(["frame", "x_mm"], kind="stable")
    std = seen["std_mm"].to_numpy(float) if "std_mm" in seen else np.zeros(len(seen))
    rows = np.column_stack([seen["x_mm"], seen["y_mm"], np.nan_to_num(std)]).astype(float)
    frames, first = np.unique(seen["frame"].to_numpy(), return_index=True)
    return {int(f): part for f, part in zip(frames, np.split(rows, first[1:]), strict=False)}


def height(line: Floats, x_mm: float) -> tuple[float, float]:
    """Height of a surface (M, 3) at a place and its std, mm; NaN where it was not seen."""
    if not len(line):
        return np.nan, np.nan
    y, std = (float(np.interp(x_mm, line[:, 0], v, left=np.nan, right=np.nan)) for v in line.T[1:])
    return y, std


def outcrop(line: Floats, tip_mm: float, beta_deg: float) -> tuple[float, float, float]:
    """Where a line from the tip leaves the sand.

    Parameters
    ----------
    line : (M, 3) float, mm
        The surface.
    tip_mm, beta_deg : float
        The tip's x and the line's inclination.

    Returns
    -------
    x_mm : float
        NaN where the surface was not seen there.
    per_degree : float
        Change of x for a degree of inclination, mm.
    std_mm : float
        Of x, from the surface alone.
    """
    if not len(line):
        return np.nan, np.nan, np.nan
    x, y, std = line.T
    slope = np.tan(np.radians(beta_deg))
    over = y - (x - tip_mm) * slope
    out = np.flatnonzero((over[:-1] >= 0) & (over[1:] < 0) & (x[1:] > tip_mm))
    if len(out) == 0:
        return np.nan, np.nan, np.nan
    k = int(out[0])
    at = float(x[k] + over[k] / (over[k] - over[k + 1]) * (x[k + 1] - x[k]))
    near = slice(max(k - 5, 0), k + 7)
    surface_slope = float(np.polyfit(x[near], y[near], 1)[0]) if len(x[near]) > 2 else 0.0
    between = max(slope - surface_slope, _LEAST_SLOPE)
    return at, float(np.radians(at - tip_mm) * (1 + slope**2) / between), float(std[k] / between)
