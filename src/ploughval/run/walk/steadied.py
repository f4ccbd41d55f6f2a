"""The camera's movement from fixed markers where there are some, else from sand; and pictures freed of it."""

import math
from dataclasses import dataclass, replace
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Region
from ploughval.photos.markers.watch import MarkerWatch
from ploughval.piv import UNMOVED, CameraMovement, CameraWatch
from ploughval.scene import Camera
from ploughval.tracers import Sight, Watcher

Grey = NDArray[np.uint8] | NDArray[np.uint16]
Bytes = NDArray[np.uint8]

TURN_PX = 0.1
"""A turn that moves the picture's corners by less is left in where blade and surface are looked for."""


@dataclass(frozen=True, slots=True)
class Steadied:
    """A photograph seen as the camera stood in the first one.

    ``straightened``: blade, surface and dyed layers were found in a resampled picture, whose places are those
    of the first photograph; else in the photograph itself.
    """

    sight: Sight
    straightened: bool = False


class FixedMarkers:
    """The fixed markers of a test in its photographs.

    Parameters
    ----------
    camera : Camera
        With ``markers``.
    image : (H, W) uint8 or uint16
        The first photograph.
    """

    def __init__(self, camera: Camera, image: Grey) -> None:
        assert camera.markers is not None
        table = camera.markers
        self._clear_px = table.clear_px
        self.watch = MarkerWatch(
            image,
            np.array(camera.marker_places_px, float),
            table.radius_px,
            reach_px=table.reach_px,
            kind=table.kind,
            names=[f"control point {k}" for k in range(len(camera.control_points or ()))]
            + [f"fixed marker {k}" for k in range(len(table.fixed_px))],
        )

    def at_start(self) -> CameraMovement:
        """The first photograph, with the markers that are not in it."""
        first = self.watch.first
        missing = tuple(
            f"{name}: {why}" for name, why in zip(self.watch.names, first.reasons, strict=True) if why
        )
        return replace(UNMOVED, markers=int(first.found.sum()) if self.watch.tells else 0, missing=missing)

    def hide(self, regions: Bytes, movement: CameraMovement) -> None:
        """Mark what is painted as outside: it is no sand, and does not move with it."""
        height, width = regions.shape
        radius = self._clear_px
        for x, y in movement.now(self.watch.first.px[self.watch.first.found]):
            left, right = max(math.floor(x - radius), 0), min(math.ceil(x + radius) + 1, width)
            top, bottom = max(math.floor(y - radius), 0), min(math.ceil(y + radius) + 1, height)
            if left < right and top < bottom:
                row, column = np.ogrid[top:bottom, left:right]
                part = regions[top:bottom, left:right]
                part[np.hypot(column - x, row - y) <= radius] = Region.OUTSIDE


def camera_sees(image: Grey, sand: CameraWatch, markers: FixedMarkers | None) -> CameraMovement:
    """Movement of the camera in the next photograph."""
    by_sand = sand.see(image)
    return by_sand if markers is None or not markers.watch.tells else markers.watch.see(image, by_sand)


def look_steadied(watcher: Watcher, frame: int, image: Grey, camera: CameraMovement) -> Steadied:
    """What a photograph shows, freed of what the camera did."""
    height, width = image.shape
    corners = np.array([[0.0, 0.0], [width - 1, 0.0], [0.0, height - 1], [width - 1, height - 1]])
    besides = camera.now(corners) - corners - camera.shift_px
    if not camera.turned or np.abs(besides).max() < TURN_PX:
        across, down = (camera.now(corners) - corners).mean(axis=0).tolist()
        return Steadied(watcher.look(frame, image, (across, down)))
    constant = camera.pivot_px + camera.shift_px - camera.linear @ camera.pivot_px
    matrix = np.column_stack([camera.linear, constant])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    straight = cv2.warpAffine(image, matrix, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    sight = watcher.look(frame, cast(Grey, straight))
    regions = cv2.warpAffine(
        sight.regions,
        matrix,
        (width, height),
        flags=cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=int(Region.OUTSIDE),
    )
    return Steadied(replace(sight, regions=np.asarray(regions, np.uint8)), straightened=True)
