"""Where a band comes out at any travel: it stays, unless the increments clearly show that it creeps ahead."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_LEAST_SPEED = 0.2  # of the blade's: a slower outcrop is taken to stay
_CLEAR = 4.0  # stds of the speed
_LEAST_INCREMENTS = 6
_MOST_WEIGHT = 2.0  # times the median: no increment decides alone


@dataclass(frozen=True, slots=True)
class Outcrop:
    """Place of an outcrop: x_mm where its band starts, and the line that it follows once that is ahead.

    The line is at ``line_mm`` at the travel ``start_mm`` and moves by ``speed``, mm a mm of travel.
    """

    x_mm: float
    start_mm: float = 0.0
    line_mm: float = -np.inf
    speed: float = 0.0

    def at(self, u_mm: Floats) -> Floats:
        """Place of the outcrop: it does not go back.

        Parameters
        ----------
        u_mm : (N,) float, mm
            Travels.

        Returns
        -------
        (N,) float, mm
        """
        return np.maximum(self.x_mm, self.line_mm + self.speed * np.maximum(u_mm - self.start_mm, 0.0))


def outcrop_of(band: pd.Series, increments: pd.DataFrame | None) -> Outcrop:
    """Outcrop of a measured band.

    Parameters
    ----------
    band : Series
        A row of BAND_COLUMNS.
    increments : DataFrame or None
        INCREMENT_COLUMNS: outcrops between successive photographs; None: the outcrop is taken to stay.

    Returns
    -------
    Outcrop
        It stays where the band started until the straight line through the band's increments, weighted by
        their stds, is ahead of it; such a line there is where it moves by a fifth of the blade's travel and
        by four of its own stds. The first increment, which may hold the band before as well, is left out.
    """
    start, x = float(band["u_start_mm"]), float(band["outcrop_x_mm"])
    stays = Outcrop(x, start)
    if increments is None:
        return stays
    own = increments[increments["band"] == band["band"]].iloc[1:]
    own = own[np.isfinite(own["outcrop_x_mm"]) & (own["outcrop_std_mm"] > 0)]
    if len(own) < _LEAST_INCREMENTS:
        return stays
    u = (own["u_mm"] + own["du_mm"] / 2).to_numpy(dtype=np.float64) - start
    weight = 1 / own["outcrop_std_mm"].to_numpy(dtype=np.float64)
    weight = np.minimum(weight, _MOST_WEIGHT * np.median(weight))
    design = np.column_stack([np.ones(u.size), u]) * weight[:, None]
    target = own["outcrop_x_mm"].to_numpy(dtype=np.float64) * weight
    inverse = np.linalg.inv(design.T @ design)
    line = inverse @ design.T @ target
    scatter = float(np.sum((target - design @ line) ** 2)) / (u.size - 2)
    std = float(np.sqrt(inverse[1, 1] * max(scatter, 1.0)))
    if line[1] < max(_LEAST_SPEED, _CLEAR * std):
        return stays
    return Outcrop(x, start, float(line[0]), float(line[1]))
