"""The free surface in the photographs, and how well its level and the scale are known."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SeenSurface:
    """The surface in the photographs.

    Attributes
    ----------
    frames, u_mm : (F,) int, (F,) float, mm
        Photographs and their travels, ascending.
    lines : tuple of (M, 3) float, mm
        x, y and std of each.
    scale_std : float
        Relative standard uncertainty of the scale, from what the calibration leaves open of places; NaN where
        that is not told.
    """

    frames: NDArray[np.int64]
    u_mm: Floats
    lines: tuple[Floats, ...]
    scale_std: float = float("nan")

    @property
    def std_mm(self) -> float:
        """Standard uncertainty of its level, mm: the median of what is stated; NaN where nothing is."""
        stated = np.concatenate([line[:, 2] for line in self.lines]) if self.lines else np.empty(0)
        stated = stated[np.isfinite(stated)]
        return float(np.median(stated)) if stated.size else float("nan")

    def part(self, wanted: NDArray[np.bool_]) -> "SeenSurface":
        """Some of the photographs.

        Parameters
        ----------
        wanted : (F,) bool
            Which.

        Returns
        -------
        SeenSurface
        """
        rows = np.flatnonzero(wanted)
        lines = tuple(self.lines[k] for k in rows)
        return SeenSurface(self.frames[rows], self.u_mm[rows], lines, self.scale_std)


def seen_surface(surface: pd.DataFrame) -> SeenSurface:
    """Group a table of the surface by photograph; those without travel are left out.

    Parameters
    ----------
    surface : DataFrame
        SURFACE_COLUMNS, and std_mm and calibration_std_mm where they are known.

    Returns
    -------
    SeenSurface
    """
    table = surface if "std_mm" in surface else surface.assign(std_mm=np.nan)
    parts = [
        (frame, float(part["u_mm"].iloc[0]), part[["x_mm", "y_mm", "std_mm"]].to_numpy(dtype=np.float64))
        for frame, part in table[table["u_mm"].notna()].groupby("frame", sort=True)
    ]
    parts.sort(key=lambda part: part[1])
    return SeenSurface(
        np.array([p[0] for p in parts], np.int64),
        np.array([p[1] for p in parts]),
        tuple(p[2] for p in parts),
        _scale_std(table),
    )


def _scale_std(table: pd.DataFrame) -> float:
    """The scale's part in the calibration's: an error s moves a place by s of its distance from the tip.

    The calibration states the rms of both components, 1 / sqrt 2 of that.
    """
    if "calibration_std_mm" not in table:
        return float("nan")
    distance = np.hypot(table["x_mm"], table["y_mm"])
    relative = np.sqrt(2.0) * table["calibration_std_mm"] / distance
    return float(relative[distance > 0].median())
