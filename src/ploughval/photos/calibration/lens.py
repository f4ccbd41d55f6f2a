"""A lens's radial and tangential distortion about the picture's middle (Brown 1971).

docs/theory-calibration.md, Eq. (2).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TERMS = ("k1", "k2", "k3", "p1", "p2")
_CONVERGED = 4e-16  # of half the diagonal: 1e-12 px in a photograph of 5 000 px
_BLOCK = 8192
_LEAST_STRETCH = 0.1  # of area: a lens that squeezes more than that is not believed
_RAY = 33
_RIM = 24


@dataclass(frozen=True, slots=True, eq=False)
class Lens:
    """Places in a photograph without and with the distortion of the lens.

    With q the place relative to ``centre_px`` in units of ``radius_px``, r = |q| and P = (p2, p1),
    q' = q (1 + k1 r^2 + k2 r^4 + k3 r^6) + r^2 P + 2 (q . P) q.

    Parameters
    ----------
    centre_px : (2,) float, px
        Middle of the photograph.
    radius_px : float, px
        Half its diagonal: k1 is the radial displacement of the corners as a share of half the diagonal.
    terms : (5,) float
        k1, k2, k3, p1, p2.
    """

    centre_px: Array
    radius_px: float
    terms: Array

    @classmethod
    def of_picture(cls, shape: tuple[int, int], terms: Array | None = None) -> "Lens":
        """The lens of photographs of (H, W) px, without distortion where no terms are given."""
        height, width = shape
        centre = np.array([(width - 1) / 2, (height - 1) / 2])
        return cls(centre, float(np.hypot(width, height)) / 2, np.zeros(5) if terms is None else terms)

    @property
    def straight(self) -> bool:
        """Whether it distorts nothing."""
        return not self.terms.any()

    def distort(self, px: Array) -> Array:
        """Places (..., 2) px in the photograph of places without distortion; NaN beyond where it folds."""
        px = np.asarray(px, float)
        if self.straight:
            return px
        q = (px - self.centre_px) / self.radius_px
        beyond = np.sum(q**2, axis=-1) >= self._reach()
        bent = np.where(beyond[..., None], np.nan, bend(q, self.terms))
        return np.asarray(self.centre_px + self.radius_px * bent)

    def undistort(self, px: Array) -> Array:
        """Places (..., 2) px without distortion of places in the photograph: Newton's method to 1e-12 px.

        NaN where the distortion gives no such place.
        """
        px = np.asarray(px, float)
        if self.straight:
            return px
        seen = ((px - self.centre_px) / self.radius_px).reshape(-1, 2)
        found, reach = np.empty_like(seen), self._reach()
        for first in range(0, len(seen), _BLOCK):  # a block stays in the processor's cache
            found[first : first + _BLOCK] = straighten(seen[first : first + _BLOCK], self.terms, reach)
        return np.asarray(self.centre_px + self.radius_px * found).reshape(px.shape)

    def folds(self) -> bool:
        """Whether it maps two places to one, or nearly so, anywhere in the photograph."""
        if self.straight:
            return False
        corner = 2 * (self.centre_px + 0.5) / (2 * self.radius_px)
        along = np.linspace(-1, 1, _RIM)
        rim = np.concatenate([np.stack([along, np.full(_RIM, s)], -1) for s in (-1, 1)])
        rim = np.concatenate([rim, rim[:, ::-1]]) * corner
        ideal = (self.undistort(self.centre_px + self.radius_px * rim) - self.centre_px) / self.radius_px
        if not np.isfinite(ideal).all():
            return True
        rays = ideal * np.linspace(0, 1, _RAY)[:, None, None]
        stretch = np.linalg.det(bend_slope(rays, self.terms))
        return bool(stretch.min() < _LEAST_STRETCH)

    def _reach(self) -> float:
        """Square of the radius at which the radial distortion turns back; infinite where it does not."""
        k1, k2, k3 = self.terms[:3]
        roots = np.roots(np.array([7 * k3, 5 * k2, 3 * k1, 1.0]))
        real = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)]
        return float(real.min(initial=np.inf))


def bend(q: Array, terms: Array) -> Array:
    """Distorted places (..., 2) in units of half the diagonal."""
    k1, k2, k3, p1, p2 = terms
    tangential = np.array([p2, p1])
    r2 = np.sum(q**2, axis=-1, keepdims=True)
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.asarray(q * (radial + 2 * (q @ tangential)[..., None]) + r2 * tangential)


def bend_slope(q: Array, terms: Array) -> Array:
    """Derivative (..., 2, 2) of the distorted by the undistorted place."""
    k1, k2, k3, p1, p2 = terms
    tangential = np.array([p2, p1])
    r2 = np.sum(q**2, axis=-1)
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3)) + 2 * (q @ tangential)
    growth = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))
    slope = growth[..., None, None] * q[..., :, None] * q[..., None, :]
    slope += 2 * (q[..., :, None] * tangential + tangential[:, None] * q[..., None, :])
    slope[..., 0, 0] += radial
    slope[..., 1, 1] += radial
    return np.asarray(slope)


def bend_by_terms(q: Array) -> Array:
    """Derivative (..., 2, 5) of the distorted place by k1, k2, k3, p1, p2."""
    x, y = q[..., 0], q[..., 1]
    r2 = x**2 + y**2
    across = 2 * x * y
    return np.stack(
        [
            np.stack([x * r2, x * r2**2, x * r2**3, across, r2 + 2 * x**2], axis=-1),
            np.stack([y * r2, y * r2**2, y * r2**3, r2 + 2 * y**2, across], axis=-1),
        ],
        axis=-2,
    )


def straighten(seen: Array, terms: Array, reach: float) -> Array:
    """Undistorted places (N, 2) in units of half the diagonal, NaN where there is none within sqrt(reach)."""
    k1, k2, k3, p1, p2 = terms
    u, v = seen.T
    r2 = u * u + v * v
    shrink = 1 - k1 * r2 * (1 - 3 * k1 * r2)
    x, y = u * shrink, v * shrink
    with np.errstate(all="ignore"):
        for _ in range(30):
            r2 = x * x + y * y
            radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3)) + 2 * (p2 * x + p1 * y)
            growth = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))
            off_x, off_y = u - x * radial - p2 * r2, v - y * radial - p1 * r2
            a, d = radial + growth * x * x + 4 * p2 * x, radial + growth * y * y + 4 * p1 * y
            b = growth * x * y + 2 * (p1 * x + p2 * y)
            area = a * d - b * b
            step_x, step_y = (d * off_x - b * off_y) / area, (a * off_y - b * off_x) / area
            # a place that has converged stays, whatever its neighbours do: blocks do not change numbers
            moving = ~((np.abs(step_x) < _CONVERGED) & (np.abs(step_y) < _CONVERGED))
            x, y = np.where(moving, x + step_x, x), np.where(moving, y + step_y, y)
            if not moving.any():
                break
        lost = ~((np.abs(off_x) + np.abs(off_y) < 1e-12) & (r2 < reach))
    return np.asarray(np.where(lost[:, None], np.nan, np.stack([x, y], axis=-1)))
