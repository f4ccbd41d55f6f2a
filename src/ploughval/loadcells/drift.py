"""Zeros that wander: offsets of the cells over the whole record, and what is not known of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.zero import Zero

Floats = NDArray[np.float64]
_LEVELLING = 1 / 3
"""Mean square, in squares of the drift taken off beyond the rest, of what is too much where it stopped."""
_BOW = 1 / 48
"""Variance, in squares of the drift between two rests, of a bow of up to a quarter of it (rectangular)."""


@dataclass(frozen=True, slots=True, eq=False)
class ZeroLine:
    """Offsets of the two cells at every row.

    Attributes
    ----------
    offset : (2, N) or (2, 1) float, unit of the log
        To be taken off the readings.
    parts : tuple of (name, cov, weight, value)
        Covariances (2, 2) of the offsets, each with its factor: a number, or (N,) one a row; and the offset
        (2,) that was read for it, 0 where nothing was.
    total : (2,) float, unit of the log
        Drift over the record that ``offset`` follows; 0 where it is constant.
    """

    offset: Floats
    parts: tuple[tuple[str, Floats, Floats | float, Floats], ...]
    total: Floats


def zero_line(time_s: Floats, start: Zero, end: Zero | None = None) -> ZeroLine:
    """Zeros over a record from its rest before motion and, where there is one, from a rest after it.

    Between two rests, and in them, the zeros run straight. With the first rest alone they are constant,
    unless they drift there beyond three standard deviations: then the drift goes on at its rate, and the part
    beyond the rest is as uncertain as one that may have stopped at any moment since (rectangular from nothing
    to all of it, about all of it; JCGM 100:2008, 4.3.7).

    Parameters
    ----------
    time_s : (N,) float, s
        Times of the record.
    start, end : Zero
        Rest before motion, and rest with the cells unloaded after it.

    Returns
    -------
    ZeroLine
    """
    if end is not None:
        span = end.middle_s - start.middle_s
        within = np.clip(time_s, start.end_s - start.span_s, end.end_s)
        along = (within - start.middle_s) / span
        drift = end.mean - start.mean
        bow = np.outer(drift, drift) * _BOW
        between: tuple[tuple[str, Floats, Floats | float, Floats], ...] = (
            ("zero offset before motion", start.mean_cov, (1 - along) ** 2, start.mean),
            ("zero offset at the end", end.mean_cov, along**2, end.mean),
            ("drift that is not straight", bow, (4 * along * (1 - along)) ** 2, np.zeros(2)),
        )
        return ZeroLine(start.mean[:, None] + drift[:, None] * along, between, drift)
    if not start.drifts or start.span_s <= 0:
        return ZeroLine(start.mean[:, None], (("zero offset", start.mean_cov, 1.0, start.mean),), np.zeros(2))
    slope, slope_cov = start.drift / start.span_s, start.drift_cov / start.span_s**2
    after = time_s - start.middle_s
    beyond = np.maximum(time_s - start.end_s, 0.0)
    parts: tuple[tuple[str, Floats, Floats | float, Floats], ...] = (
        ("zero offset", start.mean_cov, 1.0, start.mean),
        ("rate of the drift", slope_cov, after**2, np.zeros(2)),
        ("drift that may have stopped", np.outer(slope, slope) * _LEVELLING, beyond**2, np.zeros(2)),
    )
    last = float(after[-1]) if after.size else 0.0
    return ZeroLine(start.mean[:, None] + slope[:, None] * after, parts, slope * last)
