"""Pictures of sand: Gaussian grains integrated exactly over each pixel, so that any motion is exact.

A grain of radius r has the profile exp(-2 (d / r)^2): it has fallen to exp(-2) at its radius. Its share of
a pixel is a product of two differences of the error function; nothing is interpolated.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

REACH = 4.5
"""Half-width of a grain's stencil in standard deviations: 1.4e-5 of its light falls outside."""

TILE_PX = 32
"""Side of the squares in which a picture is drawn again where grains moved."""


@dataclass(frozen=True, slots=True)
class Grains:
    """Grains of sand in a picture.

    Attributes
    ----------
    positions_px : (N, 2) float64, px, x first
    radii_px : (N,) float64, px, where the profile has fallen to exp(-2)
    areas_px : (N,) float64, px^2, the share of the picture that a grain stands for; they add up to the sand's
    greys : (N,) float64, grey level of a grain (8-bit scale)
    """

    positions_px: Floats
    radii_px: Floats
    areas_px: Floats
    greys: Floats

    def moved(self, displacement_px: ArrayLike) -> "Grains":
        """The same grains, each moved by its row of ``displacement_px`` ((N, 2) or (2,), px)."""
        return replace(self, positions_px=self.positions_px + np.asarray(displacement_px, dtype=np.float64))

    def picture(self, shape: tuple[int, int], *, air_grey: float = 45.0) -> NDArray[np.float32]:
        """The grains in front of air of one grey level: (H, W) float32, without noise or rounding."""
        light = render_grains(
            self.positions_px, self.radii_px, self.areas_px * (self.greys - air_grey), shape
        )
        return light + np.float32(air_grey)


def sand_texture(
    rng: np.random.Generator,
    shape: tuple[int, int],
    *,
    margin_px: float = 20.0,
    spacing_px: float = 1.55,
    diameter_px: tuple[float, float] = (2.5, 6.0),
    grey: tuple[float, float] = (105.0, 215.0),
    dyed_share: float = 0.15,
) -> Grains:
    """Grains that fill a picture and a margin around it, one in each cell of a square grid.

    Parameters
    ----------
    rng : Generator
        Source of everything random.
    shape : (int, int), px
        Height and width of the picture.
    margin_px : float, px
        How far the sand reaches beyond the picture on each side.
    spacing_px : float, px
        Side of a grid cell; a larger one gives more contrast.
    diameter_px : (float, float), px
        Least and greatest diameter of a grain.
    grey : (float, float)
        Least and greatest grey level of a natural grain.
    dyed_share : float
        Share of the grains that are dyed nearly black.

    Returns
    -------
    Grains
        In rows from top to bottom. Mean grey about 140 and standard deviation about 28 by default.

    Examples
    --------
    >>> grains = sand_texture(np.random.default_rng(1), (40, 60))
    >>> first, second = grains.picture((40, 60)), grains.moved((0.25, 0.0)).picture((40, 60))
    >>> first.shape, bool(80 < first.mean() < 200)
    ((40, 60), True)
    """
    height, width = shape
    rows = math.ceil((height + 2 * margin_px) / spacing_px)
    columns = math.ceil((width + 2 * margin_px) / spacing_px)
    count = rows * columns
    row, column = np.divmod(np.arange(count), columns)
    corner = np.column_stack([column, row])
    positions = (corner + rng.random((count, 2))) * spacing_px - margin_px - 0.5
    diameters = rng.uniform(*diameter_px, count)
    greys = rng.uniform(*grey, count)
    greys = np.where(rng.random(count) < dyed_share, rng.uniform(20.0, 40.0, count), greys)
    low, high = diameter_px
    mean_square = (low * low + low * high + high * high) / 3.0
    areas = spacing_px**2 * diameters**2 / mean_square
    return Grains(positions, diameters / 2, areas, greys)


def render_grains(
    positions_px: ArrayLike, radii_px: ArrayLike, amplitudes: ArrayLike, shape: tuple[int, int]
) -> NDArray[np.float32]:
    """Picture of Gaussian grains, each integrated exactly over every pixel, on a background of zero.

    Parameters
    ----------
    positions_px : (N, 2) float, px
        Centres, x first; pixel centres at integers. Grains may lie outside the picture.
    radii_px : (N,) or scalar float, px
        Distance at which the profile has fallen to exp(-2).
    amplitudes : (N,) or scalar float, grey px^2
        Sum of a whole grain over all pixels; may be negative.
    shape : (int, int), px
        Height and width of the picture.

    Returns
    -------
    (H, W) float32
        Sum of all grains. Rows of ``positions_px`` that are not finite are left out.
    """
    canvas = Canvas(radii_px, amplitudes, shape)
    return canvas.draw(positions_px)


