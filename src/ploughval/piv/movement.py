"""How the camera has moved since the first photograph: a shift, with markers a turn and a scale too."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CameraMovement:
    """Where the camera looks, against the first photograph.

    What stood still at p in the first photograph stands at pivot + linear (p - pivot) + shift in this one.

    Attributes
    ----------
    shift_px : (2,) float
        Right and down. From sand: the sum of all knocks so far, exactly zero without one.
    std_px : float
        Standard deviation of a coordinate of the shift.
    drift_px : (2,) float
        Movement of still sand besides, slow enough to be the sand's own; NaN where it does not tell.
    turn_deg : float
        Rotation, counter-clockwise as seen; NaN where not told. From sand it is not in ``linear``.
    zncc : float
        Median correlation of still sand with the first photograph; NaN where none was compared.
    linear : (2, 2) float, 1
        Turn and scale, from fixed markers; the identity without them.
    pivot_px : (2,) float
        Middle of the markers in the first photograph.
    turn_std : float
        Standard deviation of the turn, rad, and of the scale.
    markers : int
        Fixed markers that tell the movement; 0: none does, but the sand.
    missing : tuple of str
        Which fixed markers were not used, and why.
    """

    shift_px: Floats
    std_px: float
    drift_px: Floats
    turn_deg: float
    zncc: float
    linear: Floats = field(default_factory=lambda: np.eye(2))
    pivot_px: Floats = field(default_factory=lambda: np.zeros(2))
    turn_std: float = 0.0
    markers: int = 0
    missing: tuple[str, ...] = ()

    @property
    def turned(self) -> bool:
        """Whether there is more than a shift."""
        return not np.array_equal(self.linear, np.eye(2))

    def now(self, first_px: Floats) -> Floats:
        """Places (..., 2) px of the first photograph in this one."""
        if not self.turned:
            return np.asarray(first_px + self.shift_px)
        return np.asarray((first_px - self.pivot_px) @ self.linear.T + (self.pivot_px + self.shift_px))

    def at_first(self, now_px: Floats) -> Floats:
        """Places (..., 2) px of this photograph in the first one."""
        if not self.turned:
            return np.asarray(now_px - self.shift_px)
        back = np.linalg.inv(self.linear)
        return np.asarray((now_px - self.pivot_px - self.shift_px) @ back.T + self.pivot_px)

    def since(self, before: "CameraMovement", before_px: Floats) -> Floats:
        """How far (..., 2) px the camera has carried what stood at places of an earlier photograph."""
        if not (self.turned or before.turned):
            return np.broadcast_to(self.shift_px - before.shift_px, before_px.shape)
        return self.now(before.at_first(before_px)) - before_px

    def std_at(self, first_px: Floats) -> Floats:
        """Standard deviation (...) px of a coordinate of the movement at places (..., 2) px."""
        arm = np.linalg.norm(first_px - self.pivot_px, axis=-1)
        return np.asarray(np.hypot(self.std_px, self.turn_std * arm))


UNMOVED = CameraMovement(np.zeros(2), 0.0, np.zeros(2), 0.0, 1.0)
"""A camera that stands as it did in the first photograph."""
