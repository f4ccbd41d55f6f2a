"""The one walk through the photographs: camera, blade, sand, surface, dyed layers and tracked points."""

import time
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.photos import Calibration, FrameSeries
from ploughval.piv import UNMOVED, CameraMovement, FramePoints, Tracker
from ploughval.run.walk.frame_notes import FrameNotes, Noted
from ploughval.run.walk.looks import Look, Looks, Series
from ploughval.run.walk.pieces import Piece, Rows, join, merged
from ploughval.run.walk.window import WindowRecord
from ploughval.scene import Scene, Step
from ploughval.tracers import PointSet, Sight, place_points
from ploughval.watch import Progress, unheard

Floats = NDArray[np.float64]


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
    series = Series(scene, frames, calibration, first)
    return join([walk_piece(series, None, len(frames), workers=workers, progress=progress)])


def walk_piece(
    series: Series,
    state: Mapping[str, Any] | None,
    last: int,
    *,
    workers: int = 1,
    progress: Progress = unheard,
) -> Piece:
    """The walk from a state, None: the beginning, up to a frame (exclusive).

    Pieces joined give the bytes of one walk, wherever they were cut and whatever the workers.

    Raises
    ------
    DataError
        When the first photograph cannot be read.
    """
    return merged(list(Walk(series, workers, state).pieces(last, progress=progress)))


class Walk:
    """A walk through a series of photographs that can be left and gone on with.

    Parameters
    ----------
    series : Series
    workers : int
        Threads; the numbers do not depend on it.
    state : mapping, optional
        Where a walk through the same series stood after a piece; its arrays become this walk's own.

    Raises
    ------
    DataError
        A photograph that the state stands on cannot be read any more.
    KeyError, TypeError, ValueError
        When the state is none of this series.
    """

    def __init__(self, series: Series, workers: int, state: Mapping[str, Any] | None = None) -> None:
        scene = series.scene
        self.frame = 0  # the next one
        self._series, self._workers = series, workers
        self._looks = Looks(series)
        self._looked: dict[str, Any] = {}  # snapshot of the looks after the last frame that was taken in
        self._tracker = Tracker(scene.piv, workers) if Step.TRACKS in scene.steps else None
        self._points: PointSet | None = None
        self._notes = FrameNotes(series.calibration.mm_per_px, series.frames.shape)
        self._found = _Found()
        if state is not None:
            self._restore(state)

    def pieces(
        self, last: int, *, every_s: float = float("inf"), progress: Progress = unheard
    ) -> Iterator[Piece]:
        """Go on up to a frame (exclusive), giving a piece each time that about ``every_s`` have gone by."""
        to_come = range(self.frame, last)
        start = time.monotonic()
        for look in self._looks.ahead(to_come) if self._workers > 1 else self._looks.one_by_one(to_come):
            self._take(look)
            progress("photographs", self.frame, len(self._series.frames))
            if self.frame == last or time.monotonic() - start >= every_s:
                yield self._piece()
                start = time.monotonic()

    def _piece(self) -> Piece:
        rows, self._found = self._found.rows(), _Found()
        return Piece(self.frame - len(rows.blade), self.frame, rows, self._snapshot())

    def _snapshot(self) -> dict[str, Any]:
        dye = self._looks.watcher.dye
        return {
            "frame": self.frame,
            "looks": self._looked,
            "notes": self._notes.snapshot(),
            "points": None if self._points is None else (self._points.px, self._points.layer_mm),
            "tracker": None if self._points is None or self._tracker is None else self._tracker.snapshot(),
            "dye": None if dye is None else dye.snapshot(),
        }

    def _restore(self, state: Mapping[str, Any]) -> None:
        self.frame, self._looked = state["frame"], state["looks"]
        self._looks.restore(self._looked)
        self._notes.restore(state["notes"])
        if state["points"] is not None:
            self._points = PointSet(*state["points"])
        if self._tracker is not None and state["tracker"] is not None:
            begun, frames = self._looks.begun, self._series.frames
            assert begun is not None
            self._tracker.restore(state["tracker"], lambda frame: frames.read(begun + frame))
        dye = self._looks.watcher.dye
        if dye is not None:
            dye.restore(state["dye"])

    def _take(self, look: Look) -> None:
        """Take in a photograph that was looked at."""
        self.frame, self._looked = look.frame + 1, look.after
        found = self._found
        found.once |= look.once
        if look.image is None or look.sight is None:
            found.lost[look.frame] = look.fault
            found.nothing_seen()
            if self._tracker is not None and self._points is not None:
                found.points.append(self._tracker.skip())
            return
        found.camera.append([*look.camera.shift_px, look.camera.std_px])
        found.noted.append(self._notes.add(look.frame, look.sight, look.camera, doubled=look.doubled))
        carried = None
        if self._tracker is not None:
            seen = self._tracked(self._tracker, look)
            found.points.append(seen)
            carried = self._carried(seen, UNMOVED if look.straightened else look.camera)
        found.note(look.frame, self._looks.watcher.follow_dyed(look.sight, carried))

    def _tracked(self, tracker: Tracker, look: Look) -> FramePoints:
        """The points in a photograph; placed in the first one."""
        assert look.sight is not None
        assert look.image is not None
        if self._points is not None:
            return tracker.advance(look.image, look.sight.sand, look.camera)
        sand = look.sight.sand
        self._points = place_points(sand, self._series.calibration, self._series.scene)
        tracker.start(look.image, self._points.px, sand)
        self._found.once |= {"points_px": self._points.px, "layer_mm": self._points.layer_mm}
        return _at_rest(self._points.px)

    def _carried(self, seen: FramePoints, camera: CameraMovement) -> dict[float, Floats]:
        """Where the followed points of each layer stand in the picture that layers are found in, px."""
        assert self._points is not None
        layer = np.where(seen.status == Status.OK, self._points.layer_mm, np.nan)
        heights = np.unique(layer[np.isfinite(layer)]).tolist()
        return {height: camera.now(seen.position_px[layer == height]) for height in heights}


