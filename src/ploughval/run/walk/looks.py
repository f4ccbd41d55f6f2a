"""The photographs read in their order and looked at: camera, blade, sand, surface."""

from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Region
from ploughval.errors import DataError
from ploughval.photos import Calibration, FrameSeries
from ploughval.piv import UNMOVED, CameraMovement, CameraWatch
from ploughval.run.walk.noise import NO_NOISE, noise_arrays, noise_mask
from ploughval.run.walk.pattern import texture_arrays
from ploughval.run.walk.steadied import FixedMarkers, Steadied, camera_sees, look_steadied
from ploughval.scene import Scene, Step
from ploughval.tracers import Sight, Watcher

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

STILL_DEPTHS = 0.05
"""Sand this far below the tip's level is taken to stay where it is, in depths of the blade."""
COARSE_PX = 8
"""Height above the tip is computed for every so many pixels of a picture."""
AHEAD = 1
"""Frames that are read and looked at while another is tracked."""


@dataclass(frozen=True, slots=True)
class Series:
    """The photographs of a test, and what is needed to read them.

    Attributes
    ----------
    scene : Scene
        Says whether points are tracked.
    frames : FrameSeries
    calibration : Calibration
        Pixels to millimetres.
    first : int
        Frame that shows the sand at rest; those before it are lost.
    """

    scene: Scene
    frames: FrameSeries
    calibration: Calibration
    first: int = 0


@dataclass(frozen=True, slots=True)
class Look:
    """One photograph looked at; without picture where it could not be read."""

    frame: int
    image: Grey | None
    camera: CameraMovement = UNMOVED
    sight: Sight | None = None
    fault: str = ""
    doubled: bool = False  # the same picture as the frame before
    straightened: bool = False  # layers are told of places of the first photograph, as in ``Steadied``
    once: dict[str, Floats] = field(default_factory=dict)  # noise and texture, in the look that tells them
    after: dict[str, Any] = field(default_factory=dict)  # snapshot of the looks right after this one


class Looks:
    """Reads the photographs of a series in their order and looks at each."""

    def __init__(self, series: Series) -> None:
        self._series = series
        self.watcher = Watcher(series.scene, series.calibration)
        self.begun: int | None = None  # the first frame that was read
        self._camera: CameraWatch | None = None
        self._markers: FixedMarkers | None = None
        self._last: int | None = None  # the last frame that was read, and its picture
        self._last_image: Grey | None = None
        self._calm: NDArray[np.bool_] | None = None  # where noise is measured, until it is

    def one_by_one(self, frames: range) -> Iterator[Look]:
        """Each frame when it is asked for."""
        return (self._look(frame) for frame in frames)

    def ahead(self, frames: range) -> Iterator[Look]:
        """The frames that follow are looked at in the background, in their order."""
        with ThreadPoolExecutor(1) as pool:
            waiting: list[Future[Look]] = []
            for frame in frames:
                waiting.append(pool.submit(self._look, frame))
                if len(waiting) > AHEAD:
                    yield waiting.pop(0).result()
            for future in waiting:
                yield future.result()

    def restore(self, taken: Mapping[str, Any]) -> None:
        """Go on from the snapshot of a look: what the first photograph tells is read from it again.

        Raises
        ------
        DataError
            A photograph that was read cannot be read any more.
        KeyError
            When something is missing in it.
        """
        if taken["begun"] is None:
            return
        self._begin(taken["begun"], self._series.frames.read(taken["begun"]))
        assert self._camera is not None
        self.watcher.restore(taken["watcher"])
        self._camera.restore(taken["camera"])
        if self._markers is not None:
            self._markers.watch.restore(taken["markers"])
        if not taken["calm"]:
            self._calm = None
        self._last = taken["last"]
        self._last_image = self._series.frames.read(taken["last"])

    def _snapshot(self) -> dict[str, Any]:
        if self._camera is None:
            return {"begun": None}
        return {
            "begun": self.begun,
            "last": self._last,
            "calm": self._calm is not None,
            "watcher": self.watcher.snapshot(),
            "camera": self._camera.snapshot(),
            "markers": None if self._markers is None else self._markers.watch.snapshot(),
        }

    def _look(self, frame: int) -> Look:
        try:
            image = self._series.frames.read(frame)
        except DataError as error:
            if frame == self._series.first:
                raise
            return Look(frame, None, fault=str(error), after=self._snapshot())
        once: dict[str, Floats] = {}
        if self._camera is None:
            seen, movement = self._begin(frame, image)
            if Step.TRACKS in self._series.scene.steps:
                once |= texture_arrays(image, seen.sight.sand)
        else:
            movement = camera_sees(image, self._camera, self._markers)
            seen = look_steadied(self.watcher, frame, image, movement)
            self._hide_markers(seen.sight, movement)
        doubled = self._last_image is not None and np.array_equal(image, self._last_image)
        if self._calm is not None and self._last_image is not None and not doubled:
            once |= noise_arrays(self._last_image, image, self._calm) or NO_NOISE
            self._calm = None
        self._last, self._last_image = frame, image
        return Look(
            frame,
            image,
            movement,
            seen.sight,
            doubled=doubled,
            straightened=seen.straightened,
            once=once,
            after=self._snapshot(),
        )

    def _begin(self, frame: int, image: Grey) -> tuple[Steadied, CameraMovement]:
        """Learn from the first photograph that can be read."""
        seen, movement = Steadied(self.watcher.look(frame, image)), self._mark(image)
        self._hide_markers(seen.sight, movement)
        low = self._still(seen.sight)
        self.begun = frame
        self._camera, self._calm = CameraWatch(image, low), noise_mask(low, seen.sight.sand)
        return seen, movement

    def _mark(self, image: Grey) -> CameraMovement:
        """Find the fixed markers in the first photograph, where the scene has some."""
        camera = self._series.scene.camera
        if camera is None or camera.markers is None:
            return UNMOVED
        self._markers = FixedMarkers(camera, image)
        return self._markers.at_start()

    def _hide_markers(self, sight: Sight, movement: CameraMovement) -> None:
        if self._markers is not None:
            self._markers.hide(sight.regions, movement)

    def _still(self, sight: Sight) -> NDArray[np.bool_]:
        """Sand (H, W) in the first photograph that is below what the blade can move."""
        height, width = sight.regions.shape
        rows, columns = np.mgrid[0:height:COARSE_PX, 0:width:COARSE_PX]
        places = np.stack([columns, rows], axis=-1).astype(float)
        y_mm = self._series.calibration.to_mm(places)[..., 1]
        low = y_mm < -STILL_DEPTHS * self._series.scene.blade.depth_mm
        fine = low.repeat(COARSE_PX, axis=0).repeat(COARSE_PX, axis=1)[:height, :width]
        return np.asarray(fine & (sight.regions == Region.SAND))
