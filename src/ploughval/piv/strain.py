"""Strain over a stated gauge from displacements of points (least-squares planes), with its noise floor."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from ploughval.errors import CorrelationError

Floats = NDArray[np.float64]

GAUGE_SUBSETS = 1.5
"""Diameter of the circle over which the maps take strain, in subsets."""
GAUGE_SPACINGS = 3.0
"""The same in spacings of the points, where these lie further apart."""
SHEAR_FLOORS = 1.77
"""Mean maximum shear strain that noise alone gives, in stds of a component of the gradient (Rayleigh)."""
LEAST_POINTS = 4  # that a plane is put through
MOST_CONDITION = 1e6  # of its normal equations
_PAIRS = ((0, 0), (0, 1), (1, 0), (1, 1))


class StrainMeasure(StrEnum):
    """Named strain measures; extension positive, compression negative, shear as the tensor component."""

    SMALL = "small"
    GREEN_LAGRANGE = "green_lagrange"
    HENCKY = "hencky"


@dataclass(frozen=True, slots=True)
class StrainField:
    """Strain at N points.

    Attributes
    ----------
    strain : (N, 2, 2) float, 1, symmetric; NaN where fewer than 4 neighbours span a plane
    gradient : (N, 2, 2) float, 1, [displacement axis, place axis]
    floor : (N,) float, 1, standard deviation of a component of the gradient that noise alone gives
    measure : StrainMeasure
    gauge_px : float, px, diameter of the circle over which the plane is fitted
    """

    strain: Floats
    gradient: Floats
    floor: Floats
    measure: StrainMeasure
    gauge_px: float


def gauge_px(subset_px: float, spacing_px: float = 0.0) -> float:
    """Diameter of the circle over which the maps take strain, px; 46.5 px for subsets of 31 px."""
    return max(GAUGE_SUBSETS * subset_px, GAUGE_SPACINGS * spacing_px)


def strain_of(gradient: ArrayLike, measure: StrainMeasure | str) -> Floats:
    """Strain (N, 2, 2) of displacement gradients (N, 2, 2) with respect to the reference.

    Small: (G + G^T) / 2. Green-Lagrange: (F^T F - 1) / 2. Hencky: ln(F^T F) / 2; F = 1 + G.

    Examples
    --------
    >>> strain_of([[[0.1, 0.0], [0.0, 0.0]]], "green_lagrange")[0, 0, 0].round(6)
    np.float64(0.105)
    """
    g = np.asarray(gradient, np.float64)
    kind = StrainMeasure(measure)
    if kind is StrainMeasure.SMALL:
        return np.asarray((g + g.swapaxes(-1, -2)) / 2)
    f = g + np.eye(2)
    right = f.swapaxes(-1, -2) @ f
    if kind is StrainMeasure.GREEN_LAGRANGE:
        return np.asarray((right - np.eye(2)) / 2)
    out = np.full(g.shape, np.nan)
    some = np.isfinite(right).all(axis=(-1, -2))
    values, vectors = np.linalg.eigh(right[some])
    with np.errstate(divide="ignore"):
        out[some] = (vectors * np.log(np.maximum(values, 0.0))[..., None, :] / 2) @ vectors.swapaxes(-1, -2)
    return out


def max_shear(strain: ArrayLike) -> Floats:
    """Maximum shear strain (N,) of strains (N, 2, 2): difference of the principal strains, 1.

    As an engineering strain, twice the largest tensor component in any direction.

    Examples
    --------
    >>> max_shear([[[0.0, 0.02], [0.02, 0.0]]]).round(6)
    array([0.04])
    """
    e = np.asarray(strain, np.float64)
    return np.asarray(np.hypot(e[..., 0, 0] - e[..., 1, 1], 2 * e[..., 0, 1]))


def strain_field(
    points: ArrayLike,
    displacement: ArrayLike,
    *,
    gauge_px: float,
    std_px: ArrayLike = 0.0,
    measure: StrainMeasure | str = StrainMeasure.GREEN_LAGRANGE,
    at: ArrayLike | None = None,
) -> StrainField:
    """Strain from the plane that fits the displacements within half a gauge of each point.

    Parameters
    ----------
    points, displacement : (N, 2) float, px
        NaN displacements are not used. Any other unit will do, if gauge and std have it too.
    gauge_px : float, px
        Diameter of the circle of neighbours.
    std_px : (N,) or float, px
        Standard deviation of a displacement component, for the noise floor.
    measure : StrainMeasure
        Which strain.
    at : (M, 2) float, px, or None
        Where strain is wanted; None: at the points.

    Returns
    -------
    StrainField
        Strain, gradient and noise floor at each place; NaN where too few neighbours are valid.

    Raises
    ------
    CorrelationError
        A gauge that is not positive, or shapes that differ.
    """
    place, moved = np.asarray(points, np.float64), np.asarray(displacement, np.float64)
    if place.ndim != 2 or place.shape[1] != 2 or moved.shape != place.shape:
        raise CorrelationError(f"points {place.shape} and displacement {moved.shape}; expected both (N, 2)")
    if not gauge_px > 0:
        raise CorrelationError(f"gauge_px is {gauge_px}; expected more than 0 px")
    wanted = place if at is None else np.asarray(at, np.float64).reshape(-1, 2)
    std = np.broadcast_to(np.asarray(std_px, np.float64), len(place))
    valid = np.flatnonzero(np.isfinite(moved).all(axis=1))
    gradient, floor = _planes(place[valid], moved[valid], std[valid], wanted, gauge_px / 2)
    return StrainField(strain_of(gradient, measure), gradient, floor, StrainMeasure(measure), float(gauge_px))


def _planes(
    place: Floats, moved: Floats, std: Floats, wanted: Floats, radius: float
) -> tuple[Floats, Floats]:
    """Gradients (M, 2, 2) of planes about places, least squares, and their noise; NaN where there is none."""
    gradient, floor = np.full((len(wanted), 2, 2), np.nan), np.full(len(wanted), np.nan)
    if not len(place) or not len(wanted):
        return gradient, floor
    near = cKDTree(place).query_ball_point(wanted, radius)
    count = np.array([len(found) for found in near])
    if not count.any():
        return gradient, floor
    node = np.repeat(np.arange(len(wanted)), count)
    index = np.concatenate([np.asarray(found, np.intp) for found in near])

    def sums(values: Floats) -> Floats:
        return np.asarray(np.bincount(node, values, len(wanted)), np.float64)

    offset, motion = place[index] - wanted[node], moved[index]
    with np.errstate(invalid="ignore", divide="ignore"):
        offset -= np.stack([sums(v) / count for v in offset.T], axis=1)[node]
    xx, xy, yy = (sums(offset[:, a] * offset[:, b]) for a, b in ((0, 0), (0, 1), (1, 1)))
    determinant = xx * yy - xy**2
    # eigenvalues of the normal matrix: trace^2 / determinant is their ratio where that is large
    spans = (count >= LEAST_POINTS) & (determinant * MOST_CONDITION > (xx + yy) ** 2)
    inverse = np.stack([yy, -xy, -xy, xx], axis=1)[spans] / determinant[spans, None]
    inverse = inverse.reshape(-1, 2, 2)
    mixed = np.stack([[sums(offset[:, a] * motion[:, b]) for a in (0, 1)] for b in (0, 1)])  # (2, 2, M)
    gradient[spans] = np.einsum("bam,mac->mbc", mixed[..., spans], inverse)
    noise = np.stack([sums(std[index] ** 2 * offset[:, a] * offset[:, b]) for a, b in _PAIRS], axis=1)
    spread = inverse @ noise[spans].reshape(-1, 2, 2) @ inverse
    floor[spans] = np.sqrt(np.trace(spread, axis1=1, axis2=2) / 2)
    return gradient, floor
