"""The line through the tip that parts a moving block from sand at rest (docs/theory-bands.md, section 3)."""

from dataclasses import dataclass

import numpy as np

from ploughval.tracers.increment import Motion, cells_of
from ploughval.tracers.shares import Shares, height_above, shares_of
from ploughval.tracers.view import Floats

_LEAST_POINTS = 4  # on either side of a line
_ROUNDS = 3
_WIDTHS = np.array([0.03, 0.07, 0.15, 0.35])  # of the change from rest to motion, in subsets
_ALL_DEG = np.arange(2.0, 89.0, 0.25)
_SPAN_DEG = np.arange(-3.0, 3.01, 0.25)  # about the best angle
_SPANS = (1.0, 3.0, 9.0)
_FALLEN = 8.0  # logarithms by which the posterior is down where it is left
_FINE = np.linspace(-4.0, 4.0, 33)  # about the mean, in standard deviations
_SIDE_SUBSETS = 1 / 50  # std with which correlation parts the sides of a band (measured, section 7)
_ONE_SIDED = 3.0  # so much more where one side has no points
_SWEPT = 0.05  # of half of what the line sweeps in an increment: when a point on the way is given up
_LEVER = 1.5  # angle of the line through the tip that fits an even offset along a length of 1
_LEAST_STD_DEG = 0.004
_LEAST_EVIDENCE = 10.0  # logarithm of the likelihood ratio of a line to no motion at all
_KEPT_STDS = 3.5  # vectors of the block further from its median are left out of its velocity


@dataclass(frozen=True, slots=True, eq=False)
class BandLine:
    """A shear band through the tip.

    Attributes
    ----------
    beta_deg, std_deg : float
        Inclination, half-way through the increment, and its standard deviation.
    shared_std_deg : float
        The part of it that increments of one band have in common.
    width_mm : float
        Standard width of the change from rest to motion, across the band.
    velocity, velocity_std : (2,) float, mm/mm
        Motion of the block for a millimetre of the blade's travel.
    """

    beta_deg: float
    std_deg: float
    shared_std_deg: float
    width_mm: float
    velocity: Floats
    velocity_std: Floats


def fit_line(motion: Motion) -> BandLine | None:
    """Fit block, line and width.

    Parameters
    ----------
    motion : Motion
        Of the points ahead of the blade.

    Returns
    -------
    BandLine or None
        None where nothing moves with the blade.
    """
    shares, angle = shares_of(motion, np.array([1.0, 0.0]), None), np.nan
    evidence = 0.0
    for _ in range(_ROUNDS):
        better, lead = _best(shares)
        if not np.isfinite(better):
            break  # no rigid block; the line found so far stands
        angle, evidence = better, max(evidence, lead)
        shares = shares_of(motion, block_velocity(motion, angle)[0], angle)
    if not np.isfinite(angle) or evidence < _LEAST_EVIDENCE:
        return None
    mean, std, width = _posterior(shares, angle)
    velocity, velocity_std = block_velocity(motion, mean)
    shared = _side_std(shares, mean)
    return BandLine(
        float(np.degrees(mean)), float(np.degrees(np.hypot(std, shared))), float(np.degrees(shared)),
        width, velocity, velocity_std,
    )  # fmt: skip


def _best(shares: Shares) -> tuple[float, float]:
    """Likeliest angle, rad (NaN where a side has too few points), and its evidence against rest."""
    angles = np.radians(_ALL_DEG)
    logs = shares.cuts(angles)
    angle = float(angles[int(np.argmax(logs))])
    moving = height_above(shares.place, angle) > 0
    enough = (moving & (shares.share > 0.5)).sum() >= _LEAST_POINTS and (~moving).sum() >= _LEAST_POINTS
    return (angle if enough else np.nan), float(logs.max() - shares.at_rest())


def block_velocity(motion: Motion, angle: float) -> tuple[Floats, Floats]:
    """Velocity (2,) of the block above a line and its std: a mean less strays.

    docs/theory-bands.md, Eqs (1) and (8).
    """
    above = height_above(motion.place, angle)
    clear = above > motion.reach_mm / 2
    if clear.sum() < _LEAST_POINTS:
        clear = above > 0
    rate, place = motion.rate[clear], motion.place[clear]
    off = np.abs(rate - np.median(rate, axis=0)).max(axis=1)
    kept = off <= max(_KEPT_STDS * 1.4826 * float(np.median(off)), 1e-9)
    rate, place = rate[kept], place[kept]
    velocity = rate.mean(axis=0)
    count, cell = cells_of(place, 2 * motion.reach_mm)
    # what subsets share within a cell counts once
    sums = np.stack([np.bincount(cell, off, count) for off in (rate - velocity).T], axis=1)
    spread = np.sqrt((sums**2).sum(axis=0) * count / max(count - 1, 1)) / len(rate)
    return velocity, spread


def _posterior(shares: Shares, angle: float) -> tuple[float, float, float]:
    """Mean and std of the angle's posterior, rad, and the likeliest width, mm.

    docs/theory-bands.md, Eq. (7). Coarse over the neighbourhood, fine about its top; widths have even weight
    for their logarithm.
    """
    reach = shares.reach_mm
    for span in _SPANS:  # wider where a gap in the field leaves the line open
        wide = _inside(angle + np.radians(span * _SPAN_DEG))
        near = shares.near(float(wide[0]), float(wide[-1]), reach)
        coarse = near.logs(wide, _WIDTHS * reach)
        logs = np.logaddexp.reduce(coarse, axis=0)
        if max(logs[0], logs[-1]) < logs.max() - _FALLEN:
            break
    mean, std = moments(wide, np.logaddexp.reduce(coarse, axis=0))
    angles, table = wide, coarse
    for _ in range(2):
        fine = _inside(mean + max(std, np.radians(_LEAST_STD_DEG)) * _FINE)
        table = np.concatenate([coarse, near.logs(fine, _WIDTHS * reach)], axis=1)
        angles, order = np.unique(np.concatenate([wide, fine]), return_index=True)
        table = table[:, order]
        logs = np.logaddexp.reduce(table, axis=0)
        mean, std = moments(angles, logs)
    width = float(_WIDTHS[int(np.argmax(table.max(axis=1)))] * reach)
    return mean, std, width


def _side_std(shares: Shares, angle: float) -> float:
    """Std of the angle, rad, from what correlation does beside a band (docs/theory-bands.md, Eq. (9)).

    It decides to within a part of a subset on which side a point lies, alike along the band; points of both
    sides check each other, and where those of one side are lost nothing does.
    """
    above = height_above(shares.place, angle)
    moving, still = ((side > 0) & (side < shares.reach_mm) for side in (above, -above))
    fewer = min(moving.sum(), still.sum()) / max(moving.sum(), still.sum(), 1)
    offset = _SIDE_SUBSETS * (1 + _ONE_SIDED * max(0.0, 1 - 2 * fewer)) * shares.reach_mm
    swept = _SWEPT * 0.5 * shares.travel_mm * np.sin(angle)
    return float(_LEVER * np.hypot(offset, swept) / shares.far_mm)


def _inside(angles: Floats) -> Floats:
    return np.asarray(angles[(angles > np.radians(0.5)) & (angles < np.radians(89.5))])


def moments(places: Floats, logs: Floats) -> tuple[float, float]:
    """Mean and standard deviation of a density given by its logarithm at places (trapezoidal rule)."""
    density = np.exp(logs - logs.max())
    total = np.trapezoid(density, places)
    mean = float(np.trapezoid(density * places, places) / total)
    return mean, float(np.sqrt(np.trapezoid(density * (places - mean) ** 2, places) / total))
