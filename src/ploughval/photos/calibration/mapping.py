"""The mapping between photograph and world, with what is known of its uncertainty."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import Direction
from ploughval.photos.calibration.camera_fit import TermTest
from ploughval.photos.calibration.camera_model import CameraModel, spread_of

Array = NDArray[np.float64]

POINT_COLUMNS = ("px_x", "px_y", "x_mm", "y_mm", "residual_x_px", "residual_y_px")


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """Mapping between the photograph (px) and the world (mm).

    Attributes
    ----------
    model : CameraModel
        Refraction, projection and lens.
    mm_per_px : float
        Scale at the tip, mm per px (geometric mean of the two directions).
    scale_std : float
        Relative standard uncertainty of the scale at the tip.
    residual_px : float
        Root mean square distance between given and projected points, px; 0 without redundant points.
    points : DataFrame
        px_x, px_y, x_mm, y_mm, residual_x_px, residual_y_px (projected minus given); may be empty.
    method : str
        How it was found, for the report.
    direction : Direction
        The way the blade travels in the photograph.
    spread : (16, K) float, units of the parameters
        Changes of ``model.parameters`` by one standard deviation of K independent sources.
    std_px : float, px
        Standard uncertainty of a point's coordinate that ``spread`` stands for; NaN without points.
    shape : (H, W), px
        Size of the photographs.
    tests : tuple of TermTest
        Which terms of the lens were tried, and whether they pay.
    warnings : tuple of str
        What makes it doubtful.
    """

    model: CameraModel
    mm_per_px: float
    scale_std: float
    residual_px: float
    points: pd.DataFrame
    method: str
    direction: Direction
    spread: Array
    std_px: float
    shape: tuple[int, int]
    tests: tuple[TermTest, ...] = ()
    warnings: tuple[str, ...] = ()

    def to_mm(self, px: Array) -> Array:
        """World coordinates (..., 2), mm, of image points (..., 2), px."""
        return self.model.to_mm(px)

    def to_px(self, mm: Array) -> Array:
        """Image coordinates (..., 2), px, of world points (..., 2), mm."""
        return self.model.to_px(mm)

    def mm_per_px_at(self, px: Array) -> Array:
        """Local scale (...), mm per px, at image points (..., 2), px: geometric mean of the directions."""
        return self.model.mm_per_px_at(px)

    def std_mm(self, px: Array) -> Array:
        """Standard uncertainty (..., 2), mm, that the calibration gives to x and y at image points, px.

        What reading a place in the photograph adds is not in it.
        """
        px = np.asarray(px, float)
        changes = spread_of(lambda model: model.to_mm(px), self.model, self.spread)
        return np.asarray(np.sqrt(np.sum(changes**2, axis=0)))

    def with_origin_at(self, tip_px: Array) -> "Calibration":
        """The same mapping with the world begun where the image point (2,), px, shows it.

        Whatever the camera is, the origin is seen there: places near it are known better than before.
        """

        def parameters(model: CameraModel) -> Array:
            return model.moved(model.to_mm(tip_px)).parameters

        origin_mm = self.to_mm(tip_px)
        model = self.model.moved(origin_mm)
        spread = spread_of(parameters, self.model, self.spread).T
        x, y = (self.points[name] - shift for name, shift in zip(("x_mm", "y_mm"), origin_mm, strict=True))
        points = self.points.assign(x_mm=x, y_mm=y)
        scale, std = scale_at_origin(model, spread)
        return replace(self, model=model, spread=spread, points=points, mm_per_px=scale, scale_std=std)


def scale_at_origin(model: CameraModel, spread: Array) -> tuple[float, float]:
    """Scale at the world's origin, mm per px, and its relative standard uncertainty."""
    tip_px = model.to_px(np.zeros(2))
    changes = spread_of(lambda other: np.log(other.mm_per_px_at(other.to_px(np.zeros(2)))), model, spread)
    return float(model.mm_per_px_at(tip_px)), float(np.sqrt(np.sum(changes**2)))


def local_axes(model: CameraModel) -> Array:
    """Derivative (2, 2) of px by mm at the world's origin: rows x, y in px; columns x, y in mm."""
    step = 0.5 * float(model.mm_per_px_at(model.to_px(np.zeros(2))))
    ends = model.to_px(step * np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1]]))
    return np.asarray(np.stack([ends[0] - ends[1], ends[2] - ends[3]], axis=-1) / (2 * step))
