"""From the sand behind the window to the photograph: refraction, projection, lens; and back."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError
from ploughval.photos.homography import inverse, project
from ploughval.photos.lens import Lens
from ploughval.photos.refraction import Pane
from ploughval.scene import Window

Array = NDArray[np.float64]

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
        """The first eight entries of the homography and the five terms of the lens, (13,)."""
        return np.concatenate([self.px_from_face.ravel()[:8], self.lens.terms])

    def with_parameters(self, values: Array) -> "CameraModel":
        """The same set-up with other parameters."""
        lens = Lens(self.lens.centre_px, self.lens.radius_px, values[8:])
        return CameraModel.of(np.append(values[:8], 1.0).reshape(3, 3), lens, self.window)

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


def spread_of(function: Callable[[CameraModel], Array], model: CameraModel, spread: Array) -> Array:
    """Changes of a result by one standard deviation of each source, (K, ...) for a spread (13, K)."""
    changes = [
        (
            function(model.with_parameters(model.parameters + _SMALL * column))
            - function(model.with_parameters(model.parameters - _SMALL * column))
        )
        / (2 * _SMALL)
        for column in spread.T
    ]
    return np.array(changes)


def foot_mm(px_from_face: Array, centre_px: Array, distance_mm: float) -> Array:
    """Where the normal through the camera meets the window, (2,) mm, for a camera at a known distance.

    The optical axis is taken to go through the picture's middle; the focal length follows from the distance.

    Raises
    ------
    CalibrationError
        When no focal length puts the camera at that distance.
    """
    from scipy.optimize import brentq

    back = np.eye(3)
    back[:2, 2] = -centre_px
    matrix = back @ px_from_face

    def place(log_focal: float) -> Array:
        return _camera_place(matrix, float(np.exp(log_focal)))

    def off(log_focal: float) -> float:
        return float(np.log(place(log_focal)[2] / distance_mm))

    scale = np.sqrt(abs(np.linalg.det(px_from_face)))  # px a mm, about
    guess = float(np.log(distance_mm * scale))
    try:
        return place(float(brentq(off, guess - 2, guess + 2, xtol=1e-13)))[:2]
    except ValueError:
        raise CalibrationError(
            f"camera.window.distance_mm: got {distance_mm:g}; no camera at that distance sees the window as "
            "the points say. Check it, or give camera.window.foot_px: where the lens sees itself mirrored"
        ) from None


def _camera_place(matrix: Array, focal_px: float) -> Array:
    """Camera (3,) mm over the plane whose homography about the picture's middle is given (Zhang, 2000)."""
    axes = matrix / np.array([[focal_px], [focal_px], [1.0]])
    length = np.sqrt(np.linalg.norm(axes[:, 0]) * np.linalg.norm(axes[:, 1]))
    u, _, v = np.linalg.svd(axes[:, :2] / length, full_matrices=False)
    turn = u @ v  # the nearest two columns of a rotation
    third = np.cross(turn[:, 0], turn[:, 1])
    place = -np.column_stack([turn, third]).T @ (axes[:, 2] / length)
    return np.array([place[0], place[1], abs(place[2])])
