"""A force history as a curve over blade travel, with its noise and its systematic uncertainty apart."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_STEPS_PER_DEPTH = 300  # the measured force is averaged over at most depth / 300 of travel
_NOISE_SHARE = 0.003  # ... and over no more rows than bring the noise to this share of the median force
_ONSET_DEPTHS = 0.02


class Shared(NamedTuple):
    """What all points of a curve have in common: an offset (N, standard) and a relative gain (standard).

    ``covariance_N`` is that of the two: friction is read by the same cells and taken off, so that a gain
    too high takes off too much.
    """

    offset_N: float
    gain: float
    covariance_N: float = 0.0

    def variance(self, force_N: float) -> float:
        """Of a force that holds both, N^2."""
        return self.offset_N**2 + 2 * self.covariance_N * force_N + (self.gain * force_N) ** 2


@dataclass(frozen=True, slots=True)
class Curve:
    """Force over travel: ``noise_std_N`` is fresh at every point, ``shared_std_N`` common to all.

    All arrays are (N,) float, ``u_mm`` not falling; ``step_mm`` is the travel averaged in one point.
    """

    u_mm: Floats
    force_N: Floats
    noise_std_N: Floats
    shared_std_N: Floats
    step_mm: float

    @property
    def std_N(self) -> Floats:
        """Standard uncertainty of one point, N."""
        return np.hypot(self.noise_std_N, self.shared_std_N)

    @property
    def end_mm(self) -> float:
        """Travel at the end of the curve, mm."""
        return float(self.u_mm[-1])

    @property
    def shared(self) -> Shared:
        """What all points share, split into offset and gain by how its variance grows with the force.

        Zeros and friction displace every force by the same amount, sensitivities stretch all of them: the
        variance of the sum is a square in the force (docs/theory-comparison.md, Eq. (4)), fitted here.
        """
        x, y = self.force_N, self.shared_std_N**2
        level, total = float(np.sqrt(np.mean(x**2))), float(y.mean())
        if self.step_mm == 0 or np.ptp(x) <= 1e-9 * level:
            return Shared(float(np.sqrt(total)), 0.0)
        square, slope, start = (float(v) for v in np.polyfit(x / level, y, 2))
        if min(square, start) > 0 and slope**2 <= 4.01 * square * start:
            return Shared(float(np.sqrt(start)), float(np.sqrt(square)) / level, slope / (2 * level))
        basis = (x / level) ** 2
        spread = basis - basis.mean()
        rise = min(max(float(spread @ y) / float(spread @ spread), 0.0), total)
        return Shared(float(np.sqrt(total - rise)), float(np.sqrt(rise)) / level)

    def until(self, limit_mm: float) -> "Curve":
        """The curve up to a travel, with an interpolated point there."""
        if limit_mm >= self.end_mm:
            return self
        kept = self.u_mm < limit_mm

        def cut(values: Floats) -> Floats:
            return np.append(values[kept], np.interp(limit_mm, self.u_mm, values))

        u = np.append(self.u_mm[kept], limit_mm)
        return Curve(u, cut(self.force_N), cut(self.noise_std_N), cut(self.shared_std_N), self.step_mm)

    def since(self, begin_mm: float) -> "Curve":
        """The curve from a travel on, with an interpolated point there."""
        if begin_mm <= self.u_mm[0]:
            return self
        kept = self.u_mm > begin_mm

        def cut(values: Floats) -> Floats:
            return np.append(np.interp(begin_mm, self.u_mm, values), values[kept])

        u = np.append(begin_mm, self.u_mm[kept])
        return Curve(u, cut(self.force_N), cut(self.noise_std_N), cut(self.shared_std_N), self.step_mm)

    def at(self, u_mm: Floats) -> tuple[Floats, Floats]:
        """Force and its standard uncertainty at travels, by linear interpolation; NaN outside."""
        inside = (u_mm >= self.u_mm[0] - self.step_mm) & (u_mm <= self.u_mm[-1] + self.step_mm)
        force = np.where(inside, np.interp(u_mm, self.u_mm, self.force_N), np.nan)
        return force, np.where(inside, np.interp(u_mm, self.u_mm, self.std_N), np.nan)


def measured_curve(record: pd.DataFrame, depth_mm: float) -> Curve | None:
    """Average a force record over equal steps of travel.

    Parameters
    ----------
    record : DataFrame
        FORCE_COLUMNS; rows without force are passed over, rows at rest and after the travel's end left out.
    depth_mm : float
        Depth of the tip. Steps are as short as the noise allows: 0.3 % of the median force, two rows or 1/300
        of the depth, whichever comes first.

    Returns
    -------
    Curve or None
        None with fewer than 5 points in motion. Row noise is read from the differences of neighbouring rows;
        what force_std_N holds beyond it is taken as shared by all rows.
    """
    u, force, std = (record[name].to_numpy(dtype=np.float64) for name in ("u_mm", "force_N", "force_std_N"))
    good = np.isfinite(u) & np.isfinite(force)
    u, force, std = u[good], force[good], std[good]
    moved = np.flatnonzero(u > _ONSET_DEPTHS * depth_mm)
    if moved.size < 5:
        return None
    still = np.flatnonzero(u[: moved[0]] <= 0)
    start = int(still[-1]) + 1 if still.size else 0
    # Rows at rest that noise puts ahead of zero: within its reach, and without the force that follows.
    reach = 3 * float(np.std(u[:start])) if start else 0.0
    loaded = (u[start:] > reach) | (force[start:] >= 0.5 * np.percentile(force[start : moved[0] + 1], 75))
    start += int(np.argmax(loaded))
    u, force, std = u[start:], force[start:], std[start:]
    noise = _row_noise(force)
    stop = int(np.argmax(u >= u.max() - 0.001 * depth_mm)) + 1
    step = _step(float(u.max()) / stop, noise, float(np.median(np.abs(force[:stop]))), depth_mm)
    ahead = np.flatnonzero(u[:stop] >= 0)
    std, force, u = std[ahead], force[ahead], u[ahead]
    place = np.unique((u / step).astype(np.int64), return_inverse=True)[1]
    counts = np.bincount(place)
    if counts.size < 5:
        return None

    def mean(values: Floats) -> Floats:
        return np.asarray(np.bincount(place, weights=values) / counts)

    shared = np.sqrt(np.maximum(mean(std**2) - noise**2, 0.0))
    return Curve(mean(u), mean(force), noise / np.sqrt(counts), shared, step)


def model_curve(force: pd.DataFrame, numerical_std_N: float, horizontal_share: float = 1.0) -> Curve:
    """The model's force history: a point a step, no noise, the numerical error shared.

    The model's force is P, inclined by wall friction; its horizontal share is what load cells measure.
    """
    u, P = force["u_mm"].to_numpy(dtype=np.float64), force["force_N"].to_numpy(dtype=np.float64)
    shared = np.full(u.size, horizontal_share * numerical_std_N)
    return Curve(u, horizontal_share * P, np.zeros(u.size), shared, 0.0)


def _step(row_mm: float, noise_N: float, force_N: float, depth_mm: float) -> float:
    """Travel to average over, mm."""
    rows = (noise_N / (_NOISE_SHARE * force_N)) ** 2 if force_N > 0 else np.inf
    longest = depth_mm / _STEPS_PER_DEPTH
    return float(max(min(rows * row_mm, longest), 2 * row_mm))


def _row_noise(force: Floats) -> float:
    """Noise of one row, from the spread of second differences: a smooth curve has next to none."""
    if force.size < 10:
        return 0.0
    second = np.diff(force, 2)
    return float(1.4826 * np.median(np.abs(second - np.median(second))) / np.sqrt(6.0))
