"""What the walk through the photographs found: camera, blade, surface, dyed layers and tracked points."""

import json
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WindowRecord:
    """What the photographs show, frame by frame; F frames, N tracked points."""

    blade: Floats  # (F, 2) blade face x and its std, mm
    surface: Floats  # (K, 4) frame, x, y, std, mm
    dyed: Floats  # (K, 5) frame, layer, x, y, std, mm; NaN x at gaps
    points_px: Floats  # (N, 2) points in frame 0
    layer_mm: Floats  # (N,) initial height of the layer that a point belongs to, NaN for the grid
    position_px: Floats  # (F, N, 2), as the camera stood in frame 0
    point_std_px: Floats  # (F, N)
    zncc: Floats  # (F, N)
    status: NDArray[np.int8]  # (F, N)
    camera: Floats  # (F, 3) movement of the camera since frame 0: x, y, px, and its std; NaN: lost
    lost_frames: dict[int, str]  # frame -> reason
    noise: Floats  # (K, 4) grey level, noise there, its std, pixels; no row: not measured
    noise_line: Floats  # (5,) of the straight line through the noise's variance
    texture: Floats  # (K, 2, LAGS) autocovariance of squares of sand in the first photograph
    texture_squares: Floats  # (K, 2) mean grey and side, px, of these
    notes: dict[int, list[str]] = field(default_factory=dict)  # frame -> what is wrong with the picture
    unseen: dict[int, list[str]] = field(default_factory=dict)  # frame -> what it could not show, and why

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The record as named arrays for the store; texts as JSON in an array of characters."""
        arrays = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _TEXTS}
        return {**arrays, **{name: np.array(json.dumps(getattr(self, name))) for name in _TEXTS}}

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray[np.generic]]) -> "WindowRecord":
        """The record from :meth:`to_arrays`; KeyError when an array is missing."""
        texts = {name: {int(k): v for k, v in json.loads(str(arrays[name])).items()} for name in _TEXTS}
        values = {f.name: arrays[f.name] for f in fields(cls) if f.name not in _TEXTS}
        return cls(**texts, **values)  # type: ignore[arg-type]


_TEXTS = ("lost_frames", "notes", "unseen")
