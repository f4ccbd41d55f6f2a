"""The one walk through the photographs: camera, blade, sand, surface, dyed layers and tracked points."""

import json
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Region, Status
from ploughval.errors import DataError
from ploughval.photos import Calibration, FrameSeries
from ploughval.piv import UNMOVED, CameraMovement, CameraWatch, FramePoints, Tracker
from ploughval.run.frame_notes import FrameNotes
from ploughval.run.noise import NO_NOISE, noise_arrays, noise_mask
from ploughval.run.pattern import NO_TEXTURE, texture_arrays
from ploughval.run.steadied import FixedMarkers, Steadied, camera_sees, look_steadied
from ploughval.scene import Scene, Step
from ploughval.tracers import PointSet, Sight, Watcher, place_points
from ploughval.watch import Progress, unheard

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

STILL_DEPTHS = 0.05
"""Sand this far below the tip's level is taken to stay where it is, in depths of the blade."""
COARSE_PX = 8
"""Height above the tip is computed for every so many pixels of a picture."""
AHEAD = 1
"""Frames that are read and looked at while another is tracked."""


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


def watch(
    scene: Scene,
    frames: FrameSeries,
    calibration: Calibration,
    *,
    first: int = 0,
    workers: int = 1,
    progress: Progress = unheard,
) -> WindowRecord:
    """Walk the photographs once, in order of time, holding a few frames in memory.

    Parameters
    ----------
    scene : Scene
        Says whether points are tracked.
    frames : FrameSeries
        The photographs.
    calibration : Calibration
        Pixels to millimetres.
    first : int
        Frame that shows the sand at rest; those before it are lost.
    workers : int
        Threads; with more than one the next photograph is read and looked at while one is tracked. The
        numbers do not depend on it.
    progress : callable
        Called with (stage, done, total) after each frame.

    Returns
    -------
    WindowRecord
        Frames that could not be read are NaN and named in ``lost_frames``.

    Raises
    ------
    DataError
        When the first photograph cannot be read.
    """
    looks = _Looks(scene, calibration, frames, first)
    walk = _Walk(scene, calibration, frames, looks.watcher, workers)
    for look in looks.ahead() if workers > 1 else looks.one_by_one():
        walk.take(look)
        progress("photographs", look.frame + 1, len(frames))
    return walk.record({**looks.texture, **looks.noise})


@dataclass(frozen=True, slots=True)
class _Look:
    """One photograph looked at; without picture where it could not be read."""

    frame: int
    image: Grey | None
    camera: CameraMovement = UNMOVED
    sight: Sight | None = None
    fault: str = ""
    doubled: bool = False  # the same picture as the frame before
    straightened: bool = False  # layers are told of places of the first photograph, as in ``Steadied``


class _Looks:
    """Reads the photographs in their order and looks at each: camera, blade, sand, surface."""

    def __init__(self, scene: Scene, calibration: Calibration, frames: FrameSeries, first: int) -> None:
        self._scene, self._calibration, self._frames, self._first = scene, calibration, frames, first
        self.watcher = Watcher(scene, calibration)
        self._camera: CameraWatch | None = None
        self._markers: FixedMarkers | None = None
        self._last_image: Grey | None = None
        self._calm: NDArray[np.bool_] | None = None  # where noise is measured, until it is
        self.noise = NO_NOISE
        self.texture = NO_TEXTURE

    def one_by_one(self) -> Iterator[_Look]:
        """Each frame when it is asked for."""
        return (self._look(frame) for frame in range(len(self._frames)))

    def ahead(self) -> Iterator[_Look]:
        """The frames that follow are looked at in the background, in their order."""
        with ThreadPoolExecutor(1) as pool:
            waiting: list[Future[_Look]] = []
            for frame in range(len(self._frames)):
                waiting.append(pool.submit(self._look, frame))
                if len(waiting) > AHEAD:
                    yield waiting.pop(0).result()
            for future in waiting:
                yield future.result()

    def _look(self, frame: int) -> _Look:
        try:
            image = self._frames.read(frame)
        except DataError as error:
            if frame == self._first:
                raise
            return _Look(frame, None, fault=str(error))
        if self._camera is None:
            seen, movement = Steadied(self.watcher.look(frame, image)), self._mark(image)
            self._hide_markers(seen.sight, movement)
            low = self._still(seen.sight)
            self._camera, self._calm = CameraWatch(image, low), noise_mask(low, seen.sight.sand)
            if Step.TRACKS in self._scene.steps:
                self.texture = texture_arrays(image, seen.sight.sand)
        else:
            movement = camera_sees(image, self._camera, self._markers)
            seen = look_steadied(self.watcher, frame, image, movement)
            self._hide_markers(seen.sight, movement)
        doubled = self._last_image is not None and np.array_equal(image, self._last_image)
        if self._calm is not None and self._last_image is not None and not doubled:
            self.noise = noise_arrays(self._last_image, image, self._calm) or NO_NOISE
            self._calm = None
        self._last_image = image
        return _Look(frame, image, movement, seen.sight, doubled=doubled, straightened=seen.straightened)

    def _mark(self, image: Grey) -> CameraMovement:
        """Find the fixed markers in the first photograph, where the scene has some."""
        camera = self._scene.camera
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
        y_mm = self._calibration.to_mm(np.stack([columns, rows], axis=-1).astype(float))[..., 1]
        low = y_mm < -STILL_DEPTHS * self._scene.blade.depth_mm
        fine = low.repeat(COARSE_PX, axis=0).repeat(COARSE_PX, axis=1)[:height, :width]
        return np.asarray(fine & (sight.regions == Region.SAND))


