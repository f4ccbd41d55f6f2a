"""Subsets that a shear band crosses: two sides in affine motion and a band between them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ploughval.axes import Status
from ploughval.piv.subsets import (
    Description,
    Fit,
    Floats,
    Pair,
    centres_of,
    in_chunks,
    kernel_input,
    moved_at,
    noise_in_slopes,
)

NEAREST = 48
"""Neighbours that are looked at: enough to see the other side of a band."""
REACH = 2.5
"""Neighbours count within so many subsets."""
LEAST_JUMP_PX = 0.3
"""Neighbours that differ by less lie on one side."""
_AT_ONCE = 512  # points whose neighbours are held together
NEIGHBOURS = 3
"""Bands found at so many other points are tried on a point."""
STARTS_PX = (2.5, 7.0)
"""Half-widths of a band that are tried."""


@dataclass(frozen=True, slots=True)
class Bands:
    """Subsets matched as two sides and a band.

    Attributes
    ----------
    fit : Fit, motion at each point as parameters of the pair's shape function
    params : (N, TERMS) float, see ``band_shape``
    """

    fit: Fit
    params: Floats


def two_sides(known: Floats, params: Floats, points: Floats, half_px: float, reach_px: float) -> Floats:
    """Motions (I, 2, 2, terms) of both sides of what may tear each subset, NaN where there is no other.

    Every neighbour within reach says how the point would move if it moved with it (its affine motion carried
    on). The two that differ most found two groups; a side moves as the median of its group.
    """
    out = np.full((len(points), 2, *params.shape[1:]), np.nan)
    if len(known) < 4 or len(points) == 0:
        return out
    tree = cKDTree(known)
    for start in range(0, len(points), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        _sides_beside(points[some], known, params, half_px, out[some], _beside(tree, points[some], reach_px))
    return out


def _beside(tree: cKDTree, points: Floats, reach_px: float) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Known points near each of some points: whether there are any, and which, (I, K)."""
    count = min(NEAREST, tree.n)
    distance, near = tree.query(points, k=count, distance_upper_bound=reach_px)
    distance, near = distance.reshape(len(points), count), near.reshape(len(points), count)
    beside = np.isfinite(distance)
    return beside, np.where(beside, near, 0)


def _sides_beside(
    points: Floats,
    known: Floats,
    params: Floats,
    half_px: float,
    out: Floats,
    found: tuple[NDArray[np.bool_], NDArray[np.intp]],
) -> None:
    """Motions (I, 2, ...) of both sides of some points, into ``out``; NaN stays where there is but one."""
    beside, near = found
    count = near.shape[1]
    carried = params[near]  # (I, K, 2, terms)
    moved = moved_at(carried, (points[:, None] - known[near]) / half_px)
    carried[:, :, :, 0] = moved
    apart = np.linalg.norm(moved[:, :, None] - moved[:, None], axis=3)
    apart[~(beside[:, :, None] & beside[:, None])] = -1.0
    first, second = np.divmod(apart.reshape(len(points), -1).argmax(axis=1), count)
    for n in range(len(points)):
        a, b, some = first[n], second[n], beside[n]
        if apart[n, a, b] < LEAST_JUMP_PX:
            continue
        nearer_b = some & (apart[n, b] < apart[n, a])
        out[n, 0] = np.median(carried[n, some & ~nearer_b], axis=0)
        out[n, 1] = np.median(carried[n, nearer_b], axis=0)


