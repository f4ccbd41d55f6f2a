"""The one walk through the photographs: blade, sand, surface, dyed layers and tracked points."""

import json
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.errors import DataError
from ploughval.photos import Calibration, FrameSeries
from ploughval.piv import FramePoints, Tracker
from ploughval.scene import Scene, Step
from ploughval.tracers import PointSet, Sight, Watcher, place_points

Floats = NDArray[np.float64]
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class WindowRecord:
    """What the photographs show, frame by frame; F frames, N tracked points."""

    blade: Floats  # (F, 2) blade face x and its std, mm
    surface: Floats  # (K, 4) frame, x, y, std, mm
    dyed: Floats  # (K, 5) frame, layer, x, y, std, mm; NaN x at gaps
    points_px: Floats  # (N, 2) points in frame 0
    layer_mm: Floats  # (N,) initial height of the layer that a point belongs to, NaN for the grid
    position_px: Floats  # (F, N, 2)
    point_std_px: Floats  # (F, N)
    zncc: Floats  # (F, N)
    status: NDArray[np.int8]  # (F, N)
    lost_frames: dict[int, str]  # frame -> reason

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The record as named arrays for the store; texts as JSON in an array of characters."""
        arrays = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "lost_frames"}
        return {**arrays, "lost_frames": np.array(json.dumps(self.lost_frames))}

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray[np.generic]]) -> "WindowRecord":
        """The record from :meth:`to_arrays`; KeyError when an array is missing."""
        lost = {int(k): str(v) for k, v in json.loads(str(arrays["lost_frames"])).items()}
        values = {f.name: arrays[f.name] for f in fields(cls) if f.name != "lost_frames"}
        return cls(lost_frames=lost, **values)  # type: ignore[arg-type]


def watch(
    scene: Scene,
    frames: FrameSeries,
    calibration: Calibration,
    *,
    workers: int = 1,
    progress: Progress | None = None,
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
    workers : int
        Threads of the correlation; the numbers do not depend on it.
    progress : callable or None
        Called with (stage, done, total) after each frame.

    Returns
    -------
    WindowRecord
        Frames that could not be read are NaN and named in ``lost_frames``.

    Raises
    ------
    DataError
        When no photograph can be read at all, or the first one cannot.
    """
    walk = _Walk(scene, calibration, len(frames), workers)
    for frame in range(len(frames)):
        try:
            image = frames.read(frame)
        except DataError as error:
            if frame == 0:
                raise
            walk.lose(frame, str(error))
        else:
            walk.take(frame, image)
        if progress is not None:
            progress("photographs", frame + 1, len(frames))
    return walk.record()


class _Walk:
    """State of the walk: watcher, tracker and the lists that grow frame by frame."""

    def __init__(self, scene: Scene, calibration: Calibration, count: int, workers: int) -> None:
        self._scene, self._calibration = scene, calibration
        self._watcher = Watcher(scene, calibration)
        self._tracker = Tracker(scene.piv, workers) if Step.TRACKS in scene.steps else None
        self._points = PointSet(px=np.empty((0, 2)), layer_mm=np.empty(0))
        self._blade = np.full((count, 2), np.nan)
        self._surface: list[Floats] = []
        self._dyed: list[Floats] = []
        self._seen: list[FramePoints] = []
        self._lost: dict[int, str] = {}

    def take(self, frame: int, image: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
        sight = self._watcher.see(frame, image)
        self._note(frame, sight)
        if self._tracker is None:
            return
        if frame == 0:
            self._points = place_points(sight.sand, self._calibration, self._scene)
            self._tracker.start(image, self._points.px, sight.sand)
            self._seen.append(_at_rest(self._points.px))
        else:
            self._seen.append(self._tracker.advance(image, sight.sand))

    def lose(self, frame: int, reason: str) -> None:
        self._lost[frame] = reason
        if self._tracker is not None:
            self._seen.append(self._tracker.skip())

    def _note(self, frame: int, sight: Sight) -> None:
        self._blade[frame] = sight.blade_x_mm, sight.blade_std_mm
        line = np.column_stack([sight.surface_mm, sight.surface_std_mm])
        self._surface.append(np.column_stack([np.full(len(line), float(frame)), line]))
        for layer, rows in sight.dyed.items():
            head = np.broadcast_to([float(frame), float(layer)], (len(rows), 2))
            self._dyed.append(np.column_stack([head, rows]))

    def record(self) -> WindowRecord:
        count, points = len(self._blade), len(self._points.px)
        tracked = bool(self._seen)
        return WindowRecord(
            blade=self._blade,
            surface=_stack(self._surface, 4),
            dyed=_stack(self._dyed, 5),
            points_px=self._points.px,
            layer_mm=self._points.layer_mm,
            position_px=np.stack([s.position_px for s in self._seen])
            if tracked
            else np.empty((count, points, 2)),
            point_std_px=np.stack([s.std_px for s in self._seen]) if tracked else np.empty((count, points)),
            zncc=np.stack([s.zncc for s in self._seen]) if tracked else np.empty((count, points)),
            status=np.stack([s.status for s in self._seen]).astype(np.int8)
            if tracked
            else np.empty((count, points), np.int8),
            lost_frames=self._lost,
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


def _stack(rows: list[Floats], columns: int) -> Floats:
    return np.concatenate(rows) if rows else np.empty((0, columns))
