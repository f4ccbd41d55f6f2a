"""The dominant period of a force history: a wave whose length may grow, fitted to what the trend leaves."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.force.curve import Curve
from ploughval.compare.quantity import MISSING, Quantity

Floats = NDArray[np.float64]
_LEAST_SWITCHES = 2
_POINTS = 160  # of the resampled record: 13 in the shortest wave tried
_MOST_CYCLES = 12.0
_MOST_GROWTH = 4.0  # length of the last wave over that of the first
_ZOOMS = 2
_PER_CYCLE = 4  # independent values in a cycle of a wave: what its misfit is worth


def dominant_period(curve: Curve, switches: int) -> Quantity:
    """Mean length of the wave that explains most of a history.

    The record is divided by its quadratic trend, because force and saw-teeth grow together. To the rest a
    wave of phase (2 pi / g) ln(1 + g u / p) is fitted by least squares over p and g: its length p + g u
    grows with the travel, as the spacing of the bands does (docs/theory-comparison.md, Eqs (10) and (11)).

    Parameters
    ----------
    curve : Curve
        Up to the travel that both sides have in common.
    switches : int
        Fresh bands seen in the record; with fewer than two there is no period to be found.

    Returns
    -------
    Quantity, mm
        Travel over the number of cycles in it. The uncertainty takes what the wave leaves unexplained for
        noise, four independent values a cycle: few periods, or uneven ones, are told as such. A model's
        curve gets none: the same fit to the same travel, its part is counted once, on the measured side.
    """
    if switches < _LEAST_SWITCHES:
        return MISSING
    rest = _without_trend(curve)
    if rest is None:
        return MISSING
    waves = _all_waves()
    explained = waves.explained(rest)
    for _ in range(_ZOOMS):
        i, j = np.unravel_index(int(explained.argmax()), explained.shape)
        waves = _waves(_around(waves.cycles, int(i), 9), _around(waves.growth, int(j), 5))
        explained = waves.explained(rest)
    count = float(waves.cycles[int(explained.max(axis=1).argmax())])
    share = float(explained.max())
    if share <= 0:
        return MISSING
    span = curve.end_mm - float(curve.u_mm[0])
    misfit = np.sqrt(max(1 - share, 0.0) / (2 * share))  # rms of what is left over the wave's amplitude
    relative = np.sqrt(6.0) * misfit / (np.pi * count * np.sqrt(_PER_CYCLE * count))
    return Quantity(span / count, float(relative) * span / count if curve.step_mm > 0 else 0.0)


def _without_trend(curve: Curve) -> Floats | None:
    """The record over its quadratic trend, at even travels, with mean 0 and mean square 1."""
    u = np.linspace(curve.u_mm[0], curve.end_mm, _POINTS)
    force = np.interp(u, curve.u_mm, curve.force_N)
    trend = np.polynomial.Polynomial.fit(u, force, 2)(u)
    if trend.min() <= 0:
        return None
    rest = force / trend - 1
    rest -= rest.mean()
    size = float(np.sqrt(np.mean(rest**2)))
    return np.asarray(rest / size) if size > 0 else None


class _Waves(NamedTuple):
    """Two orthonormal waves (C, G, points) for every number of cycles (C,) and growth (G,)."""

    cycles: Floats
    growth: Floats
    first: Floats
    second: Floats

    def explained(self, rest: Floats) -> Floats:
        """Share of a record's mean square that each pair of waves explains, (C, G)."""
        return np.asarray(((self.first @ rest) ** 2 + (self.second @ rest) ** 2) / rest.size)


def _waves(cycles: Floats, growth: Floats) -> _Waves:
    x = np.linspace(0.0, 1.0, _POINTS)
    swell = growth[:, None] - 1
    even = np.abs(swell) < 1e-6
    safe = np.where(even, 1.0, swell)
    part = np.where(even, x, np.log1p(safe * x) / np.log1p(safe))  # of all cycles, up to x
    phase = 2 * np.pi * cycles[:, None, None] * part
    pair: list[Floats] = []
    for wave in (np.cos(phase), np.sin(phase)):
        wave = wave - wave.mean(axis=2, keepdims=True)
        for other in pair:
            wave = wave - other * np.einsum("ijk,ijk->ij", wave, other)[:, :, None]
        pair.append(wave / np.linalg.norm(wave, axis=2, keepdims=True))
    return _Waves(cycles, growth, pair[0], pair[1])


@cache
def _all_waves() -> _Waves:
    return _waves(np.geomspace(1.2, _MOST_CYCLES, 60), np.linspace(0.8, _MOST_GROWTH, 9))


def _around(values: Floats, place: int, count: int) -> Floats:
    """Finer values between the neighbours of one."""
    return np.linspace(values[max(place - 1, 0)], values[min(place + 1, values.size - 1)], count)