class _Walk:
    """State of the walk: tracker, dyed layers and the lists that grow frame by frame."""

    def __init__(
        self, scene: Scene, calibration: Calibration, frames: FrameSeries, watcher: Watcher, workers: int
    ) -> None:
        self._scene, self._calibration, self._watcher = scene, calibration, watcher
        self._tracker = Tracker(scene.piv, workers) if Step.TRACKS in scene.steps else None
        self._points = PointSet(px=np.empty((0, 2)), layer_mm=np.empty(0))
        self._blade = np.full((len(frames), 2), np.nan)
        self._camera = np.full((len(frames), 3), np.nan)
        self._notes = FrameNotes(calibration.mm_per_px, frames.shape)
        self._surface: list[Floats] = []
        self._dyed: list[Floats] = []
        self._seen: list[FramePoints] = []
        self._lost: dict[int, str] = {}
        self._unseen: dict[int, list[str]] = {}

    def take(self, look: _Look) -> None:
        """Take in a photograph that was looked at."""
        if look.image is None or look.sight is None:
            self._lost[look.frame] = look.fault
            if self._tracker is not None and self._seen:
                self._seen.append(self._tracker.skip())
            return
        camera = look.camera
        self._camera[look.frame] = *camera.shift_px, camera.std_px
        self._notes.add(look.frame, look.sight, camera, doubled=look.doubled)
        carried = None
        if self._tracker is not None:
            found = self._tracked(self._tracker, look.frame, look.image, look.sight, camera)
            self._seen.append(found)
            carried = self._carried(found, UNMOVED if look.straightened else camera)
        self._note(look.frame, self._watcher.follow_dyed(look.sight, carried))

    def _tracked(
        self, tracker: Tracker, frame: int, image: Grey, sight: Sight, camera: CameraMovement
    ) -> FramePoints:
        """The points in a photograph; placed in the first one."""
        if self._seen:
            return tracker.advance(image, sight.sand, camera)
        sand = sight.sand
        self._points = place_points(sand, self._calibration, self._scene)
        tracker.start(image, self._points.px, sand)
        self._seen += [_missing(len(self._points.px))] * frame
        return _at_rest(self._points.px)

    def _carried(self, seen: FramePoints, camera: CameraMovement) -> dict[float, Floats]:
        """Where the followed points of each layer stand in the picture that layers are found in, px."""
        layer = np.where(seen.status == Status.OK, self._points.layer_mm, np.nan)
        heights = np.unique(layer[np.isfinite(layer)]).tolist()
        return {height: camera.now(seen.position_px[layer == height]) for height in heights}

    def _note(self, frame: int, sight: Sight) -> None:
        self._blade[frame] = sight.blade_x_mm, sight.blade_std_mm
        if sight.reasons:
            self._unseen[frame] = list(sight.reasons)
        line = np.column_stack([sight.surface_mm, sight.surface_std_mm])
        self._surface.append(np.column_stack([np.full(len(line), float(frame)), line]))
        for layer, rows in sight.dyed.items():
            head = np.broadcast_to([float(frame), float(layer)], (len(rows), 2))
            self._dyed.append(np.column_stack([head, rows]))

    def record(self, picture: dict[str, Floats]) -> WindowRecord:
        """Everything that was taken in, with the picture's own noise and texture."""
        shape = (len(self._seen), len(self._points.px)) if self._seen else (len(self._blade), 0)
        position, std, zncc, status = (
            np.stack([getattr(s, name) for s in self._seen]) if self._seen else np.empty((*shape, *more))
            for name, more in (("position_px", (2,)), ("std_px", ()), ("zncc", ()), ("status", ()))
        )
        return WindowRecord(
            blade=self._blade,
            surface=_stack(self._surface, 4),
            dyed=_stack(self._dyed, 5),
            points_px=self._points.px,
            layer_mm=self._points.layer_mm,
            position_px=position,
            point_std_px=std,
            zncc=zncc,
            status=status.astype(np.int8),
            camera=self._camera,
            lost_frames=self._lost,
            **picture,
            notes=self._notes.texts(),
            unseen=self._unseen,
        )


def _at_rest(points_px: Floats) -> FramePoints:
    """Points of frame 0: where they were put, known exactly, correlated with themselves."""
    count = len(points_px)
    return FramePoints(
        position_px=points_px.copy(),
        std_px=np.zeros(count),
        zncc=np.ones(count),
        status=np.full(count, Status.OK, np.int8),
    )


def _missing(count: int) -> FramePoints:
    """Points of a frame before the first one that could be read."""
    nothing = np.full(count, np.nan)
    status = np.full(count, Status.FRAME_MISSING, np.int8)
    return FramePoints(np.full((count, 2), np.nan), nothing, nothing, status)


def _stack(rows: list[Floats], columns: int) -> Floats:
    return np.concatenate(rows) if rows else np.empty((0, columns))
