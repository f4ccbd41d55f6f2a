"""One test in ranges of frames: each range is kept where the next machine finds it, then all is processed."""

import tempfile
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ploughval.errors import PloughvalError
from ploughval.run.kept.lock import locked
from ploughval.run.kept.store import CACHE, Store
from ploughval.run.outcome import Outcome
from ploughval.run.remote.staging import Staged
from ploughval.watch import Progress, one_step, unheard

Job = Callable[..., Outcome]


@dataclass(frozen=True, slots=True)
class Pace:
    """How long a range of frames is.

    Attributes
    ----------
    first_frames : int
        Frames of the first range, from which the time of a frame is known; no later one has fewer.
    piece_s : float
        Time that a later range is to take, s.
    """

    first_frames: int = 10
    piece_s: float = 60.0

    def after(self, reached: "Reached") -> int:
        """The frame at which the next range ends, exclusive.

        >>> Pace().after(Reached(10, 0, 20.0, 60)), Pace().after(Reached(10, 10, 1.0, 60))
        (40, 20)
        """
        walked = reached.frame - reached.begun
        count = self.piece_s * walked / max(reached.seconds, 1e-3)
        return reached.frame + max(self.first_frames, round(min(count, 1e6)))


@dataclass(frozen=True, slots=True)
class Reached:
    """Where the walk through a test's photographs has come to.

    Attributes
    ----------
    frame : int
        The next frame.
    begun : int
        The frame at which this range began.
    seconds : float
        What the range took.
    frames : int
        Frames in all.
    """

    frame: int
    begun: int
    seconds: float
    frames: int


class _Heard:
    """Passes stages on, and remembers at which frame a walk began."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self.begun: int | None = None

    def __call__(self, stage: str, done: int, total: int) -> None:
        if stage == "photographs" and self.begun is None:
            self.begun = max(done - 1, 0)
        self._progress(stage, done, total)


def advance(
    job: Job, staged: Staged, frame: int, *, workers: int, fresh: bool = False, progress: Progress = unheard
) -> Reached | Outcome:
    """Walk a test's photographs up to a frame and keep that; process the test when that is their end.

    Parameters
    ----------
    job : callable
        ``job(folder, out=, workers=, progress=)`` gives the outcome of a test.
    staged : Staged
        The test.
    frame : int
        The walk comes to its end before this one.
    workers : int
        Threads; numbers do not depend on it.
    fresh : bool
        Forget first what earlier runs kept.
    progress : callable
        Hears of stages.

    Raises
    ------
    PloughvalError
        When the input is refused; it names places as they were given.
    """
    from ploughval.run.walk.photographs import walk_to

    start, heard = time.perf_counter(), _Heard(progress)
    with staged.named():
        with _told(staged, progress, "fetch"):
            staged.bring(fresh=fresh)
        if fresh and (staged.out / CACHE).is_dir():
            with locked(staged.out):
                Store(staged.out, fresh=True).clean()
        try:
            reached, total = walk_to(
                staged.folder, out=staged.out, frame=frame, workers=workers, progress=heard
            )
            walked = reached >= total
            outcome = (
                job(staged.folder, out=staged.out, workers=workers, progress=progress) if walked else None
            )
        except BaseException:
            with suppress(PloughvalError):  # the first error is the one to tell
                staged.keep()
            raise
        if outcome is None:
            staged.keep()
            begun = reached if heard.begun is None else heard.begun
            return Reached(reached, begun, time.perf_counter() - start, total)
        with _told(staged, progress, "put back"):
            return staged.deliver(outcome)


def _told(staged: Staged, progress: Progress, stage: str) -> AbstractContextManager[None]:
    return one_step(progress, stage) if staged.is_remote else nullcontext()


def run_staged(
    job: Job,
    folder: Path | str,
    *,
    out: Path | str | None,
    workers: int = 1,
    fresh: bool = False,
    progress: Progress = unheard,
    pace: Pace | None = None,
) -> Outcome:
    """Process a test of which folder or results are behind a URL, on this machine.

    Raises
    ------
    PloughvalError
        As of :func:`advance`.
    """
    pace = pace or Pace()
    with tempfile.TemporaryDirectory(prefix="ploughval-", ignore_cleanup_errors=True) as scratch:
        staged = Staged(folder, out, Path(scratch))
        options: dict[str, Any] = {"workers": workers, "progress": progress}
        answer = advance(job, staged, pace.first_frames, fresh=fresh, **options)
        while isinstance(answer, Reached):
            answer = advance(job, staged, pace.after(answer), **options)
        return answer
