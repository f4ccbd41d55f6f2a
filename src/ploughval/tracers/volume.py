"""Sand heaped ahead of the blade against the sand that the blade has swept: a check of the measurement.

Per mm of width, between the tip's level and the surface (docs/theory-geometry.md, Eq. (8)).
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ploughval.axes import VOLUME_COLUMNS
from ploughval.tracers.view import Floats

_GAP_SHARE = 0.1  # of the depth: over a wider gap in the surface its area is not known
_GAP_SPACINGS = 6.0  # ... or this many distances of the surface's points, where they stand wider apart
_FAR_SHARE = 0.25  # of the depth: stretch at the far end in which the surface must not have moved
_STILL_SHARE = 0.02  # of the depth, by which it may seem to
_SHARED_POINTS = (
    25.0  # successive points of a surface whose errors are the same: read from one straight piece
)


@dataclass(frozen=True, slots=True)
class _Line:
    """A surface in order of x, mm: (M, 3) x, y, std."""

    points: Floats

    def height(self, x: Floats) -> Floats:
        """Interpolated heights; the first and last points hold beyond the ends."""
        return np.asarray(np.interp(x, self.points[:, 0], self.points[:, 1]))

    def has_gap(self, first: float, last: float, widest: float) -> bool:
        """Whether any stretch between two places is wider than that without a point; never in a polyline."""
        x = self.points[:, 0]
        if not self.points[:, 2].any():
            return False
        inside = x[(x >= first) & (x <= last)]
        return bool(np.diff(np.concatenate([[first], inside, [last]])).max() > widest)

    def variance(self, first: float, last: float) -> float:
        """Of the area below it between two places, mm4."""
        x, std = self.points[:, 0], self.points[:, 2]
        if not std.any():
            return 0.0
        inside = (x >= first) & (x <= last)
        if inside.sum() < 2:
            return np.nan
        width = np.gradient(x[inside])
        shared = min(_SHARED_POINTS, float(inside.sum()))
        return float(shared * np.sum((width * std[inside]) ** 2))


def area_balance(
    surface: pd.DataFrame, blade: pd.DataFrame, depth_mm: float, initial: Floats | None = None
) -> pd.DataFrame:
    """Area of the heap ahead of the blade and the area that the blade has swept, frame by frame.

    Parameters
    ----------
    surface : DataFrame
        SURFACE_COLUMNS, and std_mm of measured points; without std_mm: a polyline, which has no gaps.
    blade : DataFrame
        frame and u_mm; blade_x_mm (used before u_mm) and blade_std_mm where they are known.
    depth_mm : float
        Of the tip below the initial surface, mm.
    initial : (M, 2) float or None, mm
        The surface before the blade moved; None: that of the first frame in ``surface``.

    Returns
    -------
    DataFrame
        VOLUME_COLUMNS, a row for each frame of ``blade``. area_mm2: between the surface and the initial
        surface, ahead of the face; swept_mm2: below the initial surface, from where the face was at rest
        to where it is; difference_mm2 and ratio: of the two; std_mm2: of the difference. NaN where the
        surface is incomplete, or has moved up to the end of what is seen.
    """
    lines = {int(str(frame)): _line(rows) for frame, rows in surface.astype({"frame": int}).groupby("frame")}
    lines = {frame: line for frame, line in lines.items() if len(line.points) > 1}
    rest = _rest(lines, initial)
    place = blade["blade_x_mm"].fillna(blade["u_mm"]) if "blade_x_mm" in blade else blade["u_mm"]
    std = blade["blade_std_mm"] if "blade_std_mm" in blade else pd.Series(0.0, index=blade.index)
    rows = []
    for frame, u, face, face_std in zip(blade["frame"], blade["u_mm"], place, std.fillna(0.0), strict=True):
        line = lines.get(int(frame))
        found = None if line is None or rest is None else _areas(line, rest, float(face), depth_mm)
        heap, swept, variance = (np.nan, np.nan, np.nan) if found is None else found
        if found is not None and line is not None:
            variance += (float(line.height(np.array([face]))[0]) * face_std) ** 2
        ratio = heap / swept if swept > 0.02 * depth_mm**2 else np.nan
        rows.append((int(frame), u, heap, swept, heap - swept, np.sqrt(variance), ratio))
    return pd.DataFrame(rows, columns=list(VOLUME_COLUMNS))


def _line(rows: pd.DataFrame) -> _Line:
    seen = rows.dropna(subset=["x_mm", "y_mm"]).sort_values("x_mm", kind="stable")
    std = seen["std_mm"].fillna(0.0) if "std_mm" in seen else pd.Series(0.0, index=seen.index)
    return _Line(np.column_stack([seen["x_mm"], seen["y_mm"], std]).astype(float))


def _rest(lines: dict[int, _Line], initial: Floats | None) -> _Line | None:
    """The surface before the blade moved."""
    if initial is not None:
        given = np.asarray(initial, float)
        return _Line(np.column_stack([given[np.argsort(given[:, 0], kind="stable")], np.zeros(len(given))]))
    return lines[min(lines)] if lines else None


def _areas(line: _Line, rest: _Line, face: float, depth_mm: float) -> tuple[float, float, float] | None:
    """Heap, swept area and variance of the heap, up to where both surfaces are known; None: incomplete."""
    far = float(line.points[-1, 0])
    if rest.points[0, 2] > 0 or len(rest.points) > 2:  # measured, or given in detail: it ends somewhere
        far = min(far, float(rest.points[-1, 0]))
    spacing = float(np.median(np.diff(line.points[:, 0])))
    widest = max(_GAP_SHARE * depth_mm, min(_GAP_SPACINGS * spacing, 0.5 * depth_mm))
    if not np.isfinite(face) or far - face < depth_mm or line.has_gap(face, far, widest):
        return None
    last = np.linspace(far - _FAR_SHARE * depth_mm, far, 32)
    if abs(float(np.mean(line.height(last) - rest.height(last)))) > _STILL_SHARE * depth_mm:
        return None
    nodes = np.unique(np.concatenate([[face, far], line.points[:, 0], rest.points[:, 0]]))
    ahead = nodes[(nodes >= face) & (nodes <= far)]
    heap = float(np.trapezoid(line.height(ahead) - rest.height(ahead), ahead))
    behind = np.unique(np.concatenate([[0.0, face], rest.points[:, 0]]))
    behind = behind[(behind >= min(face, 0.0)) & (behind <= max(face, 0.0))]
    swept = float(np.sign(face) * np.trapezoid(rest.height(behind), behind))
    return heap, swept, line.variance(face, far) + np.nan_to_num(rest.variance(face, far))
