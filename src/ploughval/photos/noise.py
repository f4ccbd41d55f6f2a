"""Noise of a camera against grey level, from two photographs in which the sand stays still.

The variance of a sensor's noise grows with light, var = gain grey + floor (Foi, Trimeche, Katkovnik and
Egiazarian 2008, eq. 3); its measure from differences of pictures of one scene is that of ISO 15739. The
pattern that a sensor repeats in every picture, and what JPEG loses in both alike, cancel in the difference:
what is found is the noise that changes from picture to picture.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import DataError

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

BINS = 24
LEAST_PIXELS = 2_000
"""Still pixels, in all, that it takes to measure noise."""
LEAST_IN_BIN = 200
MOST_PIXELS = 2_000_000
"""About so many pixels are looked at, in bands of rows over the whole picture."""
_STEPS = ((0, 1), (1, 0), (0, 2), (2, 0), (1, 1), (1, -1))
"""Differences over these rows and columns make what a shift changes: a single step misses fine grains."""
_REACH = 2  # the farthest of them
_BAND, _SEGMENT = 8, 32  # rows and columns of a block that is still or not
_DEPTHS = (8, 10, 12, 14, 16)
_CUT = 3.0
_CUT_SHARE = 0.973337  # variance that a normal distribution keeps within 3 standard deviations
_CUT_LOSS = 1.10
"""Scatter of a variance found with outliers cut over that of a plain one (3 000 draws of 5 000 normals)."""
_PASSES = 12
_ODD_BLOCK = 4.0
_END_STDS = 4.0
_LEAST_BEYOND = 0.25  # of the last class's variance, however far its slope is followed


@dataclass(frozen=True, slots=True, eq=False)
class NoiseCurve:
    """Standard deviation of the noise by grey level, and the straight line through its square.

    Attributes
    ----------
    grey : (K,) float, grey levels
        Mean grey level of each class of pixels, increasing.
    std : (K,) float, grey levels
        Standard deviation of the noise of one picture there.
    std_std : (K,) float, grey levels
        Standard uncertainty of `std`.
    count : (K,) int
        Pixels in each class.
    gain, gain_std : float
        Slope of the variance against grey, grey levels, and its standard uncertainty; NaN where there is
        but one class.
    floor, floor_std : float
        Variance at grey 0, grey levels squared, and its standard uncertainty; below 0 where grey levels are
        not linear in light or black is not 0.
    misfit : float
        Root mean square of the distances of the classes from the line, in their standard uncertainties: 1
        where the line describes the noise, far above where it does not (gamma, JPEG).
    """

    grey: Floats
    std: Floats
    std_std: Floats
    count: NDArray[np.intp]
    gain: float
    gain_std: float
    floor: float
    floor_std: float
    misfit: float

    @property
    def read_std(self) -> float:
        """Noise without light, grey levels: root of the floor, NaN where that is below 0."""
        return float(np.sqrt(self.floor)) if self.floor >= 0 else float("nan")

    def level(self, grey: Floats | Grey) -> Floats:
        """Standard deviation of the noise at grey levels of any shape; beyond the classes by `gain`."""
        grey = np.asarray(grey, float)
        beyond = grey - grey.clip(self.grey[0], self.grey[-1])
        end = np.interp(grey, self.grey, self.std) ** 2
        slope = self.gain if np.isfinite(self.gain) else 0.0
        return np.asarray(np.sqrt(np.maximum(end + slope * beyond, _LEAST_BEYOND * end)))


def noise_curve(first: Grey, second: Grey, still_mask: NDArray[np.bool_] | None = None) -> NoiseCurve:
    """Measure the noise from two pictures of one scene.

    A difference of light or exposure and a movement of the camera by a fraction of a pixel are taken off by a
    linear fit: in fine sand and noise of 2 levels, 0.2 px of movement then raise the noise found by 4 %,
    0.5 px by 15 %. Blocks that differ by more than the others (sand that moved) are left out, and so are grey
    levels that the ends of the scale clip.

    Parameters
    ----------
    first, second : (H, W) uint8 or uint16
        Pictures, as photographed one after the other.
    still_mask : (H, W) bool or None
        Pixels that may be used; None: all.

    Returns
    -------
    NoiseCurve

    Raises
    ------
    DataError
        Pictures of different size or depth, the same picture twice, or fewer than `LEAST_PIXELS` pixels.
    """
    if first.shape != second.shape or first.dtype != second.dtype or first.ndim != 2:
        raise DataError(
            f"noise needs two grey pictures alike; got {first.shape} {first.dtype} and {second.shape} "
            f"{second.dtype}"
        )
    grey, change, used = _sample(first, second, still_mask)
    if used.sum() < LEAST_PIXELS:
        raise DataError(f"noise needs {LEAST_PIXELS} still pixels inside the scale; got {int(used.sum())}")
    for _ in range(2):
        classes = _classes(grey[used], change[used], _top(first, second))
        odd = _odd_blocks(grey, change, used, classes)
        if not odd.any():
            break
        used &= ~odd
    return _curve(classes)


@dataclass(frozen=True, slots=True)
class _Classes:
    """Mean grey, noise variance of one picture, its standard uncertainty, and pixels of each class."""

    grey: Floats
    variance: Floats
    variance_std: Floats
    count: NDArray[np.intp]


def _sample(
    first: Grey, second: Grey, mask: NDArray[np.bool_] | None
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Mean grey, change and whether it may be used, (rows, columns) in bands; light and shift taken off."""
    height, width = first.shape
    stride = max(1, round(height * width / MOST_PIXELS))
    first_rows = np.arange(_REACH, height - _REACH - _BAND, _BAND * stride)
    rows = (first_rows[:, None] + np.arange(_BAND)).ravel()
    end = _REACH + (width - 2 * _REACH) // _SEGMENT * _SEGMENT
    if not rows.size or end <= _REACH:
        least = f"{_BAND + 2 * _REACH + 1} rows and {_SEGMENT + 2 * _REACH} columns"
        raise DataError(f"noise needs pictures of at least {least}; got {first.shape}")

    def mean(row_shift: int, column_shift: int) -> Floats:
        place = np.ix_(rows + row_shift, np.arange(_REACH + column_shift, end + column_shift))
        return np.asarray((first[place].astype(float) + second[place]) / 2)

    grey = mean(0, 0)
    place = np.ix_(rows, np.arange(_REACH, end))
    change = second[place].astype(float) - first[place]
    if not change.any():
        raise DataError("noise needs two photographs; got the same picture twice")
    top = _top(first, second)
    used = np.ones(grey.shape, bool) if mask is None else mask[place].copy()
    for image in (first, second):
        used &= (image[place] > 0) & (image[place] < top)
    if used.sum() < LEAST_PIXELS:
        return grey, change, used
    slopes = [mean(down, right) - mean(-down, -right) for down, right in _STEPS]
    parts = [np.ones_like(grey), grey, *slopes]
    kept = used
    for _ in range(3):  # what moved pulls at the first fit
        rest = change - _common(parts, change, kept)
        kept = used & (np.abs(rest) <= _CUT * max(_spread(rest[kept]), 1.0))
    return grey, rest, used


