"""From the sand behind the window to the photograph: refraction, projection, lens; and back."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.photos.calibration.foot import foot_mm
from ploughval.photos.calibration.homography import inverse, project
from ploughval.photos.calibration.lens import Lens
from ploughval.photos.calibration.refraction import Pane
from ploughval.scene import Window

Array = NDArray[np.float64]

PARAMETERS = 16
WINDOW_NUMBERS = ("thickness_mm", "index", "distance_mm")
_HALF_STEP_PX = 0.5
_SMALL = 1e-3  # of a standard deviation, for derivatives by differences


@dataclass(frozen=True, slots=True, eq=False)
class CameraModel:
    """A camera that looks at the sand through a window: px = lens(projection(front(mm))).

    Parameters
    ----------
    px_from_face : (3, 3) float
        Homography from the window's outer face (mm) to the photograph without distortion (px), its last
        entry 1; without a window from the sand's plane.
    lens : Lens
    window : Window or None
        Settings of the window.
    pane : Pane or None
        The window with its foot point, which follows from the rest.
    """

    px_from_face: Array
    lens: Lens
    window: Window | None = None
    pane: Pane | None = None

    @classmethod
    def of(cls, px_from_face: Array, lens: Lens, window: Window | None = None) -> "CameraModel":
        """A camera whose window's foot point is found: given in px, or from the tilt of the picture."""
        matrix = px_from_face / px_from_face[2, 2]
        if window is None:
            return cls(matrix, lens)
        if window.foot_px is not None:
            foot = project(inverse(matrix), lens.undistort(np.array(window.foot_px)))
        else:
            foot = foot_mm(matrix, lens.centre_px, window.distance_mm)
        return cls(matrix, lens, window, Pane(window.thickness_mm, window.index, window.distance_mm, foot))

    @property
    def parameters(self) -> Array:
        """First eight entries of the homography, five terms of the lens, :data:`WINDOW_NUMBERS`: (16,)."""
        numbers = [0.0 if self.window is None else getattr(self.window, name) for name in WINDOW_NUMBERS]
        return np.concatenate([self.px_from_face.ravel()[:8], self.lens.terms, numbers])

    def with_parameters(self, values: Array) -> "CameraModel":
        """The same set-up with other parameters."""
        lens = Lens(self.lens.centre_px, self.lens.radius_px, values[8:13])
        numbers = dict(zip(WINDOW_NUMBERS, values[13:].tolist(), strict=True))
        window = None if self.window is None else self.window.model_copy(update=numbers)
        return CameraModel.of(np.append(values[:8], 1.0).reshape(3, 3), lens, window)

    def face_mm(self, px: Array) -> Array:
        """Places (..., 2) on the outer face of the window, mm, of places in the photograph, px."""
        return project(inverse(self.px_from_face), self.lens.undistort(px))

    def to_mm(self, px: Array) -> Array:
        """Places (..., 2) of the sand, mm, of places in the photograph, px."""
        face = self.face_mm(px)
        return face if self.pane is None else self.pane.behind(face)

    def to_px(self, mm: Array) -> Array:
        """Places (..., 2) in the photograph, px, of places of the sand, mm."""
        face = np.asarray(mm, float) if self.pane is None else self.pane.front(mm)
        return self.lens.distort(project(self.px_from_face, face))

    def mm_per_px_at(self, px: Array) -> Array:
        """Local scale (...), mm per px: square root of the area that a pixel covers."""
        px = np.asarray(px, float)
        steps = _HALF_STEP_PX * np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1]])
        right, left, below, above = np.moveaxis(self.to_mm(px[..., None, :] + steps), -2, 0)
        a, b = right - left, below - above
        return np.asarray(np.sqrt(np.abs(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])))

    def moved(self, origin_mm: Array) -> "CameraModel":
        """The same camera with the world's origin at a place of the sand."""
        shift = np.eye(3)
        shift[:2, 2] = origin_mm
        return CameraModel.of(self.px_from_face @ shift, self.lens, self.window)

    def turned(self, angle_rad: float) -> "CameraModel":
        """The same camera with the world's axes turned about its origin, from x towards y."""
        c, s = np.cos(angle_rad), np.sin(angle_rad)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        return CameraModel.of(self.px_from_face @ turn, self.lens, self.window)


def spread_of(function: Callable[[CameraModel], Array], model: CameraModel, spread: Array) -> Array:
    """Changes of a result by one standard deviation of each source, (K, ...) for a spread (16, K).

    docs/theory-calibration.md, Eq. (5) is the sum of their squares.
    """
    changes = [
        (
            function(model.with_parameters(model.parameters + _SMALL * column))
            - function(model.with_parameters(model.parameters - _SMALL * column))
        )
        / (2 * _SMALL)
        for column in spread.T
    ]
    return np.array(changes)
