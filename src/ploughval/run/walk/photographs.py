"""The stage of the photographs: the walk through them, from where an earlier run came to."""

import logging
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import pandas as pd

from ploughval.errors import DataError, PloughvalError
from ploughval.loadcells import measure_force
from ploughval.photos import Calibration, FrameSeries, calibrate, open_frames
from ploughval.run import provenance
from ploughval.run.kept import store
from ploughval.run.kept.lock import locked
from ploughval.run.kept.snapshots import to_arrays
from ploughval.run.kept.stages import STATE, window_key
from ploughval.run.walk.first_frame import first_frame
from ploughval.run.walk.looks import Series
from ploughval.run.walk.pieces import Piece, join, merged, state_of
from ploughval.run.walk.walk import Walk
from ploughval.run.walk.window import WindowRecord
from ploughval.scene import Scene, Step, load_scene
from ploughval.watch import Progress, unheard

Value = TypeVar("Value")
log = logging.getLogger(__name__)

EVERY_S = 10.0
"""Seconds of work after which a piece of the walk is kept."""
_STAGE = "walk"


@dataclass(frozen=True, slots=True)
class Photographs:
    """The photographs of one test, opened and calibrated.

    Attributes
    ----------
    scene : Scene
    frames : FrameSeries
    calibration : Calibration
    input_digests : mapping of str to str
        SHA-256 of every input file, by its path relative to the test folder.
    """

    scene: Scene
    frames: FrameSeries
    calibration: Calibration
    input_digests: Mapping[str, str]

    def window(
        self, kept: store.Store, first: int, *, workers: int = 1, progress: Progress = unheard
    ) -> WindowRecord:
        """The walk from frame ``first``, which shows the sand at rest; kept under the key of what it needs.

        Raises
        ------
        DataError
            Frame ``first`` cannot be read.
        """
        key = self.key(first)
        arrays, shelf = kept.load("window", key), _Shelf(kept, key)
        if arrays is not None:
            shelf.clear()  # a run that was killed had no time to
            return WindowRecord.from_arrays(arrays)
        done, rest = self._walk(shelf, first, len(self.frames), workers, progress)
        record = join([*done, *rest])
        if kept.save("window", key, record.to_arrays()):
            shelf.clear()
        return record

    def walk_to(
        self, kept: store.Store, first: int, frame: int, *, workers: int = 1, progress: Progress = unheard
    ) -> int:
        """Go on with the walk up to a frame (exclusive) and keep it; returns the frame that it has come to.

        Raises
        ------
        DataError
            Frame ``first`` cannot be read, or what was walked cannot be kept.
        """
        key, reached = self.key(first), len(self.frames)
        if frame >= reached or kept.load("window", key) is not None:
            self.window(kept, first, workers=workers, progress=progress)
        else:
            shelf = _Shelf(kept, key)
            done, rest = self._walk(shelf, first, frame, workers, progress)
            for piece in rest:
                shelf.keep(piece)
            reached = [*done, *rest][-1].last
        if kept.refused:
            raise DataError(kept.refused[0])
        return reached

    def key(self, first: int) -> store.Key:
        """Key of all that the walk through the photographs depends on."""
        return window_key(self.scene, self.input_digests, first)

    def _walk(
        self, shelf: "_Shelf", first: int, last: int, workers: int, progress: Progress
    ) -> tuple[list[Piece], list[Piece]]:
        """Pieces up to a frame (exclusive) or beyond: those that are kept, and one that is not, or none."""
        done = shelf.load()
        if done and done[-1].last >= last:
            return done, []
        walk = self._resumed(shelf, done, first, workers)
        rest: list[Piece] = []
        for piece in walk.pieces(last, every_s=EVERY_S, progress=progress):
            rest = [merged([*rest, piece])]
            if piece.last < last and shelf.keep(rest[0]):
                done.append(rest.pop().without_state())
        return done, rest

    def _resumed(self, shelf: "_Shelf", done: list[Piece], first: int, workers: int) -> Walk:
        """A walk from the last piece; where that does not serve ``done`` is emptied, and it begins anew."""
        series = Series(self.scene, self.frames, self.calibration, first)
        if done:
            try:
                return Walk(series, workers, done[-1].state)
            except (DataError, KeyError, TypeError, ValueError) as error:
                log.warning("frame %d: the walk cannot go on from here: %s", done[-1].last, error)
                shelf.refuse()
                done.clear()
        return Walk(series, workers)


