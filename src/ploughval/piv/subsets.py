"""Subsets matched in chunks: what the kernel needs and gives, in arrays."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.interpolate import Planes, SlopeFilter, centred_polynomials, slope_noise

if TYPE_CHECKING:
    from ploughval.piv import sampling

Floats = NDArray[np.float64]
_MOMENTS = [
    (0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1),
    (1, 2), (0, 3), (4, 0), (3, 1), (2, 2), (1, 3), (0, 4),
]  # fmt: skip
"""Powers of the place in monomials, the shape function's terms first."""
CHUNK = 64


@dataclass(frozen=True, slots=True)
class Recipe:
    """How subsets are matched: side (odd, px), order of the shape function, degree of the B-spline."""

    subset: int = 31
    order: int = 1
    spline: int = 5
    slopes: SlopeFilter = SlopeFilter.PLAIN

    @property
    def half(self) -> int:
        """Half the side without the centre pixel, px."""
        return self.subset // 2

    @property
    def terms(self) -> int:
        """Coefficients of the shape function for one axis."""
        return (1, 3, 6)[self.order]

    def monomials(self, xi: Floats, eta: Floats) -> Floats:
        """Shape function terms (terms, ...) at places given in half sides."""
        return np.stack([xi**0, xi, eta, xi * xi, xi * eta, eta * eta][: self.terms])


class Description(IntEnum):
    """How the motion of a subset is described; the richer ones only where the plain one does not do."""

    PLAIN = 0
    QUADRATIC = 1
    QUADRATIC_SMALL = 2
    BAND = 3
    SIDE = 4
    WINDOW = 5


@dataclass(frozen=True, slots=True)
class Fit:
    """Raw results of N subsets; the arrays are filled in place while retries improve them."""

    params: Floats  # (N, 2, terms) px, places in half sides of the subset, about the centre pixel
    stats: Floats  # (N, STATS), see kernel
    status: NDArray[np.int8]  # (N,)

    @property
    def zncc(self) -> Floats:
        """Zero-mean normalised correlation (N,)."""
        return self.stats[:, 0]

    @property
    def residual(self) -> Floats:
        """Residual variance (N,), grey levels^2."""
        return self.stats[:, 1]

    @property
    def spread(self) -> Floats:
        """Variance of the displacement over that of the residuals (N, 2), px^2 a grey level^2."""
        return self.stats[:, 2:4]

    @property
    def pixels(self) -> Floats:
        """Valid pixels (N,)."""
        return self.stats[:, 4]

    @property
    def variance(self) -> Floats:
        """Variance of the grey values of the reference (N,)."""
        return self.stats[:, 6]

    @property
    def slope(self) -> Floats:
        """Mean square of a filtered slope (N,), grey levels^2 px^-2."""
        return self.stats[:, 7]

    @property
    def answer(self) -> Floats:
        """What residuals answer to over that (N,), freed from noise."""
        return self.stats[:, 8]

    @property
    def product(self) -> Floats:
        """Mean product of filtered and plain slope (N,), not freed from noise."""
        return self.stats[:, 9]

    @property
    def answers(self) -> Floats:
        """What residuals answer to along x and y (N, 2), as ``answer``."""
        return self.stats[:, 10:12]

    @property
    def description(self) -> NDArray[np.int8]:
        """How each subset was described (N,), :class:`Description`."""
        return self.stats[:, -1].astype(np.int8)

    @classmethod
    def empty(cls, count: int, terms: int, status: Status) -> "Fit":
        """Nothing matched yet."""
        from ploughval.piv.kernel import STATS

        return cls(np.zeros((count, 2, terms)), np.zeros((count, STATS)), np.full(count, status, np.int8))

    def put(self, index: NDArray[np.intp], other: "Fit") -> None:
        """Overwrite the points of an index with another fit."""
        self.params[index] = other.params
        self.stats[index] = other.stats
        self.status[index] = other.status

    def take(self, index: NDArray[np.intp]) -> "Fit":
        """The points of an index, copied."""
        return Fit(self.params[index], self.stats[index], self.status[index])


