"""Subsets matched in chunks: what the kernel needs and gives, in arrays."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.interpolate import basis_polynomials, node_taps

Floats = NDArray[np.float64]
CHUNK = 128


@dataclass(frozen=True, slots=True)
class Recipe:
    """How subsets are matched: side (odd, px), order of the shape function, degree of the B-spline."""

    subset: int = 31
    order: int = 1
    spline: int = 5
    smooth_px: float = 0.7
    """Slopes are taken from the reference smoothed by a Gaussian of this standard deviation: less noise and
    less of what the pixels cannot resolve; the grey values themselves are not smoothed."""

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

    def grid(self) -> Floats:
        """Shape function terms (terms, subset^2) at the pixels of a subset, row by row."""
        axis = np.arange(-self.half, self.half + 1) / max(self.half, 1)
        xi, eta = np.meshgrid(axis, axis)
        return np.ascontiguousarray(self.monomials(xi.ravel(), eta.ravel()))


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
    """Two pictures ready to be matched: coefficients of both and the usable pixels of the reference."""

    reference: NDArray[np.float32]
    current: NDArray[np.float32]
    mask: NDArray[np.uint8]
    recipe: Recipe
    workers: int = 1


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


def match(pair: Pair, points: Floats, guess: Floats, *, limit: float | None = None) -> Fit:
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

    Returns
    -------
    Fit
        Status OK, MASKED, EDGE, FLAT or NOT_CONVERGED; not judged yet.
    """
    reach = float(pair.recipe.half if limit is None else limit)
    return _run(pair, points, np.asarray(guess, np.float64)[:, None], np.array([reach]))


def match_split(pair: Pair, points: Floats, candidates: Floats, allowed: Floats) -> Fit:
    """Match only the part of each subset that moves with its centre.

    Parameters
    ----------
    pair : Pair
        Both pictures.
    points : (N, 2) float, px
        Material points in the reference picture.
    candidates : (N, K, 2, terms) float
        Parameters to try for each; NaN: none.
    allowed : (4,) float
        See ``kernel.match_points``.
    """
    return _run(pair, points, candidates, np.asarray(allowed, np.float64))


def _run(pair: Pair, points: Floats, candidates: Floats, allowed: Floats) -> Fit:
    """Call the kernel on chunks of points, in as many threads as the pair allows."""
    from ploughval.piv import kernel, sampling  # numba is imported where it is first needed

    recipe, count, centres = pair.recipe, len(points), centres_of(points)
    tries = np.array(candidates, np.float64).reshape(count, candidates.shape[1], 2 * recipe.terms)
    stats, status = np.zeros((count, kernel.STATS)), np.zeros(count, np.int8)
    pictures = sampling.Pictures(pair.reference, pair.current, pair.mask)
    poly = basis_polynomials(recipe.spline).astype(np.float32)
    tables = sampling.Tables(recipe.subset, node_taps(recipe.spline, recipe.smooth_px), poly, recipe.grid())

    def run(start: int) -> None:
        part = slice(start, start + CHUNK)
        work = sampling.make_work(recipe.subset, recipe.terms)
        results = kernel.Results(stats[part], status[part])
        kernel.match_points(pictures, tables, centres[part], tries[part], results, allowed, work)

    starts = range(0, count, CHUNK)
    if pair.workers > 1 and len(starts) > 1:
        with ThreadPoolExecutor(pair.workers) as pool:
            list(pool.map(run, starts))
    else:
        for start in starts:
            run(start)
    params = tries[:, 0].reshape(count, 2, recipe.terms).copy()
    status[~np.isfinite(params).all(axis=(1, 2)) & (status == Status.OK)] = Status.NOT_CONVERGED
    return Fit(params, stats, status)
