"""Painted control points: their places found in the photograph."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError, DataError
from ploughval.photos.markers.find import find_markers
from ploughval.photos.markers.rim import Floats
from ploughval.photos.series.frames import FrameSeries
from ploughval.photos.series.times import shorten
from ploughval.scene import Camera

LEAST = 4


@dataclass(frozen=True, slots=True, eq=False)
class ControlMarkers:
    """Control points that were found.

    Attributes
    ----------
    px, mm : (N, 2) float
        Centres of the ellipses in the photograph, and places on the window.
    std_px, radius_px : (N,) float
        Standard deviation of a coordinate in the photograph, and mean radius there.
    numbers : (N,) int
        Which of the control points they are.
    missing : tuple of str
        Control points that were not found, and why.
    """

    px: Floats
    mm: Floats
    std_px: Floats
    radius_px: Floats
    numbers: NDArray[np.int64]
    missing: tuple[str, ...]


def find_control_points(camera: Camera, frames: FrameSeries) -> ControlMarkers:
    """Find the control points of [camera] in the first photograph that can be read.

    Parameters
    ----------
    camera : Camera
        With ``control_points``, whose px are approximate, and ``markers``.
    frames : FrameSeries
        The photographs.

    Raises
    ------
    CalibrationError
        Fewer than four were found; each of the others is named.
    DataError
        No photograph can be read.
    """
    table, given = camera.markers, np.array(camera.control_points, float)
    assert table is not None
    found = find_markers(
        _first_readable(frames), given[:, :2], table.radius_px, reach_px=table.reach_px, kind=table.kind
    )
    missing = tuple(f"control_points.{k}: {why}" for k, why in enumerate(found.reasons) if why)
    there = found.found
    if there.sum() < LEAST:
        raise CalibrationError(
            f"{there.sum()} of {len(given)} control points were found in the photograph; expected at least "
            f"{LEAST}. "
            + shorten(missing)
            + ". Correct their px or camera.markers, or leave [camera.markers] out to use the px as they are."
        )
    px, mm = found.px[there], given[there, 2:]
    std = np.sqrt(np.mean(found.std_px[there] ** 2, axis=1))
    return ControlMarkers(px, mm, std, found.radius_px[there], np.flatnonzero(there), missing)


def _first_readable(frames: FrameSeries) -> np.ndarray:
    """The first photograph that can be read."""
    fault: DataError | None = None
    for frame in range(len(frames)):
        try:
            return frames.read(frame)
        except DataError as error:
            fault = fault or error
    raise fault or DataError("there is no photograph to find the control points in")