@dataclass(frozen=True, slots=True)
class Pair:
    """Two pictures ready to be matched.

    Attributes
    ----------
    reference : Planes
        Values and slopes of the reference.
    mask : (H, W) uint8
        Usable pixels of the reference.
    current : (H + 2 PAD, W + 2 PAD) float32
        Spline coefficients of the current picture.
    seen : (H, W) uint8, or (1, 1) where all are
        Usable pixels of the current picture.
    noise_variance : float, grey levels^2
        Of one picture; the steps of a match are as long as they should only when it is known.
    """

    reference: Planes
    mask: NDArray[np.uint8]
    current: NDArray[np.float32]
    seen: NDArray[np.uint8]
    recipe: Recipe
    workers: int = 1
    noise_variance: float = 0.0


ALL_SEEN = np.ones((1, 1), np.uint8)


def centres_of(points: Floats) -> NDArray[np.int64]:
    """Pixels on which the subsets of points stand: the nearest (N, 2); -10000 for points that are NaN."""
    return np.nan_to_num(np.floor(np.asarray(points) + 0.5), nan=-10_000.0).astype(np.int64)


def place_terms(points: Floats, recipe: Recipe) -> Floats:
    """Shape function terms (terms, N) of points about the pixel of their subset."""
    offset = (points - centres_of(points)) / max(recipe.half, 1)
    return recipe.monomials(offset[:, 0], offset[:, 1])


def displacement_of(params: Floats, points: Floats, recipe: Recipe) -> Floats:
    """Displacement (N, 2) px at points from the parameters of their subsets."""
    return np.asarray(np.einsum("nat,tn->na", params, place_terms(points, recipe)))


def moved_at(params: Floats, offset: Floats) -> Floats:
    """Displacement (..., 2) px at ``offset`` (..., 2) half sides from subsets that are carried on affinely.

    ``params`` (..., 2, terms); a subset without gradients moves as a whole.
    """
    if params.shape[-1] < 3:
        return np.asarray(params[..., 0])
    return np.asarray(params[..., 0] + params[..., 1] * offset[..., :1] + params[..., 2] * offset[..., 1:])


def gradient_of(params: Floats) -> Floats:
    """Displacement gradient (N, 2, 2) per half side, [displacement axis, place axis]; zero at order 0."""
    if params.shape[2] == 1:
        return np.zeros((len(params), 2, 2))
    return params[:, :, 1:3].copy()


def params_from(displacement: Floats, recipe: Recipe) -> Floats:
    """Parameters (N, 2, terms) of a plain displacement (N, 2) px."""
    params = np.zeros((len(displacement), 2, recipe.terms))
    params[:, :, 0] = displacement
    return params


def kernel_input(pair: Pair) -> tuple["sampling.Pictures", "sampling.Tables"]:
    """What the kernel reads of a pair and of its recipe."""
    from ploughval.piv import sampling  # numba is imported where it is first needed

    planes = pair.reference
    pictures = sampling.Pictures(
        planes.value, planes.slope_x, planes.slope_y, planes.product, pair.mask, pair.current, pair.seen
    )
    recipe = pair.recipe
    return pictures, _tables(recipe.subset, recipe.order, recipe.spline)


