"""Progress of a command by stages, with the time left: a few lines in a log, JSON lines for machines."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Clock = Callable[[], float]
LEAST_WEIGHT = 0.1  # of the newest step in the mean time of a step
LEAST_STEPS = 2  # before a time left is named
LEAST_PAUSE_S = 1.0  # between two lines of a stage
LEAST_AMONG_S = 10.0  # the same for a stage of one test among several
TENTHS = 10


class Pace:
    """How fast a stage goes: the mean time of its last ten or so steps, the first of all left out.

    Parameters
    ----------
    total : int
        Steps in all.
    now_s : float
        The clock at the beginning, s.
    """

    def __init__(self, total: int, now_s: float) -> None:
        self.total, self.done = total, 0
        self.begun_s = self._last_s = now_s
        self._step_s = 0.0
        self._first = 0  # steps done when the first was told: it compiled and opened what the others use

    def step(self, done: int, total: int, now_s: float) -> None:
        """Note that so many steps are done."""
        self.total = total
        if done <= self.done:
            return
        taken = (now_s - self._last_s) / (done - self.done)
        weight = max((done - self.done) / (done - self._first), LEAST_WEIGHT)
        self._step_s += weight * (taken - self._step_s)
        self._first = self._first or done
        self.done, self._last_s = done, now_s

    def left_s(self, now_s: float) -> float | None:
        """Seconds left; None where too little is done to tell.

        >>> pace = Pace(10, 0.0)
        >>> for done in range(1, 6):
        ...     pace.step(done, 10, 2.0 * done)
        >>> pace.left_s(10.0), pace.left_s(11.0)
        (10.0, 9.0)
        """
        if self.done < min(LEAST_STEPS, self.total - 1) or self.done == 0:
            return None
        left = self._step_s * (self.total - self.done) - (now_s - self._last_s)
        return max(left, 0.0)


def duration(seconds: float) -> str:
    """A time for people.

    >>> duration(4.23), duration(42.4), duration(125), duration(4320)
    ('4.2 s', '42 s', '2 min 5 s', '1 h 12 min')
    """
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


@dataclass(frozen=True, slots=True)
class Stage:
    """A stage of a command, of one test where it has several."""

    test: str
    name: str

    def __str__(self) -> str:
        """One printable line, whatever the test is called."""
        text = f"{self.test}: {self.name}" if self.test else self.name
        return "".join(sign if sign.isprintable() else "?" for sign in text)


class Stages(ABC):
    """Hears of stages as (name, done, total) and shows them; what is shown where is a subclass's.

    A stage begins when it is first heard of, or heard of again from the start, and ends when all is done.
    """

    def __init__(self, clock: Clock = time.monotonic) -> None:
        self._clock = clock
        self._going: dict[Stage, Pace] = {}
        self._over: set[Stage] = set()

    def __call__(self, name: str, done: int, total: int, *, test: str = "") -> None:
        """Note the state of a stage."""
        stage, now = Stage(test, name), self._clock()
        total = max(total, 1)
        if stage not in self._going:
            if done >= total and stage in self._over:
                return
            self._over.discard(stage)
            self._going[stage] = Pace(total, now)
            self._begun(stage, self._going[stage])
        pace = self._going[stage]
        pace.step(done, total, now)
        if done >= total:
            del self._going[stage]
            self._over.add(stage)
            self._ended(stage, pace, now)
        elif done:
            self._went(stage, pace, now)

    def of(self, test: str) -> Callable[[str, int, int], None]:
        """The same for the stages of one test among several."""
        return lambda name, done, total: self(name, done, total, test=test)

    @abstractmethod
    def _begun(self, stage: Stage, pace: Pace) -> None: ...

    @abstractmethod
    def _went(self, stage: Stage, pace: Pace, now_s: float) -> None: ...

    @abstractmethod
    def _ended(self, stage: Stage, pace: Pace, now_s: float) -> None: ...


class _Tenths(Stages):
    """Tells of a stage at its beginning, at most at every tenth and once a second, and at its end."""

    def __init__(self, clock: Clock = time.monotonic) -> None:
        super().__init__(clock)
        self._told: dict[Stage, tuple[int, float]] = {}

    def _begun(self, stage: Stage, pace: Pace) -> None:
        self._told[stage] = (0, pace.begun_s)
        self._tell(stage, pace, pace.begun_s)

    def _went(self, stage: Stage, pace: Pace, now_s: float) -> None:
        tenth = TENTHS * pace.done // pace.total
        before, then_s = self._told[stage]
        if tenth > before and now_s - then_s >= self._pause_s(stage):
            self._told[stage] = (tenth, now_s)
            self._tell(stage, pace, now_s)

    def _ended(self, stage: Stage, pace: Pace, now_s: float) -> None:
        del self._told[stage]
        self._tell(stage, pace, now_s)

    def _pause_s(self, stage: Stage) -> float:
        return LEAST_PAUSE_S

    @abstractmethod
    def _tell(self, stage: Stage, pace: Pace, now_s: float) -> None: ...


class Lines(_Tenths):
    """Plain lines for a log; of one test among several only what takes long.

    Parameters
    ----------
    write : callable
        Takes a line without its end.
    """

    def __init__(self, write: Callable[[str], None], clock: Clock = time.monotonic) -> None:
        super().__init__(clock)
        self._write = write

    def _pause_s(self, stage: Stage) -> float:
        return LEAST_AMONG_S if stage.test else LEAST_PAUSE_S

    def _tell(self, stage: Stage, pace: Pace, now_s: float) -> None:
        seconds = now_s - pace.begun_s
        if stage.test and seconds < LEAST_AMONG_S:
            return
        if not pace.done:
            self._write(f"{stage}: begun")
        elif pace.done < pace.total:
            left = pace.left_s(now_s)
            after = "" if left is None else f", {duration(left)} left"
            self._write(f"{stage}: {pace.done} of {pace.total}{after}")
        elif pace.total > 1 or seconds >= self._pause_s(stage):
            self._write(f"{stage}: took {duration(seconds)}")


class Events(_Tenths):
    """Mappings for machines; see docs/command-line.md for the keys.

    Parameters
    ----------
    send : callable
        Takes one mapping that JSON can hold.
    """

    def __init__(self, send: Callable[[dict[str, Any]], None], clock: Clock = time.monotonic) -> None:
        super().__init__(clock)
        self._send = send

    def _tell(self, stage: Stage, pace: Pace, now_s: float) -> None:
        left = 0.0 if pace.done >= pace.total else pace.left_s(now_s)
        self._send(
            {
                "event": "progress",
                "test": stage.test or None,
                "stage": stage.name,
                "done": pace.done,
                "total": pace.total,
                "seconds": round(now_s - pace.begun_s, 2),
                "seconds_left": None if left is None else round(left, 1),
            }
        )