class _Found:
    """What is gathered frame by frame, from the last piece on."""

    def __init__(self) -> None:
        self.blade: list[list[float]] = []
        self.camera: list[list[float]] = []
        self.surface: list[Floats] = []
        self.dyed: list[Floats] = []
        self.points: list[FramePoints] = []
        self.noted: list[Noted] = []
        self.lost: dict[int, str] = {}
        self.unseen: dict[int, list[str]] = {}
        self.once: dict[str, Floats] = {}

    def nothing_seen(self) -> None:
        """A photograph that could not be read."""
        self.blade.append([np.nan] * 2)
        self.camera.append([np.nan] * 3)

    def note(self, frame: int, sight: Sight) -> None:
        """What a photograph shows of blade, surface and dyed layers."""
        self.blade.append([sight.blade_x_mm, sight.blade_std_mm])
        if sight.reasons:
            self.unseen[frame] = list(sight.reasons)
        line = np.column_stack([sight.surface_mm, sight.surface_std_mm])
        self.surface.append(np.column_stack([np.full(len(line), float(frame)), line]))
        for layer, rows in sight.dyed.items():
            head = np.broadcast_to([float(frame), float(layer)], (len(rows), 2))
            self.dyed.append(np.column_stack([head, rows]))

    def rows(self) -> Rows:
        """All of it as arrays."""
        seen = self.points
        return Rows(
            blade=np.array(self.blade, float),
            camera=np.array(self.camera, float),
            surface=np.concatenate([np.empty((0, 4)), *self.surface]),
            dyed=np.concatenate([np.empty((0, 5)), *self.dyed]),
            position_px=np.stack([s.position_px for s in seen]) if seen else np.empty((0, 0, 2)),
            point_std_px=np.stack([s.std_px for s in seen]) if seen else np.empty((0, 0)),
            zncc=np.stack([s.zncc for s in seen]) if seen else np.empty((0, 0)),
            status=np.stack([s.status for s in seen]) if seen else np.empty((0, 0), np.int8),
            lost=self.lost,
            unseen=self.unseen,
            noted=tuple(self.noted),
            once=self.once,
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