class Canvas:
    """A picture of the same grains again and again, drawn anew only in tiles that a moved grain reaches.

    The pixels are those of :func:`render_grains` to the last bit: a tile is emptied and every grain that
    reaches it is added again in the order of the grains.

    Parameters
    ----------
    radii_px, amplitudes : (N,) or scalar float
    shape : (int, int), px
        As in :func:`render_grains`.
    """

    def __init__(self, radii_px: ArrayLike, amplitudes: ArrayLike, shape: tuple[int, int]) -> None:
        self._radii = np.asarray(radii_px, dtype=np.float64)
        self._amplitudes = np.asarray(amplitudes, dtype=np.float64)
        if not np.all(self._radii > 0):
            raise ValueError("radii_px must all be greater than 0")
        self._image = np.zeros(shape, dtype=np.float32)
        self._drawn: Floats | None = None

    def draw(self, positions_px: ArrayLike) -> NDArray[np.float32]:
        """The grains at ``positions_px`` ((N, 2) float, px): (H, W) float32, good until the next call."""
        positions = np.ascontiguousarray(positions_px, dtype=np.float64).reshape(-1, 2)
        count = len(positions)
        sigmas = np.ascontiguousarray(np.broadcast_to(self._radii / 2, count))
        weights = np.ascontiguousarray(np.broadcast_to(self._amplitudes, count))
        height, width = self._image.shape
        stale = np.ones((-(-height // TILE_PX), -(-width // TILE_PX)), dtype=np.bool_)
        if self._drawn is not None:
            moved = np.any(positions != self._drawn, axis=1)
            stale[:] = False
            for places in (self._drawn, positions):
                _mark_tiles(stale, places[moved], sigmas[moved], height, width)
        if count:
            widest = 2 * math.ceil(REACH * float(sigmas.max()) + 1) + 1
            _clear_tiles(self._image, stale)
            _add_grains(self._image, stale, positions, sigmas, weights, np.empty((2, widest)))
        self._drawn = positions.copy()
        return self._image


@njit(cache=True, nogil=True)
def _shares(centre: float, sigma: float, first: int, last: int, out: Floats) -> None:  # pragma: no cover
    """Shares of a one-dimensional Gaussian in the pixels ``first`` to ``last``."""
    scale = 1.0 / (math.sqrt(2.0) * sigma)
    below = math.erf((first - 0.5 - centre) * scale)
    for k in range(first, last + 1):
        above = math.erf((k + 0.5 - centre) * scale)
        out[k - first] = 0.5 * (above - below)
        below = above


@njit(cache=True, nogil=True)
def _reach(centre: float, sigma: float, size: int) -> tuple[int, int]:  # pragma: no cover
    """First and last pixel of a line of ``size`` that a grain reaches; last < first: none."""
    first = max(0, math.floor(centre - REACH * sigma + 0.5))
    return first, min(size - 1, math.floor(centre + REACH * sigma + 0.5))


@njit(cache=True, nogil=True)
def _mark_tiles(
    stale: Bools, positions: Floats, sigmas: Floats, height: int, width: int
) -> None:  # pragma: no cover
    for i in range(positions.shape[0]):
        x, y = positions[i, 0], positions[i, 1]
        if not (math.isfinite(x) and math.isfinite(y)):
            continue
        left, right = _reach(x, sigmas[i], width)
        top, bottom = _reach(y, sigmas[i], height)
        if right >= left and bottom >= top:
            rows = slice(top // TILE_PX, bottom // TILE_PX + 1)
            stale[rows, left // TILE_PX : right // TILE_PX + 1] = True


@njit(cache=True, nogil=True)
def _clear_tiles(image: NDArray[np.float32], stale: Bools) -> None:  # pragma: no cover
    for row in range(stale.shape[0]):
        for column in range(stale.shape[1]):
            if stale[row, column]:
                top, left = row * TILE_PX, column * TILE_PX
                image[top : top + TILE_PX, left : left + TILE_PX] = 0.0


@njit(cache=True, nogil=True)
def _add_grains(
    image: NDArray[np.float32],
    stale: Bools,
    positions: Floats,
    sigmas: Floats,
    weights: Floats,
    shares: Floats,
) -> None:  # pragma: no cover
    """Add every grain to the pixels of stale tiles that it reaches."""
    height, width = image.shape
    across, down = shares[0], shares[1]
    for i in range(positions.shape[0]):
        x, y, reach = positions[i, 0], positions[i, 1], REACH * sigmas[i] + 1.0
        if not (-reach < x < width + reach and -reach < y < height + reach):
            continue  # outside, or not finite
        left, right = _reach(x, sigmas[i], width)
        top, bottom = _reach(y, sigmas[i], height)
        wanted, whole = False, True
        for row in range(top // TILE_PX, bottom // TILE_PX + 1):
            for column in range(left // TILE_PX, right // TILE_PX + 1):
                wanted |= stale[row, column]
                whole &= stale[row, column]
        if not wanted:
            continue
        _shares(x, sigmas[i], left, right, across)
        _shares(y, sigmas[i], top, bottom, down)
        for r in range(bottom - top + 1):
            share = weights[i] * down[r]
            for c in range(right - left + 1):
                if whole or stale[(top + r) // TILE_PX, (left + c) // TILE_PX]:
                    image[top + r, left + c] += np.float32(share * across[c])
