"""A band's block at any travel, from the photographs in which it was seen.

docs/theory-mobilised.md, section 2.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.mobilised.block import Block

Floats = NDArray[np.float64]
_MOST_INTERVALS = 2.0  # of the photographs, over which the block is interpolated


@dataclass(frozen=True, slots=True, eq=False)
class BlockTrack:
    """A band's block at N travels; NaN where the photographs do not tell it.

    ``outcrop_mm``, ``area_mm2``, ``height_mm``, ``reach_mm``, ``face_mm`` are (N,). ``by_level``,
    ``by_height``, ``by_outcrop`` and ``by_scale`` (2, N) are the derivatives of area and height, as in
    :class:`Block`.
    ``share`` (K, N) is that of each of K photographs in the block; ``bend_mm2`` (N,) what its area may differ
    by between them (docs/theory-mobilised.md, Eq. (5)).
    """

    outcrop_mm: Floats
    area_mm2: Floats
    height_mm: Floats
    reach_mm: Floats
    face_mm: Floats
    by_level: Floats
    by_height: Floats
    by_outcrop: Floats
    by_scale: Floats
    share: Floats
    bend_mm2: Floats

    @property
    def beta_deg(self) -> Floats:
        """Inclination of the band, (N,) degrees."""
        return np.asarray(np.degrees(np.arctan2(self.height_mm, self.reach_mm)))


def track_block(
    u_mm: Floats, seen_mm: Floats, blocks: Sequence[Block], outcrop_mm: Floats, start_mm: float
) -> BlockTrack:
    """The block at given travels.

    From photograph to photograph area and height at the outcrop go on evenly. Up to the start of the band the
    sand at its outcrop rests, and the area of sand ahead of the blade stays: the height is that of the
    photograph before, the area grows by half the height for a millimetre (docs/theory-mobilised.md, Eq. (4)).

    Parameters
    ----------
    u_mm : (N,) float, mm
        Travels, ascending.
    seen_mm : (K,) float, mm
        Travels of the photographs in which the block is known, ascending.
    blocks : sequence of K Block
        The block in them.
    outcrop_mm : (N,) float, mm
        x of the outcrop.
    start_mm : float, mm
        Travel at which the band took over.

    Returns
    -------
    BlockTrack
    """
    if not len(blocks):
        nothing = np.full(len(u_mm), np.nan)
        pair = np.full((2, len(u_mm)), np.nan)
        none = np.empty((0, len(u_mm)))
        return BlockTrack(
            outcrop_mm, nothing, nothing, nothing, nothing, pair, pair, pair, pair, none, nothing
        )
    weights, resting = _weights(u_mm, seen_mm, start_mm)
    state = np.array([(b.area_mm2, b.height_mm) for b in blocks]).T  # (2, K)
    area, height = state @ weights
    area = area + (weights * state[1][:, None]).sum(axis=0) * resting / 2
    bad = ~_known(u_mm, seen_mm)
    area[bad] = height[bad] = np.nan

    def carried(name: str) -> Floats:
        """Derivatives in the photographs, carried to the travels."""
        values = np.array([getattr(b, name) for b in blocks]).T @ weights
        values[0] += values[1] * resting / 2
        return np.asarray(values)

    by = [carried(name) for name in ("by_level", "by_height", "by_outcrop", "by_scale")]
    between = np.diff(seen_mm, append=np.nan, prepend=np.nan)
    interval = float(np.nan_to_num(np.nanmedian(between))) if len(seen_mm) > 1 else 0.0
    # the area's second derivative is that of what flows over the outcrop, tan beta at most
    reach = outcrop_mm - u_mm
    bend = np.abs(height / reach) * 4 * (weights**2 * (1 - weights) ** 2).sum(axis=0) / 2 * interval**2
    face = np.array([b.face_mm for b in blocks]) @ weights
    return BlockTrack(outcrop_mm, area, height, reach, face, by[0], by[1], by[2], by[3], weights, bend)


def _weights(u_mm: Floats, seen_mm: Floats, start_mm: float) -> tuple[Floats, Floats]:
    """Share (K, N) of each photograph, and (N,) mm travelled since the last one before the band started."""
    count = len(seen_mm)
    left = np.clip(np.searchsorted(seen_mm, u_mm, side="right") - 1, 0, max(count - 2, 0))
    right = np.minimum(left + 1, count - 1)
    before = int(np.searchsorted(seen_mm, start_mm, side="right")) - 1
    begin = seen_mm[left].copy()
    resting = np.zeros(len(u_mm))
    if 0 <= before < count - 1:
        # within the interval in which the band starts, the block moves on evenly from its start only
        within = (left == before) & (u_mm > seen_mm[before]) & (u_mm < seen_mm[before + 1])
        begin[within] = start_mm
        resting[within] = np.minimum(u_mm[within], start_mm) - seen_mm[before]
    span = np.where(right > left, seen_mm[right] - begin, 1.0)
    share = np.where(right > left, (u_mm - begin) / np.where(span > 0, span, 1.0), 0.0)
    share = np.where(begin > seen_mm[left], np.maximum(share, 0.0), share)
    weights = np.zeros((count, len(u_mm)))
    column = np.arange(len(u_mm))
    weights[left, column] += 1 - share
    weights[right, column] += share
    return weights, resting * (1 - share)


def _known(u_mm: Floats, seen_mm: Floats) -> NDArray[np.bool_]:
    """Whether photographs near enough stand about a travel, or one interval beyond its last or first two."""
    if len(seen_mm) < 2:
        return np.asarray(u_mm == seen_mm[0])
    step = float(np.median(np.diff(seen_mm)))
    right = np.clip(np.searchsorted(seen_mm, u_mm), 1, len(seen_mm) - 1)
    near = seen_mm[right] - seen_mm[right - 1] <= (_MOST_INTERVALS + 1e-6) * step
    return np.asarray(near & (u_mm >= seen_mm[0] - 1e-9) & (u_mm <= seen_mm[-1] + step))
