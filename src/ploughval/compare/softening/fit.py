"""The softening line of one band, or of several together, with the limits of its three numbers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.mobilised.curve import BandCurve
from ploughval.compare.softening.interval import Interval, limits
from ploughval.compare.softening.law import Law
from ploughval.compare.softening.problem import PEAK, RESIDUAL, Noise, Problem, Solved
from ploughval.compare.softening.rows import FittedRows, rows_of

Floats = NDArray[np.float64]
CLEAR = 9.0  # of chi-square beyond the best: worse fits tell nothing
_PLACES = 25  # starts that are tried
_LENGTHS = 28  # mobilization lengths of the cover, up to
_BEYOND = 3.0  # times the most slip
_CLOSER, _PARTS = 3, 7  # times that a range of lengths is narrowed, by so many tried
_STEP, _STRIDE = 2e-3, 1.6  # first step away from the best length, relative, and by what the next is longer
_DENSE = 24  # lengths between those that fit
# starts and lengths are found from a cover of them: with a floor of the noise, which is too coarse for less
_COARSE = Noise(shared=0.0, floor_deg=0.5)
_DRIFTS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
_ENDLESS = 1e9  # a mobilization length without softening, mm


@dataclass(frozen=True, slots=True)
class Softening:
    """The softening line of one band, or of several together.

    Attributes
    ----------
    peak, residual : Interval, degrees
    length : Interval, mm
    origins : tuple of (float, float), mm
        Travel at which each band's slip began, and its standard uncertainty.
    rows : int
        Rows that were fitted.
    least_slip_mm, most_slip_mm : float, mm
        Slip of the first and of the last row.
    scatter, drift : float
        By which rows scatter more than their noise, and bands drift more than the surface's level tells: the
        stds were multiplied by them.
    gain : float
        By which an exponential fall has the lower AICc; negative: the straight one has.
    level : Interval, degrees
        One and the same friction of all rows.
    fall : float
        By which a fall at all has a lower AICc than one and the same friction.
    """

    peak: Interval
    residual: Interval
    length: Interval
    origins: tuple[tuple[float, float], ...]
    rows: int
    least_slip_mm: float
    most_slip_mm: float
    scatter: float
    drift: float
    gain: float
    level: Interval
    fall: float


def fit_softening(curves: Sequence[BandCurve], depth_mm: float) -> Softening | None:
    """Fit peak, residual and mobilization length to the mobilised friction of one or several bands.

    Parameters
    ----------
    curves : sequence of BandCurve
        The bands, which share peak, residual, length and the common sources of uncertainty.
    depth_mm : float, mm
        Of the tip.

    Returns
    -------
    Softening or None
        None with fewer than 8 rows after the bands' starts.
    """
    rows = [one for one in (rows_of(curve, depth_mm) for curve in curves) if one is not None]
    if not rows:
        return None
    lengths = _lengths(rows)
    origins = np.array([_origin(band, lengths) for band in rows])
    coarse = Problem(rows, _COARSE)
    found = _closer(coarse, _profile(coarse, lengths[::2], origins))
    found = _closer(Problem(rows, Noise()), found)
    length, least = min(found, key=lambda pair: pair[1].chi2)
    noise = _noise(rows, length, least.origins)
    problem = Problem(rows, noise)
    found = _around(problem, length, least.origins, (float(lengths[0]), float(lengths[-1])))
    length, least = min(found, key=lambda pair: pair[1].chi2)
    levels = [(x, problem.levels(x, one)) for x, one in found if one.chi2 <= least.chi2 + CLEAR]
    slips = [
        band.curve.slip_at(o, band.curve.u_mm) for band, o in zip(rows, least.origins.tolist(), strict=True)
    ]
    other = _exponential(rows, noise, lengths, least.origins)
    level = problem.solve(_ENDLESS, least.origins)
    steady = problem.levels(_ENDLESS, level)
    origin_std = np.hypot(np.sqrt(np.diag(least.cov))[3::2], problem.resolution)
    return Softening(
        peak=_angle(levels, PEAK),
        residual=_angle(levels, RESIDUAL),
        length=limits(
            np.array([x for x, _ in found]), np.array([one.chi2 for _, one in found]), length
        ).widened(np.sqrt(2.0) * problem.resolution),
        origins=tuple(zip(least.origins.tolist(), origin_std.tolist(), strict=True)),
        rows=len(problem.target),
        least_slip_mm=float(min(s[s > 0].min(initial=np.inf) for s in slips)),
        most_slip_mm=float(max(s.max() for s in slips)),
        scatter=noise.fresh,
        drift=noise.drift,
        gain=least.chi2 - other,
        level=_angle([(_ENDLESS, steady)], PEAK),
        fall=_criterion(level.chi2, 1, len(problem.target)) - _criterion(least.chi2, 3, len(problem.target)),
    )


def _noise(rows: Sequence[FittedRows], length: float, origins: Floats) -> Noise:
    """Factors on the slow error, by greatest likelihood at given length and origins, and on the noise."""
    tried = []
    for factor in _DRIFTS:
        problem = Problem(rows, Noise(factor))
        chi2 = problem.best(length, origins).chi2
        tried.append((chi2 + problem.spread, factor, chi2 / max(len(problem.target) - problem.count, 1)))
        if tried[-1] > min(tried):
            break  # a larger factor would be less likely still
    _, factor, share = min(tried)
    return Noise(factor, float(np.sqrt(max(share, 1.0))))


def _criterion(chi2: float, parameters: int, rows: int) -> float:
    """AICc (Hurvich & Tsai 1989) but for a constant."""
    return chi2 + 2 * parameters * rows / max(rows - parameters - 1, 1)


def _lengths(rows: Sequence[FittedRows]) -> Floats:
    """Mobilization lengths that are tried, mm: from half a step to well beyond the most slip."""
    least = min(float((b.curve.width_mm * b.curve.stretch).min()) for b in rows) / 2
    most = max(float(b.curve.slip_at(b.low, b.curve.u_mm[-1:])[0]) for b in rows)
    return np.geomspace(least, _BEYOND * most, _LENGTHS)


def _origin(band: FittedRows, lengths: Floats) -> float:
    """Where the slip of one band begins, from a cover of starts and lengths, mm."""
    alone = Problem([band], _COARSE)
    tried = [
        (alone.solve(length, np.array([place])).chi2, place)
        for place in np.linspace(band.low, band.high, _PLACES).tolist()
        for length in lengths[::3].tolist()
    ]
    return float(min(tried)[1])


def _profile(problem: Problem, lengths: Floats, origins: Floats) -> list[tuple[float, Solved]]:
    """Best fit at each of some lengths, ascending."""
    return [(length, problem.best(length, origins)) for length in lengths.tolist()]


def _closer(problem: Problem, found: list[tuple[float, Solved]]) -> list[tuple[float, Solved]]:
    """Fits about the best length of a profile, ever closer to it."""
    for _ in range(_CLOSER):
        best = int(np.argmin([one.chi2 for _, one in found]))
        ends = found[max(best - 1, 0)][0], found[min(best + 1, len(found) - 1)][0]
        found = _profile(problem, np.geomspace(*ends, _PARTS), found[best][1].origins)
    return found


def _around(
    problem: Problem, length: float, origins: Floats, ends: tuple[float, float]
) -> list[tuple[float, Solved]]:
    """The profile about a length: out to where nothing fits or the range ends, then denser within."""
    found = [(length, problem.best(length, origins))]
    for end in ends:
        step, at, start = _STEP * np.sign(end - length), length, found[0][1].origins
        while at != end:
            at = float(np.clip(at * np.exp(step), *ends))
            found.append((at, problem.best(at, start)))
            start, step = found[-1][1].origins, step * _STRIDE
            if found[-1][1].chi2 > min(one.chi2 for _, one in found) + CLEAR:
                break
    found.sort(key=lambda pair: pair[0])
    best = min(found, key=lambda pair: pair[1].chi2)[1]
    good = [k for k, (_, one) in enumerate(found) if one.chi2 <= best.chi2 + CLEAR]
    first, last = max(good[0] - 1, 0), min(good[-1] + 1, len(found) - 1)
    inner = np.geomspace(found[first][0], found[last][0], _DENSE)[1:-1]
    return sorted([*found, *_profile(problem, inner, best.origins)], key=lambda pair: pair[0])


def _exponential(rows: Sequence[FittedRows], noise: Noise, lengths: Floats, origins: Floats) -> float:
    """Chi-square of an exponential fall in place of the straight one."""
    coarse = Problem(rows, _COARSE, Law.EXPONENTIAL)
    found = [(length, coarse.solve(length, origins)) for length in lengths.tolist()]
    found = _closer(Problem(rows, noise, Law.EXPONENTIAL), _closer(coarse, found))
    return min(one.chi2 for _, one in found)


def _angle(found: Sequence[tuple[float, Solved]], which: int) -> Interval:
    """Profile of an angle over all lengths."""
    values = np.array([one.values[which] for _, one in found])
    variance = np.array([one.cov[which, which] for _, one in found])
    chi2 = np.array([one.chi2 for _, one in found])
    best = float(values[int(np.argmin(chi2))])
    spread = float(np.sqrt(variance.max()))
    grid = np.linspace(max(values.min() - 4 * spread, 0.0), min(values.max() + 4 * spread, 90.0), 2001)
    profile = (chi2[:, None] + (grid - values[:, None]) ** 2 / variance[:, None]).min(axis=0)
    return limits(grid, profile, best)
