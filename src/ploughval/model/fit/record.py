"""A measured force history as a fit reads it: usable rows, switches of the band, the first rise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ploughval.errors import DataError

Floats = NDArray[np.float64]

LEAST_DROP = 0.08  # of the force: a shorter fall is not taken for a switch of the band ...
NOISES = 6.0  # ... nor one of fewer standard deviations of the noise
WINDOW_DEPTHS = 0.02  # running mean in which switches are looked for
WINDOWS_APART = (1, 3)  # means that are compared for the noise that is seen
START_DEPTHS = 0.1  # a peak before this is the first one, not a switch
RISE = 0.05  # of the first peak: a smaller rise before it is none


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Rows of a force history, and what stands out in them.

    Attributes
    ----------
    u_mm, force_N, noise_std_N : (N,) float
        Usable rows, in the order of travel.
    middles_mm : (K,) float
        Where the force has fallen half-way from the peak at a switch to the trough after it.
    turns_mm : (T,) float
        Peaks from which the force falls and the troughs after them, the first ones included.
    start_mm, start_std_mm : float
        Travel at which the model starts, and its standard uncertainty: above 0 where the force rises to its
        first peak, which the model does not describe.
    threshold : float
        Relative fall of the force from which on it is taken for a switch.
    left_out : int
        Rows that were not used: not finite, before the start, or within a fall that the record cuts off.
    """

    u_mm: Floats
    force_N: Floats
    noise_std_N: Floats
    middles_mm: Floats
    turns_mm: Floats
    start_mm: float
    start_std_mm: float
    threshold: float
    left_out: int

    @property
    def end_mm(self) -> float:
        """Travel of the last row."""
        return float(self.u_mm[-1])


def read_record(
    u_mm: ArrayLike,
    force_N: ArrayLike,
    noise_std_N: ArrayLike,
    depth_mm: float,
    *,
    least: int,
    start_std_mm: float = 0.0,
) -> Record:
    """Usable rows of a force history and the switches seen in them (docs/theory-fit.md, section 2).

    Parameters
    ----------
    u_mm, force_N : (N,) float
        Displacement and horizontal force.
    noise_std_N : float or (N,) float, N
        Noise of a row; where it is not positive, the median of the others.
    depth_mm : float
        Depth of the tip.
    least : int
        Number of unknowns: more rows are needed.
    start_std_mm : float
        Standard uncertainty of u = 0.

    Returns
    -------
    Record

    Raises
    ------
    DataError
        Too few usable rows.
    """
    u, force, std = (np.array(v, float) for v in np.broadcast_arrays(u_mm, force_N, noise_std_N))
    count = len(u)
    u, force, std = _usable(u, force, std, max(least, 3))
    smooth, rows = _running_mean(u, force, WINDOW_DEPTHS * depth_mm)
    noise = max(float(np.median(std)) / np.sqrt(rows), _noise_seen(smooth, rows))
    threshold = max(LEAST_DROP, NOISES * noise / max(float(np.median(np.abs(force))), 1e-12))
    falls = _falls(smooth, threshold)
    turns = np.array([u[k] for fall in falls for k in fall], float)
    first, start, spread = 0, 0.0, start_std_mm
    if falls and u[falls[0][0]] < START_DEPTHS * depth_mm:
        top = falls.pop(0)[0]
        rise = force[: top + 1].max() - force[: top + 1].min()
        if rise > max(RISE * smooth[top], NOISES * noise):
            # slip on the band starts between the first contact and the peak: uniform, GUM 4.3.7
            first, start = top, 0.5 * float(u[top])
            spread = float(np.hypot(start_std_mm, u[top] / np.sqrt(12.0)))
    last = _cut_off(smooth, falls, noise)
    middles = [_half_way(u, smooth, fall) for fall in falls]
    rows_used = slice(first, last)
    return Record(
        u[rows_used],
        force[rows_used],
        std[rows_used],
        np.array(middles, float),
        turns,
        start,
        spread,
        threshold,
        count - (last - first),
    )


def _usable(u: Floats, force: Floats, std: Floats, least: int) -> tuple[Floats, Floats, Floats]:
    """Rows with a force, in order of displacement, each with a noise."""
    keep = np.isfinite(u) & np.isfinite(force) & (u >= 0.0)
    if keep.sum() <= least:
        raise DataError(f"{keep.sum()} rows of the force record are usable; more than {least} are needed")
    order = np.argsort(u[keep], kind="stable")
    u, force, std = u[keep][order], force[keep][order], std[keep][order]
    good = np.isfinite(std) & (std > 0.0)
    std[~good] = np.median(std[good]) if good.any() else 0.01 * np.abs(force).max()
    return u, force, std


def _running_mean(u: Floats, force: Floats, window_mm: float) -> tuple[Floats, int]:
    """Running mean over a stretch of travel, and the rows in it."""
    spacing = max((u[-1] - u[0]) / max(len(u) - 1, 1), 1e-12)
    rows = int(np.clip(round(window_mm / spacing), 1, max(1, len(u) // 5)))
    rows += 1 - rows % 2
    summed = np.concatenate([[0.0], np.cumsum(force)])
    place = np.arange(len(force))
    half = np.minimum(np.minimum(place, len(force) - 1 - place), rows // 2)
    return (summed[place + half + 1] - summed[place - half]) / (2 * half + 1), rows


def _noise_seen(smooth: Floats, rows: int) -> float:
    """Noise of a running mean over so many rows, from means some windows apart.

    Second differences leave next to nothing of a smooth rise, and the median passes over falls. Where the
    rows' noise is not independent it is more than a mean of stated noises tells.
    """
    found = 0.0
    for lag in (windows * rows for windows in WINDOWS_APART):
        if len(smooth) < 10 * lag:
            break
        bends = smooth[2 * lag :] - 2.0 * smooth[lag:-lag] + smooth[: -2 * lag]
        found = max(found, 1.4826 * float(np.median(np.abs(bends - np.median(bends)))) / np.sqrt(6.0))
    return found


def _falls(force: Floats, threshold: float) -> list[tuple[int, int]]:
    """Peaks from which the force falls by more than a share of itself, each with the trough after it."""
    falls: list[tuple[int, int]] = []
    top = trough = 0
    falling = False
    for k, value in enumerate(force):
        if falling:
            if value < force[trough]:
                trough = k
            elif value > (1.0 + threshold) * force[trough]:
                falls.append((top, trough))
                falling, top = False, k
        elif value > force[top]:
            top = k
        elif value < (1.0 - threshold) * force[top]:
            falling, trough = True, k
    return [*falls, (top, trough)] if falling else falls


def _cut_off(force: Floats, falls: list[tuple[int, int]], noise: float) -> int:
    """Number of rows up to a fall that the end of the record cuts off; all of them where there is none."""
    start = falls[-1][1] if falls else 0
    top = start + int(np.argmax(force[start:]))
    lost = force[top] - force[-1]
    return top + 1 if top > start and lost > max(NOISES * noise, 0.02 * force[top]) else len(force)


def _half_way(u: Floats, force: Floats, fall: tuple[int, int]) -> float:
    """Where the force has fallen half-way from a peak to its trough."""
    top, trough = fall
    middle = 0.5 * (force[top] + force[trough])
    after = top + int(np.argmax(force[top : trough + 1] <= middle))
    share = (force[after - 1] - middle) / max(force[after - 1] - force[after], 1e-300)
    return float(u[after - 1] + share * (u[after] - u[after - 1]))
