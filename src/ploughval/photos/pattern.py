"""Size of the sand's grains in a photograph, as correlation sees them: width of the autocorrelation.

Grains of one Gaussian profile of standard deviation s, strewn at random, have a Gaussian autocorrelation of
sqrt(2) s; it is as wide at half its height as 2 sqrt(2 ln 2) sqrt(2) s.
docs/good-practice.md, Eqs (1) to (4).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

TILES = 16
"""Squares of sand that are looked at, spread over the picture."""
LEAST_TILES = 4
SIDES_PX = (128, 96, 64, 48, 32)
"""Sides of the squares; the largest of which there are LEAST_TILES."""
LAGS = 33
"""Lags 0 to 32 px, along the rows and down the columns."""
LEAST_SHARE = 0.05
"""Of the variance, what neighbouring pixels must share: with less, grains are not told from noise."""
_COARSE_PX = 8  # the mask is looked at in every so many pixels


@dataclass(frozen=True, slots=True, eq=False)
class Texture:
    """Autocovariance of the grey levels in squares of sand, each freed from the means of its rows.

    Attributes
    ----------
    covariance : (K, 2, LAGS) float, grey levels^2
        Along the rows and down the columns; NaN for lags beyond a third of the side.
    mean_grey : (K,) float
    side_px : int
        Of the squares; 0: no sand that a square fits into.
    """

    covariance: Floats
    mean_grey: Floats
    side_px: int


@dataclass(frozen=True, slots=True)
class Pattern:
    """The grains of a photograph.

    Attributes
    ----------
    size_px, size_std_px : float, px
        Full width of the autocorrelation at half its height, geometric mean of both directions, and its
        standard uncertainty from the scatter between the squares; NaN: could not be had.
    across_px, down_px : float, px
        The same along the rows and down the columns.
    contrast_grey : float, grey levels
        Standard deviation of the texture without noise.
    mean_grey : float, grey levels
    squares, side_px : int
        Squares that were looked at, and their side.
    """

    size_px: float
    size_std_px: float
    across_px: float
    down_px: float
    contrast_grey: float
    mean_grey: float
    squares: int
    side_px: int


def texture_of(image: Grey, sand: NDArray[np.bool_]) -> Texture:
    """Autocovariance in squares of sand.

    Parameters
    ----------
    image : (H, W) uint8 or uint16
        A photograph.
    sand : (H, W) bool
        Where it shows sand.

    Returns
    -------
    Texture
        Without squares where the sand is too small.
    """
    side, places = _squares(sand)
    covariance = np.full((len(places), 2, LAGS), np.nan)
    mean = np.empty(len(places))
    for k, (row, column) in enumerate(places):
        square = image[row : row + side, column : column + side].astype(np.float64)
        mean[k] = square.mean()
        covariance[k] = _covariance(_flat(square))
    return Texture(covariance, mean, side)


def pattern_of(texture: Texture, noise_grey: float | None = None) -> Pattern | None:
    """Width of the autocorrelation and contrast of the grains.

    Parameters
    ----------
    texture : Texture
        From :func:`texture_of`.
    noise_grey : float or None
        Standard deviation of the camera's noise, grey levels, which only the autocovariance at lag 0 holds;
        None: the autocovariance at lag 0 is carried on from lags 1 and 2 as if it were Gaussian there.

    Returns
    -------
    Pattern or None
        None without squares.
    """
    count = len(texture.covariance)
    if not count:
        return None
    mean = texture.covariance.mean(axis=0)
    across, down, variance = _widths(mean, noise_grey)
    single = np.array([np.sqrt(a * d) for a, d, _ in (_widths(c, noise_grey) for c in texture.covariance)])
    known = single[np.isfinite(single)]
    size = float(np.sqrt(across * down))
    told = np.isfinite(size) and known.size > 1
    std = float(known.std(ddof=1) / np.sqrt(known.size)) if told else np.nan
    return Pattern(
        size_px=size,
        size_std_px=std,
        across_px=across,
        down_px=down,
        contrast_grey=float(np.sqrt(variance)),
        mean_grey=float(texture.mean_grey.mean()),
        squares=count,
        side_px=texture.side_px,
    )


def _squares(sand: NDArray[np.bool_]) -> tuple[int, list[tuple[int, int]]]:
    """Side of the squares and their first rows and columns; as many as TILES, spread over the sand."""
    coarse = np.ascontiguousarray(sand[::_COARSE_PX, ::_COARSE_PX])
    sums = np.zeros((coarse.shape[0] + 1, coarse.shape[1] + 1), np.int64)
    np.cumsum(np.cumsum(coarse, axis=0, dtype=np.int64), axis=1, out=sums[1:, 1:])
    best: tuple[int, list[tuple[int, int]]] = (0, [])
    for side in SIDES_PX:
        cells = side // _COARSE_PX + 1  # the last one is sand too: the square ends before it
        places = _disjoint(sums, cells)
        if len(places) > len(best[1]):
            best = side, places
        if len(best[1]) >= LEAST_TILES:
            break
    side, places = best
    some = np.unique(np.linspace(0, len(places) - 1, min(TILES, len(places))).round().astype(int))
    return side, [places[k] for k in some.tolist()]


def _disjoint(sums: NDArray[np.int64], cells: int) -> list[tuple[int, int]]:
    """First rows and columns, px, of squares of sand that do not overlap, by columns of the picture."""
    if min(sums.shape) <= cells:
        return []
    whole = (
        sums[cells:, cells:] - sums[:-cells, cells:] - sums[cells:, :-cells] + sums[:-cells, :-cells]
        == cells**2
    ).T.copy()
    places = []
    while whole.any():
        column, row = np.unravel_index(int(np.argmax(whole)), whole.shape)
        places.append((int(row) * _COARSE_PX, int(column) * _COARSE_PX))
        whole[max(column - cells + 1, 0) : column + cells, max(row - cells + 1, 0) : row + cells] = False
    return places


def _flat(square: Floats) -> Floats:
    """Grey levels without the mean of each row (level layers of another grey) and a slope along the rows."""
    step = np.arange(square.shape[1]) - (square.shape[1] - 1) / 2
    square = square - square.mean(axis=1, keepdims=True)
    return np.asarray(square - step * (square.mean(axis=0) @ step) / (step @ step))


def _covariance(flat: Floats) -> Floats:
    """Autocovariance (2, LAGS) along rows and columns, freed from what the means of the rows took.

    docs/good-practice.md, Eq. (3).
    """
    side = len(flat)
    out = np.full((2, LAGS), np.nan)
    for lag in range(min(LAGS, side // 3)):
        out[0, lag] = np.mean(flat[:, : side - lag] * flat[:, lag:])
        out[1, lag] = np.mean(flat[: side - lag] * flat[lag:])
    end = int(np.argmax(~(out[0] > 0)))  # lags with a positive covariance, the grain itself
    lost = (2 * out[0, :end].sum() - out[0, 0]) / (side - 2 * end + 1) if end else 0.0
    grown = 1.0 + lost / out[0, 0] if out[0, 0] > 0 else 1.0
    out[0] += lost
    out[1] *= grown
    return out


def _widths(covariance: Floats, noise_grey: float | None) -> tuple[float, float, float]:
    """Full widths at half the height, px, along rows and columns, and the variance without noise."""
    raw, near, next_ = covariance[0, 0], covariance[:, 1], covariance[:, 2]
    if not raw > 0 or near.max() < LEAST_SHARE * raw:
        return np.nan, np.nan, np.nan
    if noise_grey is not None:
        variance = raw - noise_grey**2
    elif (next_ > 0).all() and (near > 0).all():
        variance = float(np.exp(np.mean((4 * np.log(near) - np.log(next_)) / 3)))
    else:
        variance = raw
    variance = float(np.clip(variance, near.max(), raw))
    across, down = (_width(c, variance) for c in covariance)
    return across, down, variance


def _width(covariance: Floats, variance: float) -> float:
    """Twice the lag at which a covariance falls to half the variance; NaN where it does not."""
    values = np.concatenate([[variance], covariance[1:]])
    below = np.flatnonzero(values <= variance / 2)
    if not below.size:
        return float("nan")
    k = int(below[0])
    before, after = values[k - 1], values[k]
    if after > 0:  # between two lags as a Gaussian: its logarithm is linear in the square of the lag
        share = np.log(2 * before / variance) / np.log(before / after)
        return float(2 * np.sqrt((k - 1) ** 2 + share * (2 * k - 1)))
    return float(2 * (k - 1 + (before - variance / 2) / (before - after)))
