"""The motion of an increment: points seen in two photographs, relative to the tip half-way between."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.scene import Scene
from ploughval.tracers.view import Floats

_LEAST_STD_MM = 1e-4  # exact motion, and stds that were never given
_TORN = (Status.SHEARED, Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER, Status.LOST)
_LOW_DEG = 6.0  # flatter than any band
_LEAST_LOW = 12
_LEAST_KNOCK = 0.01  # of a subset
_SUBSET_SPACINGS = 2.0  # side of a subset in spacings of the points, where the picture's scale is not stated


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Points that were seen at both ends of an increment, ahead of the blade.

    Attributes
    ----------
    place : (N, 2) float, mm
        Mean of the two places, relative to the tip half-way.
    rate : (N, 2) float, mm/mm
        Motion for a millimetre of the blade's travel.
    std : (N,) float, mm/mm
        Standard deviation of a component of rate.
    lost : (M, 2) float, mm
        Places of points that were seen at its start and no longer correlate at its end, relative to the tip
        half-way: bands tear the subsets that they cross.
    travel_mm : float
        The blade's.
    reach_mm : float
        Side of a subset: vectors of points closer to each other than this share texture and error.
    """

    place: Floats
    rate: Floats
    std: Floats
    lost: Floats
    travel_mm: float
    reach_mm: float


def pairs_of(tracks: xr.Dataset) -> list[tuple[int, int]]:
    """Successive frames in which blade and points were seen."""
    seen = np.isfinite(tracks["u_mm"].to_numpy()) & np.isfinite(tracks["x_mm"].to_numpy()).any(axis=1)
    frames = np.flatnonzero(seen)
    return list(zip(frames[:-1].tolist(), frames[1:].tolist(), strict=True))


def motion_of(tracks: xr.Dataset, scene: Scene, first: int, last: int) -> Motion:
    """Motion between two frames; a travel that is not positive leaves rates NaN."""
    u0, u1 = (float(tracks["u_mm"].to_numpy()[k]) for k in (first, last))
    tip = [(u0 + u1) / 2, 0.0]
    place, moved, std = _points(tracks, first, last)
    place, lost = place - tip, _lost(tracks, first, last) - tip
    ahead = place[:, 0] > 0
    place, moved, std, lost = place[ahead], moved[ahead], std[ahead], lost[lost[:, 0] > 0]
    travel, reach = (u1 - u0 if u1 > u0 else np.nan), reach_of(scene, place)
    moved = moved - _picture_moved(place, moved, reach)
    return Motion(place, moved / travel, std / travel, lost, u1 - u0, reach)


def _picture_moved(place: Floats, moved: Floats, reach_mm: float) -> Floats:
    """Motion (2,), mm, of the whole picture: that of sand which no band reaches, where it is no noise.

    A camera that was knocked moves everything; sand at the level of the tip and below it rests in truth.
    """
    low = np.arctan2(place[:, 1], place[:, 0]) < np.radians(_LOW_DEG)
    if low.sum() < _LEAST_LOW:
        return np.zeros(2)
    middle = np.asarray(np.median(moved[low], axis=0))
    return middle if np.hypot(*middle) > _LEAST_KNOCK * reach_mm else np.zeros(2)


def _points(tracks: xr.Dataset, first: int, last: int) -> tuple[Floats, Floats, Floats]:
    """Mean places, motions and the motions' stds, mm, of points seen in both frames."""
    x, y, std = (tracks[name].to_numpy() for name in ("x_mm", "y_mm", "std_mm"))
    ok = np.isin(tracks["status"].to_numpy()[[first, last]], (Status.OK, Status.REPLACED)).all(axis=0)
    before, after = (np.column_stack([x[k], y[k]]) for k in (first, last))
    good = ok & np.isfinite(before).all(axis=1) & np.isfinite(after).all(axis=1)
    before, after = before[good], after[good]
    # A reference common to both drops out of the motion, so that what gathered before does not count.
    noise = np.sqrt(2.0) * np.nan_to_num(std[last, good])
    return (before + after) / 2, after - before, np.maximum(noise, _LEAST_STD_MM)


def _lost(tracks: xr.Dataset, first: int, last: int) -> Floats:
    """Places (M, 2), mm, at its start of points that correlation lost in the increment."""
    status = tracks["status"].to_numpy()
    torn = np.isin(status[first], (Status.OK, Status.REPLACED)) & np.isin(status[last], _TORN)
    place = np.column_stack([tracks[name].to_numpy()[first, torn] for name in ("x_mm", "y_mm")])
    return np.asarray(place[np.isfinite(place).all(axis=1)])


def reach_of(scene: Scene, place: Floats) -> float:
    """Side of a subset, mm."""
    if scene.camera is not None and scene.camera.mm_per_px is not None:
        return scene.piv.subset_px * scene.camera.mm_per_px
    return _SUBSET_SPACINGS * spacing_of(place)


def cells_of(place: Floats, side_mm: float) -> tuple[int, NDArray[np.intp]]:
    """How many squares of a side hold points (N, 2), and the number of the square of each."""
    column, row = np.floor(place / side_mm).astype(np.intp).T
    cells, own = np.unique(column * (np.ptp(row) + 1) + row if len(row) else column, return_inverse=True)
    return len(cells), own


def spacing_of(place: Floats) -> float:
    """Typical distance of neighbouring points, mm, from the area they cover."""
    if len(place) < 2:
        return 1.0
    span = np.ptp(place, axis=0)
    return max(float(np.sqrt(span[0] * span[1] / len(place))), 1e-6)


def frame_number(tracks: xr.Dataset, index: int) -> int:
    """Number of the frame that stands at a place in the tracks."""
    return int(tracks["frame"].to_numpy()[index])
