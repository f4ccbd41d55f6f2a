"""The mechanism (Kashizadeh et al. 2014, section 2.1) solved for the friction angle, and what moves it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def mobilised_friction(
    force_N: float | Floats,
    weight_N: float | Floats,
    beta_deg: float | Floats,
    wall_friction_deg: float = 0.0,
) -> Floats:
    """Friction angle at which a block of a weight on a band slides under the blade's force P, in degrees.

    Equilibrium of the block, P = W t / (cos phi_w - sin phi_w t) with t = tan(beta + phi)
    (docs/theory-model.md, Eq. (3)), solved: t = P cos phi_w / (W + P sin phi_w)
    (docs/theory-mobilised.md, Eq. (1)).

    Parameters
    ----------
    force_N : float or (N,) float, N
        Force P of the blade, inclined by the wall friction.
    weight_N : float or (N,) float, N
        Weight W of the block, with any load upon it.
    beta_deg : float or (N,) float, degrees
        Inclination of the band.
    wall_friction_deg : float, degrees
        Friction angle between blade and sand, plus the inclination of a face that leans.

    Returns
    -------
    (N,) float, degrees

    >>> float(mobilised_friction(10.0, 10.0, 20.0).round(9))
    25.0
    """
    wall = np.radians(wall_friction_deg)
    P, W = np.asarray(force_N, dtype=np.float64), np.asarray(weight_N, dtype=np.float64)
    return np.asarray(np.degrees(np.arctan2(P * np.cos(wall), W + P * np.sin(wall))) - beta_deg)


def slip_rate(beta_deg: Floats, inclination_deg: float = 0.0) -> Floats:
    """Slip for a millimetre of the blade's travel, by the triangle of velocities of blade and block.

    Parameters
    ----------
    beta_deg : (N,) float, degrees
        Inclination of the band.
    inclination_deg : float, degrees
        Of the face to the vertical; positive: its top leans ahead.

    Returns
    -------
    (N,) float
        cos alpha / cos(alpha + beta): 1 / cos beta before an upright face
        (docs/theory-model-blades.md, Eq. (3)).
    """
    beta, alpha = np.radians(beta_deg), np.radians(inclination_deg)
    return np.asarray(np.cos(alpha) / np.cos(alpha + beta))


@dataclass(frozen=True, slots=True, eq=False)
class Slopes:
    """Derivatives of the mobilised friction; all (N,): degrees per N, per N, per degree.

    By the horizontal force F = P cos phi_w (what load cells measure), by the weight, and by the wall's
    friction angle at that F. By the inclination it is -1.
    """

    force: Floats
    weight: Floats
    wall: Floats


def slopes(horizontal_N: Floats, weight_N: Floats, wall_friction_deg: float) -> Slopes:
    """Derivatives of phi = atan(F / (W + F tan phi_w)) - beta; docs/theory-mobilised.md, Eq. (6).

    Parameters
    ----------
    horizontal_N : (N,) float, N
        Horizontal force F on the blade.
    weight_N : (N,) float, N
        Weight of the block.
    wall_friction_deg : float, degrees
        Friction angle between blade and sand, plus the inclination of a face that leans.

    Returns
    -------
    Slopes
    """
    F, W, wall = horizontal_N, weight_N, np.radians(wall_friction_deg)
    down = W + F * np.tan(wall)
    square = F**2 + down**2
    return Slopes(
        np.degrees(W / square), -np.degrees(F / square), np.asarray(-(F**2) / (np.cos(wall) ** 2 * square))
    )
