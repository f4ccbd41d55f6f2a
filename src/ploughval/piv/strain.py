"""Strain over a stated gauge from displacements of points (least-squares planes), with its noise floor."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from ploughval.errors import CorrelationError

Floats = NDArray[np.float64]


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


def strain_field(
    points: ArrayLike,
    displacement: ArrayLike,
    *,
    gauge_px: float,
    std_px: ArrayLike = 0.0,
    measure: StrainMeasure | str = StrainMeasure.GREEN_LAGRANGE,
) -> StrainField:
    """Strain from the plane that fits the displacements within half a gauge of each point.

    Parameters
    ----------
    points, displacement : (N, 2) float, px
        NaN displacements are not used.
    gauge_px : float, px
        Diameter of the circle of neighbours.
    std_px : (N,) or float, px
        Standard deviation of a displacement component, for the noise floor.
    measure : StrainMeasure
        Which strain.

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
    std = np.broadcast_to(np.asarray(std_px, np.float64), len(place))
    gradient, floor = np.full((len(place), 2, 2), np.nan), np.full(len(place), np.nan)
    valid = np.flatnonzero(np.isfinite(moved).all(axis=1))
    if valid.size:
        tree = cKDTree(place[valid])
        for n, near in enumerate(tree.query_ball_point(place, gauge_px / 2)):
            gradient[n], floor[n] = _plane(
                place[valid[near]] - place[n], moved[valid[near]], std[valid[near]]
            )
    return StrainField(strain_of(gradient, measure), gradient, floor, StrainMeasure(measure), float(gauge_px))


def _plane(offset: Floats, moved: Floats, std: Floats) -> tuple[Floats, float]:
    """Gradient (2, 2) of the least-squares plane and its noise, NaN where the points do not span one."""
    nothing = np.full((2, 2), np.nan), np.nan
    if len(offset) < 4:
        return nothing
    centred = offset - offset.mean(axis=0)
    normal = centred.T @ centred
    if np.linalg.cond(normal) > 1e6:
        return nothing
    inverse = np.linalg.inv(normal)
    weights = inverse @ centred.T  # (2, K): gradient = weights @ displacement
    return (weights @ moved).T, float(np.sqrt(np.mean((weights**2) @ std**2)))
