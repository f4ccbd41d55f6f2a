"""When the blade meets the sand: where the force leaves what noise and friction can make."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_NOISES = 5.0  # a mean of a few rows this many of its standard deviations above rest is a force
_LEVELS = 3.0  # and above as many of what is not known of its level
_ROWS = 5
_HOLDS = 20  # rows over which the force must stay above
_MOST_ROWS = 400  # about the rise that are looked at


@dataclass(frozen=True, slots=True)
class Contact:
    """First contact: time, travel of the blade until then, and the standard uncertainty of that travel."""

    time_s: float
    u_mm: float
    std_mm: float


def find_contact(
    time_s: Floats, u_mm: Floats, force_N: Floats, *, onset: int, noise_N: float, level_std_N: float = 0.0
) -> Contact | None:
    """Find where a compensated force first leaves its noise.

    Parameters
    ----------
    time_s, u_mm, force_N : (N,) float
        Record; NaN rows are passed over. ``u_mm`` counts from rest.
    onset : int
        Row from which the blade moves.
    noise_N : float
        Noise of one sample of the force.
    level_std_N : float
        Standard uncertainty of the force without a load, noise apart: zeros and friction.

    Returns
    -------
    Contact or None
        None where the force never stays above its noise. The travel is that where a straight rise, fitted up
        to twice the force that can be told from noise, begins.
    """
    rows = np.flatnonzero(np.isfinite(force_N) & np.isfinite(u_mm))
    rows = rows[rows >= onset]
    if rows.size < _ROWS:
        return None
    force = force_N[rows]
    means = np.convolve(force, np.full(_ROWS, 1.0 / _ROWS), mode="valid")
    limit = _NOISES * noise_N / np.sqrt(_ROWS) + _LEVELS * level_std_N
    limit = max(float(limit), 1e-9 * float(np.abs(force).max()))
    first = _first_lasting(means > limit)
    if first is None:
        return None
    sure = np.flatnonzero(means[first:] >= 2 * limit)
    last = first + (int(sure[0]) if sure.size else _HOLDS) + _ROWS
    near = np.arange(max(first - 3 * (last - first) - _HOLDS, 0), min(last, force.size))
    near = near[:: -(-near.size // _MOST_ROWS)]
    u = np.abs(u_mm[rows] - u_mm[rows[near[0]]])
    start, slope = _rise(u[near], force[near])
    told = min(first + _ROWS // 2, force.size - 1)
    if slope <= 0:
        std = _without_rise(u, int(near[0]), told)
        return Contact(float(time_s[rows[told]]), float(u_mm[rows[told]]), std)
    begin = int(near[start])
    told_mm = abs(float(u[told] - u[begin]))
    row_mm = float(u[near[-1]] - u[near[0]]) / max(near.size - 1, 1)
    fitted = 2 * noise_N / (slope * np.sqrt(near.size - start))  # x-intercept of a line on one side of it
    std = np.sqrt(fitted**2 + (level_std_N / slope) ** 2 + row_mm**2 / 3 + told_mm**2 / 12)
    return Contact(float(time_s[rows[begin]]), float(u_mm[rows[begin]]), float(std))


def _without_rise(u: Floats, earliest: int, told: int) -> float:
    """Standard uncertainty of a contact where the force is told but its travel shows no rise, mm.

    The displacement is coarser than the rise: the contact is anywhere since the earliest row, and the travel
    anywhere in the displacement's step (both rectangular).
    """
    beyond = u[told:][u[told:] > u[told]]
    step = float(beyond[0] - u[told]) if beyond.size else 0.0
    return float(np.hypot(u[told] - u[earliest], step) / np.sqrt(3))


def _first_lasting(above: NDArray[np.bool_]) -> int | None:
    """First place from which ``above`` holds for a while, or to the end."""
    left = np.minimum(_HOLDS, np.arange(above.size, 0, -1))
    count = np.concatenate([[0], np.cumsum(above)])
    stays = count[np.minimum(np.arange(above.size) + _HOLDS, above.size)] - count[:-1] == left
    return int(np.argmax(stays)) if stays.any() else None


def _rise(u: Floats, force: Floats) -> tuple[int, float]:
    """Row at which a force that is nothing and then rises straight begins to; its slope, N/mm, or 0."""
    lever = np.maximum(u[None, :] - u[:-1, None], 0.0)
    power = np.maximum((lever**2).sum(axis=1), np.finfo(float).tiny)
    product = lever @ force
    start = int(np.argmax(np.where(product > 0, product**2 / power, 0.0)))
    return start, max(float(product[start] / power[start]), 0.0)
