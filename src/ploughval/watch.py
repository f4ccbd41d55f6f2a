"""Who hears how far a long work has come: any callable of (stage, done, total)."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[str, int, int], None]


def unheard(stage: str, done: int, total: int) -> None:
    """Nobody: what a work tells where no one listens."""


@contextmanager
def one_step(progress: Progress, stage: str) -> Iterator[None]:
    """Tell of a stage that is a single step: its beginning and its end, whatever becomes of it.

    >>> with one_step(print, "model"):
    ...     print("at work")
    model 0 1
    at work
    model 1 1
    """
    progress(stage, 0, 1)
    try:
        yield
    finally:
        progress(stage, 1, 1)