class _Shelf:
    """Pieces of a walk in the store, each under its first frame's number, and the state after the newest.

    The state is replaced after its piece is kept: a run that dies in between goes on from the older one.
    """

    def __init__(self, kept: store.Store, key: store.Key) -> None:
        self._kept, self._key = kept, key

    def load(self) -> list[Piece]:
        """The pieces that lead from frame 0 to the state that is kept, the last one with it; or none."""
        state = self._read(STATE, state_of)
        pieces: list[Piece] = []
        while state is not None:
            reached = pieces[-1].last if pieces else 0
            if reached == state["frame"]:
                return [*pieces[:-1], replace(pieces[-1], state=state)]
            piece = self._read(f"{_STAGE}-{reached:06d}", Piece.from_arrays)
            if piece is None or not reached == piece.first < piece.last:
                break
            pieces.append(piece)
        self.refuse()
        return []

    def keep(self, piece: Piece) -> bool:
        """Keep a piece; whether the disk took it, of which it is said once that it did not."""
        refused = self._kept.refused
        rows = piece.without_state().to_arrays()
        taken = self._kept.save(f"{_STAGE}-{piece.first:06d}", self._key, rows)
        taken = taken and self._kept.save(STATE, self._key, to_arrays(piece.state))
        if not taken and any(text.startswith(_STAGE) for text in refused[:-1]):
            refused.pop()
        return taken

    def refuse(self) -> None:
        """Say that the walk does not go on from what is kept."""
        if STATE in self._kept.told and self._kept.told[STATE][0]:
            self._kept.refuse(STATE)

    def clear(self) -> None:
        """Remove all of it: the walk is whole."""
        for stage in (STATE, _STAGE):
            self._kept.drop(stage)

    def _read(self, stage: str, read: Callable[[store.Arrays], Value]) -> Value | None:
        """What is kept under a name; None where there is none, or it cannot be read."""
        arrays = self._kept.load(stage, self._key)
        with suppress(ValueError):
            return None if arrays is None else read(arrays)
        return None


def walk_to(
    folder: Path | str,
    *,
    out: Path | str | None = None,
    frame: int,
    workers: int = 1,
    progress: Progress = unheard,
) -> tuple[int, int]:
    """Walk the photographs of a test up to a frame, going on from what its result folder holds.

    What follows, here or on another machine that has the result folder, goes on from there, and ends with
    the bytes of one walk.

    Parameters
    ----------
    folder : path-like
        Test folder with a test.toml.
    out : path-like or None
        Result folder; None: ``results`` in the test folder.
    frame : int
        The walk comes to its end before this one.
    workers : int
        Threads; numbers do not depend on it.
    progress : callable
        Called with (stage, done, total) after each photograph.

    Returns
    -------
    (int, int)
        The frame that the walk has come to, and their number; (0, 0) without photographs.

    Raises
    ------
    PloughvalError
        When the input is refused, another run holds the result folder, or nothing can be written there.
    """
    scene = load_scene(folder)
    if Step.CALIBRATION not in scene.steps:
        return 0, 0
    results = Path(out) if out is not None else scene.folder / "results"
    with locked(results):
        frames = open_frames(scene)
        opened = Photographs(scene, frames, calibrate(scene, frames), provenance.input_digests(scene))
        first = first_frame(scene, frames, opened.calibration.mm_per_px, lambda: _record(scene))
        kept = store.Store(results)
        return opened.walk_to(kept, first, frame, workers=workers, progress=progress), len(frames)


def _record(scene: Scene) -> pd.DataFrame | None:
    """The load cells' record, or None."""
    if Step.FORCE not in scene.steps:
        return None
    try:
        return measure_force(scene).record
    except PloughvalError:
        return None