def _common(parts: list[Floats], change: Floats, kept: NDArray[np.bool_]) -> Floats:
    """What the parts explain of a change, by least squares over some pixels; without copies of all parts."""
    products = []
    for part in parts:
        inside = np.where(kept, part, 0.0)
        products.append([np.vdot(inside, other) for other in (*parts, change)])
    normal = np.array(products)
    weights = np.linalg.lstsq(normal[:, :-1], normal[:, -1], rcond=None)[0]
    told = np.zeros_like(change)
    for weight, part in zip(weights.tolist(), parts, strict=True):
        told += weight * part
    return told


def _top(first: Grey, second: Grey) -> int:
    """The end of the scale: of 10, 12 or 14 bits where 16 hold no more."""
    most = max(int(first.max()), int(second.max()))
    return next(end for end in ((1 << bits) - 1 for bits in _DEPTHS) if end >= most)


def _spread(values: Floats) -> float:
    """Standard deviation from the middle 68 %."""
    low, high = np.quantile(values, [0.1587, 0.8413])
    return float(high - low) / 2


def _classes(grey: Floats, change: Floats, top: int) -> _Classes:
    """Noise by classes of grey of equal count; classes that the ends of the scale clip are left out."""
    bins = int(np.clip(grey.size // (2 * LEAST_IN_BIN), 1, BINS))
    edges = np.unique(np.quantile(grey, np.linspace(0, 1, bins + 1)))
    number = np.clip(np.searchsorted(edges, grey, side="right") - 1, 0, max(len(edges) - 2, 0))
    order = np.argsort(number, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(number[order])) + 1)
    rows = []
    for part in parts:
        if len(part) < LEAST_IN_BIN:
            continue
        level = float(grey[part].mean())
        variance, share = _clipped_variance(change[part])
        rows.append((level, variance / 2, variance / 2 * share, len(part)))
    middle, variance, uncertain, count = np.array(rows).T
    inside = _END_STDS * np.sqrt(variance)
    whole = (middle >= inside) & (middle <= top - inside)
    if not whole.any():
        raise DataError("noise cannot be measured: every grey level lies at an end of the scale")
    return _Classes(middle[whole], variance[whole], uncertain[whole], count[whole].astype(np.intp))


def _clipped_variance(change: Floats) -> tuple[float, float]:
    """Variance of differences without outliers, and its relative standard uncertainty."""
    change = change - np.median(change)
    std = max(_spread(change), 1e-3)
    for _ in range(_PASSES):
        kept = change[np.abs(change) <= _CUT * std]
        new = float(np.sqrt(max(float(np.mean(kept**2)), 1e-6) / _CUT_SHARE))
        if abs(new - std) <= 1e-6 * std:
            break
        std = new
    return std**2, _CUT_LOSS * float(np.sqrt(2 / len(kept)))


def _odd_blocks(
    grey: Floats, change: Floats, used: NDArray[np.bool_], classes: _Classes
) -> NDArray[np.bool_]:
    """Pixels of the blocks that differ from picture to picture by more than their grey levels say."""
    expected = 2 * np.interp(grey, classes.grey, classes.variance)
    shape = (grey.shape[0] // _BAND, _BAND, grey.shape[1] // _SEGMENT, _SEGMENT)
    energy = np.where(used, change**2 / expected, 0.0).reshape(shape).sum(axis=(1, 3))
    count = used.reshape(shape).sum(axis=(1, 3))
    ratio = energy / np.maximum(count, 1)
    full = ratio[count > 0]
    middle = np.median(full)
    spread = 1.4826 * np.median(np.abs(full - middle))
    odd = (ratio > middle + _ODD_BLOCK * spread) & (count > 0)
    return np.asarray(odd.repeat(_BAND, axis=0).repeat(_SEGMENT, axis=1))


def _curve(classes: _Classes) -> NoiseCurve:
    gain = gain_std = floor_std = misfit = float("nan")
    floor = float(classes.variance.mean())
    if len(classes.grey) > 1:
        weight = 1 / classes.variance_std
        columns = np.column_stack([classes.grey, np.ones_like(classes.grey)]) * weight[:, None]
        (gain, floor), *_ = np.linalg.lstsq(columns, classes.variance * weight, rcond=None)
        rest = classes.variance * weight - columns @ np.array([gain, floor])
        misfit = float(np.sqrt(np.sum(rest**2) / max(len(rest) - 2, 1)))
        covariance = np.linalg.inv(columns.T @ columns) * max(misfit, 1.0) ** 2
        gain_std, floor_std = np.sqrt(np.diag(covariance)).tolist()
    std = np.sqrt(classes.variance)
    return NoiseCurve(
        grey=classes.grey,
        std=std,
        std_std=classes.variance_std / (2 * std),
        count=classes.count,
        gain=float(gain),
        gain_std=float(gain_std),
        floor=float(floor),
        floor_std=float(floor_std),
        misfit=misfit,
    )
