"""What a window does to the places of the sand behind it: Snell's law through a plane pane.

A ray from the camera meets the outer face at the distance r from the camera's foot point on it. Inside, it
goes on to r + t tan(theta'), with n sin(theta') = sin(theta) and tan(theta) = r / D
(docs/theory-calibration.md, Eq. (6)).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Pane:
    """A plane window between camera and sand, the sand lying against its inner face.

    Parameters
    ----------
    thickness_mm : float, mm
    index : float
        Refractive index against air.
    distance_mm : float, mm
        From the camera's pupil to the outer face, along its normal.
    foot_mm : (2,) float, mm
        Where that normal meets the window.
    """

    thickness_mm: float
    index: float
    distance_mm: float
    foot_mm: Array

    def behind(self, outer_mm: Array) -> Array:
        """Places (..., 2) of the inner face seen through places of the outer face, mm."""
        away = np.asarray(outer_mm, float) - self.foot_mm
        return np.asarray(self.foot_mm + away * (1 + self._gain(np.sum(away**2, axis=-1, keepdims=True))))

    def front(self, inner_mm: Array) -> Array:
        """Places (..., 2) of the outer face through which places of the inner face are seen, mm."""
        away = np.asarray(inner_mm, float) - self.foot_mm
        far = np.sqrt(np.sum(away**2, axis=-1, keepdims=True))
        near = far / (1 + self.thickness_mm / (self.index * self.distance_mm))
        for _ in range(20):  # Newton; the gain changes by less than a hundredth over the window
            gain = self._gain(near**2)
            bent = (self.index**2 - 1) * near**2
            slope = 1 + gain * (1 - bent / ((self.index * self.distance_mm) ** 2 + bent))
            step = (near * (1 + gain) - far) / slope
            near = near - step
            if not np.any(np.abs(step) > 1e-14 * (far + self.distance_mm)):
                break
        return np.asarray(self.foot_mm + away / (1 + self._gain(near**2)))

    def _gain(self, r2: Array) -> Array:
        """The share of r that the ray moves on inside, t tan(theta') / r."""
        bent = (self.index * self.distance_mm) ** 2 + (self.index**2 - 1) * r2
        return np.asarray(self.thickness_mm / np.sqrt(bent))