@lru_cache(maxsize=32)
def _tables(subset: int, order: int, spline: int) -> "sampling.Tables":
    """Tables of a recipe: monomials up to twice the order, and which of them a product of two is."""
    from ploughval.piv import sampling

    recipe = Recipe(subset, order, spline)
    moments = _MOMENTS[: (1, 6, 15)[order]]
    wide = sampling.wide_of(subset)
    axis = np.arange(-recipe.half, recipe.half + 1) / max(recipe.half, 1)
    xi, eta = np.meshgrid(axis, axis)
    mono = np.zeros((len(moments), subset, wide), np.float32)
    for m, (a, b) in enumerate(moments):
        mono[m, :, :subset] = xi**a * eta**b
    pairs = np.zeros((recipe.terms, recipe.terms), np.int64)
    for k, (a, b) in enumerate(_MOMENTS[: recipe.terms]):
        for m, (c, d) in enumerate(_MOMENTS[: recipe.terms]):
            pairs[k, m] = _MOMENTS.index((a + c, b + d))
    flat = np.ascontiguousarray(mono.reshape(len(moments), -1))
    return sampling.Tables(subset, recipe.terms, centred_polynomials(spline), flat, pairs)


def noise_in_slopes(pair: Pair) -> float:
    """What noise adds to the product of smoothed and plain slope of a pixel, grey levels^2 px^-2."""
    return pair.noise_variance * slope_noise(pair.recipe.spline, pair.recipe.slopes)


def match(
    pair: Pair, points: Floats, guess: Floats, *, limit: float | None = None, cuts: Floats | None = None
) -> Fit:
    """Match the subsets of points, starting from given parameters.

    Parameters
    ----------
    pair : Pair
        Both pictures.
    points : (N, 2) float, px
        Material points in the reference picture.
    guess : (N, 2, terms) float
        Parameters to start from.
    limit : float, px
        Farthest that a subset may leave its guess; absent: half a subset.
    cuts : (N, 3) float
        Only pixels beyond a line are used: ``x cuts[0] + y cuts[1] > cuts[2]`` about the subset's centre, px.

    Returns
    -------
    Fit
        Status OK, MASKED, EDGE, FLAT or NOT_CONVERGED; not judged yet.
    """
    from ploughval.piv import kernel, sampling

    recipe, count, centres = pair.recipe, len(points), centres_of(points)
    params = np.array(guess, np.float64).reshape(count, 2 * recipe.terms)
    stats, status = np.zeros((count, kernel.STATS)), np.zeros(count, np.int8)
    pictures, tables = kernel_input(pair)
    lines = np.zeros((0, 3)) if cuts is None else np.asarray(cuts, np.float64)
    limits = np.array([pair.recipe.half if limit is None else limit, noise_in_slopes(pair)])

    def run(part: slice) -> None:
        work = sampling.make_work(recipe.subset, recipe.terms)
        results = kernel.Results(stats[part], status[part])
        kernel.match_points(pictures, tables, centres[part], params[part], results, limits, lines[part], work)

    in_chunks(run, count, pair.workers)
    out = params.reshape(count, 2, recipe.terms)
    status[~np.isfinite(out).all(axis=(1, 2)) & (status == Status.OK)] = Status.NOT_CONVERGED
    return Fit(out, stats, status)


def in_chunks(run: Callable[[slice], None], count: int, workers: int) -> None:
    """Call a function on chunks of a range, in as many threads as allowed."""
    parts = [slice(start, start + CHUNK) for start in range(0, count, CHUNK)]
    if workers > 1 and len(parts) > 1:
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(run, parts))
    else:
        for part in parts:
            run(part)


def read_subsets(pair: Pair, points: Floats, params: Floats) -> NDArray[np.float32]:
    """Residuals, slopes in x and y, and weights of subsets, (N, 4, side, side)."""
    from ploughval.piv import kernel, sampling

    side, wide = pair.recipe.subset, sampling.wide_of(pair.recipe.subset)
    pictures, tables = kernel_input(pair)
    out = np.zeros((len(points), 4, side * wide), np.float32)
    work = sampling.make_work(side, pair.recipe.terms)
    flat = np.ascontiguousarray(params.reshape(len(points), -1))
    kernel.read_points(pictures, tables, centres_of(points), flat, out, work)
    return out.reshape(len(points), 4, side, wide)[..., :side]
