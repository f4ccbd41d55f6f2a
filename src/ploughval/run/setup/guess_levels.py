"""Guesses of levels in the first photograph: the sand's surface at rest, the blade's tip, dyed layers."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Image = NDArray[np.float32]
Stack = NDArray[np.float32]

_BLOCKS = 24  # parts of the picture's width that must agree
_AGREE = 0.8  # share of them
_HALF_PX = 6  # rows above and below a level that are compared
_LEAST_GREY = 4.0
_LEAST_DEVIATIONS = 3.0
_AS_STRONG = 0.35  # of the strongest level's contrast
_STILL_SHARE = 0.05  # of the rows under the surface, at least, lie under the tip
_CHANGED, _CHANGED_GREY = 3.0, 2.0  # times and grey levels above what stays: changed, however much
_NEAR_TIP_PX = 10
_STEP_SHARE = 0.5  # what a step must explain of the variance, to be sure
_LAYER_DEVIATIONS = 5.0
_LAYER_GREY = 6.0
_LEAST_LEFT_PX = 3.0  # columns that the blade has left
_LEAST_ROWS = 2
_LEAST_SAND_ROWS, _LEAST_SAND_COLUMNS = 12, 32
_OF_STRONGEST = 0.4  # a band fainter than this share of the strongest is none
_BODY_PX = 2  # of the blade, from its edges, that is not looked at


@dataclass(frozen=True, slots=True)
class Level:
    """A row, and whether nothing else could be meant."""

    row: float
    sure: bool


def surface_level(image: Image, columns: NDArray[np.bool_]) -> Level | None:
    """The topmost level at which grey or texture changes all along the picture.

    Parameters
    ----------
    image : (h, w) float32
        The first photograph.
    columns : (w,) bool
        Those to look at: without the blade.
    """
    channels = [image, _texture(image)]
    shares, contrasts = zip(*(_levels(channel[:, columns]) for channel in channels), strict=True)
    share, contrast = np.max(shares, axis=0), np.max(contrasts, axis=0)
    good = np.flatnonzero(share >= _AGREE)
    good = good[contrast[good] >= _AS_STRONG * contrast[good].max(initial=0.0)]
    if not good.size:
        return None
    peak = int(good[0])
    while contrast[peak + 1 : peak + 3].max(initial=0.0) > contrast[peak]:
        peak += 1
    return Level(sharpened(image[:, columns], peak), bool(share[peak] > 0.95))


def _texture(image: Image) -> Image:
    """Roughness of the grey along the rows."""
    rough = np.zeros_like(image)
    rough[:, 1:] = np.abs(np.diff(image, axis=1))
    return rough


def _levels(channel: Image) -> tuple[Floats, Floats]:
    """Of every row border: share of the blocks that agree on a change there, and its size in deviations."""
    height, width = channel.shape
    edges = np.linspace(0, width, min(_BLOCKS, max(width // 8, 1)) + 1).astype(int)
    blocks = np.stack([channel[:, a:b].mean(axis=1) for a, b in pairwise(edges)])
    total = np.cumsum(np.pad(blocks.astype(float), ((0, 0), (1, 0))), axis=1)
    half = min(_HALF_PX, max(height // 8, 1))
    rows = np.arange(half, height - half)
    below = (total[:, rows + half] - total[:, rows]) / half
    above = (total[:, rows] - total[:, rows - half]) / half
    change = below - above
    noise = 1.4826 * np.median(np.abs(np.diff(blocks, axis=1))) + 1e-3
    size = np.abs(change)
    clear = size >= max(_LEAST_DEVIATIONS * noise / np.sqrt(half), _LEAST_GREY / 4)
    signed = np.where(clear, np.sign(change), 0).sum(axis=0)
    share, contrast = np.zeros(height), np.zeros(height)
    share[rows] = np.abs(signed) / len(blocks)
    contrast[rows] = np.abs(np.median(change, axis=0)) / noise
    return share, contrast


def sharpened(image: Image, row: int) -> float:
    """Where the mean grey of the rows is half way between that above a level and that below it."""
    low, high = max(row - _HALF_PX, 0), min(row + _HALF_PX, len(image))
    profile = np.median(image[low:high], axis=1).astype(float)
    if len(profile) < 2 * 3:
        return float(row)
    middle = (profile[:3].mean() + profile[-3:].mean()) / 2
    side = profile - middle
    cross = np.flatnonzero(side[:-1] * side[1:] <= 0)
    if not cross.size:
        return float(row)
    k = int(cross[np.argmin(np.abs(cross + low + 0.5 - row))])
    rise = side[k + 1] - side[k]
    return low + k - (side[k] / rise if rise else -0.5)


def tip_level(images: Stack, blade: tuple[float, float], travel: Floats, below: float) -> Level | None:
    """The lower end of the blade: under it the sand stays as it was when the blade has gone.

    Parameters
    ----------
    images : (K, h, w) float32
        Photographs in their order.
    blade : (float, float)
        Columns of face and back in the first one.
    travel : (K,) float
        How far the blade has gone in each, to the right; NaN where it was not seen.
    below : float
        Row of the surface of the sand.
    """
    face, back = blade
    gone = np.abs(np.nan_to_num(travel))
    reach = min(float(gone.max()) - _BODY_PX, abs(face - back))  # of the columns that it leaves
    top = max(int(below), 0)
    left = _columns(back, back + np.copysign(reach, face - back), images.shape[2])
    whole = _columns(back, face, images.shape[2])
    later = gone >= reach + _BODY_PX / 2
    if reach < _LEAST_LEFT_PX or not later.any() or images.shape[1] - top < _LEAST_SAND_ROWS:
        return None
    change = np.abs(images[later, top:, left] - images[0, top:, left]).mean(axis=2)
    middle = np.median(change, axis=0).astype(float)
    still = float(np.quantile(middle, _STILL_SHARE))
    row, explained = _step_down(np.minimum(middle, _CHANGED * still + _CHANGED_GREY))
    end = _end_of_body(images[0, top:, whole], row)
    if end is not None:
        return Level(top + end - 0.5, explained >= _STEP_SHARE)
    return Level(top + row - 0.5, False)


def _columns(start: float, end: float, width: int) -> slice:
    """Whole columns well inside of two edges; all between them where that leaves none."""
    low, high = sorted((start, end))
    first, last = int(np.ceil(low)) + _BODY_PX, int(np.floor(high)) - _BODY_PX + 1
    if last - first < 1:
        first, last = int(np.floor(low)), int(np.ceil(high)) + 1
    return slice(max(first, 0), min(last, width))


def _end_of_body(blade: Image, row: int) -> int | None:
    """First row near another one at which the grey of the blade's columns is no longer that of the blade.

    Sand just under the tip is dragged along: where the changes end lies a little too low.
    """
    low, high = max(row - _NEAR_TIP_PX, 0), min(row + _NEAR_TIP_PX, len(blade))
    body = blade[max(low - 4 * _NEAR_TIP_PX, 0) : low]
    if len(body) < _NEAR_TIP_PX or high - low < _NEAR_TIP_PX:
        return None
    usual = np.median(body, axis=0)
    off = np.abs(blade - usual).mean(axis=1).astype(float)
    scatter = float(np.median(off[max(low - 4 * _NEAR_TIP_PX, 0) : low]))
    near = np.minimum(off[low:high], _CHANGED * scatter + _LEAST_GREY)
    end, explained = _step_down(-near)
    return low + end if explained >= _STEP_SHARE else None


def _step_down(values: Floats) -> tuple[int, float]:
    """First row of the lower part of a profile that is high, then low; the share of variance it explains."""
    count = len(values)
    total, square = np.cumsum(values), float(np.sum((values - values.mean()) ** 2))
    k = np.arange(3, count - 2)
    if not k.size or square <= 0:
        return count, 0.0
    high, low = total[k - 1] / k, (total[-1] - total[k - 1]) / (count - k)
    gain = np.where(high > low, k * (count - k) / count * (high - low) ** 2, 0.0)
    best = int(np.argmax(gain))
    return int(k[best]), float(gain[best]) / square


@dataclass(frozen=True, slots=True)
class Bands:
    """Level bands of one tint: their middles above the tip and their thickness, px; ``dark`` or pale."""

    above_px: tuple[float, ...]
    thick_px: float
    dark: bool

    def scaled(self, factor: float) -> "Bands":
        """The same in pixels that are so many times smaller."""
        return Bands(tuple(factor * h for h in self.above_px), factor * self.thick_px, self.dark)


def find_layers(image: Image, columns: NDArray[np.bool_], surface: float, tip: float) -> Bands | None:
    """Dark or pale bands that run level through the sand between surface and tip; None where none stands out.

    Parameters
    ----------
    image : (h, w) float32
        The first photograph.
    columns : (w,) bool
        Those of the sand ahead of the blade.
    surface, tip : float
        Rows.
    """
    top, bottom = int(np.ceil(surface)) + 2, int(np.floor(tip)) + 1
    if bottom - top < _LEAST_SAND_ROWS or columns.sum() < _LEAST_SAND_COLUMNS:
        return None
    sand = image[top:bottom, columns]
    profile = np.median(sand, axis=1).astype(float)
    window = max(3, (bottom - top) // 3) | 1
    off = profile - _running_median(profile, window)
    limit = max(_LAYER_GREY, _LAYER_DEVIATIONS * _row_noise(sand))
    dark = bool(-off.min() > off.max())
    tint = -off if dark else off
    limit = max(limit, _OF_STRONGEST * float(tint.max()))
    spans = [
        (a, b) for a, b in _runs(tint > limit) if a > 0 and b < len(off) and _LEAST_ROWS <= b - a < window
    ]
    if not spans:
        return None
    middles = tuple(sorted(round(tip - (top + (a + b - 1) / 2), 1) for a, b in spans))
    thick = float(np.median([tint[a:b].sum() / tint[a:b].max() for a, b in spans]))
    return Bands(middles, thick, dark)


def _row_noise(sand: Image) -> float:
    """Standard deviation of a row's median grey by the grains: what its two halves do not share."""
    half = sand.shape[1] // 2
    apart = np.median(sand[:, :half], axis=1) - np.median(sand[:, half:], axis=1)
    return 1.4826 * float(np.median(np.abs(apart - np.median(apart)))) / 2


def _running_median(values: Floats, window: int) -> Floats:
    padded = np.pad(values, window // 2, mode="reflect")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, window), axis=1))


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last + 1 of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