def starts_of(pair: Pair, points: Floats, sides: Floats) -> Floats:
    """Starts (I, K, TERMS) of the fit from the motions of both sides and the line that divides them best."""
    from ploughval.piv import band_line, band_shape, sampling

    recipe = pair.recipe
    pictures, tables = kernel_input(pair)
    centres, lines = centres_of(points), np.full((len(points), 2), np.nan)
    flat = np.ascontiguousarray(sides.reshape(len(points), 2, -1))

    def run(part: slice) -> None:
        work = sampling.make_work(recipe.subset, recipe.terms)
        scratch = np.zeros((3, work.f.size), np.float32)
        band_line.divide_points(pictures, tables, centres[part], flat[part], lines[part], work, scratch)

    in_chunks(run, len(points), pair.workers)
    out = np.full((len(points), len(STARTS_PX), band_shape.TERMS), np.nan)
    for k, width in enumerate(STARTS_PX):
        out[:, k, :2] = sides[:, :, :, 0].mean(axis=1)
        out[:, k, 2:6] = 0.0
        if recipe.terms >= 3:
            out[:, k, 2:6] = sides[:, :, :, 1:3].mean(axis=1).reshape(len(points), 4) / recipe.half
        out[:, k, 6:8] = sides[:, 1, :, 0] - sides[:, 0, :, 0]
        out[:, k, 8:10] = lines
        out[:, k, 10] = width
    out[~np.isfinite(lines[:, 0])] = np.nan
    return out


def neighbours_bands(points: Floats, params: Floats, index: NDArray[np.intp]) -> Floats:
    """Starts (I, K, TERMS) from the bands found at the nearest other points, seen from each point."""
    found = np.flatnonzero(np.isfinite(params[:, 0]))
    out = np.full((index.size, NEIGHBOURS, params.shape[1]), np.nan)
    if found.size < 2 or index.size == 0:
        return out
    count = min(NEIGHBOURS + 1, found.size)
    near = found[cKDTree(points[found]).query(points[index], k=count)[1]]
    others = near != index[:, None]
    order = np.argsort(~others, axis=1, kind="stable")[:, :NEIGHBOURS]
    near, others = np.take_along_axis(near, order, axis=1), np.take_along_axis(others, order, axis=1)
    p = params[near].copy()
    offset = (centres_of(points[index])[:, None] - centres_of(points[near])).astype(float)
    p[..., 0:2] += np.einsum("nkad,nkd->nka", p[..., 2:6].reshape(*near.shape, 2, 2), offset)
    p[..., 9] -= offset[..., 0] * np.cos(p[..., 8]) + offset[..., 1] * np.sin(p[..., 8])
    p[~others] = np.nan
    out[:, : p.shape[1]] = p
    return out


def match_bands(pair: Pair, points: Floats, starts: Floats, enough: float) -> Bands:
    """Match subsets as two sides and a band, from the best of several starts (N, K, TERMS), NaN: none.

    ``enough`` : residual variance at which no further start is tried, grey levels^2.
    """
    from ploughval.piv import band_kernel, band_shape, kernel

    recipe, count = pair.recipe, len(points)
    pictures, tables = kernel_input(pair)
    centres = centres_of(points)
    offsets, tries = np.asarray(points - centres), np.array(starts, np.float64)
    motion, stats = np.zeros((count, 6)), np.zeros((count, kernel.STATS))
    status = np.full(count, Status.NOT_CONVERGED, np.int8)

    def run(part: slice) -> None:
        band = band_shape.make_band_work(recipe.subset, recipe.terms)
        chunk = band_kernel.BandPoints(centres[part], offsets[part], tries[part], motion[part])
        results = kernel.Results(stats[part], status[part])
        band_kernel.match_bands(pictures, tables, chunk, results, enough, noise_in_slopes(pair), band)

    in_chunks(run, count, pair.workers)
    stats[:, -1] = Description.BAND
    params = np.zeros((count, 2, recipe.terms))
    params[:, :, 0] = motion[:, :2]
    if recipe.terms >= 3:
        gradient = motion[:, 2:].reshape(count, 2, 2)
        params[:, :, 0] -= np.einsum("nad,nd->na", gradient, offsets)
        params[:, :, 1:3] = gradient * recipe.half
    return Bands(Fit(params, stats, status), tries[:, 0].copy())
