"""Bars of the stages that go on, with the time left; drawn by rich on the error stream."""

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TaskID
from rich.table import Column
from rich.text import Text

from ploughval.progress import Pace, Stage, Stages, duration

WIDE, MIDDLE = 60, 40  # columns of a terminal below which the bar, and then the counts, are left out
REFRESH_HZ = 5
KEPT_FREE = 4  # lines of a terminal for messages and the prompt


class _Label(ProgressColumn):
    """The stage's name: a text, whatever brackets it has."""

    def render(self, task: Task) -> Text:
        return Text(task.description, no_wrap=True, overflow="ellipsis")


class _Count(ProgressColumn):
    """Steps done of all, where there are several."""

    def render(self, task: Task) -> Text:
        pace: Pace = task.fields["pace"]
        return Text(f"{pace.done} of {pace.total}" if pace.total > 1 else "", style="progress.download")


class _Left(ProgressColumn):
    """The time left, counted down between steps; the time gone where that cannot be told."""

    def render(self, task: Task) -> Text:
        pace: Pace = task.fields["pace"]
        now = time.monotonic()
        left = pace.left_s(now)
        text = f"{duration(now - pace.begun_s)} gone" if left is None else f"{duration(left)} left"
        return Text(text, style="progress.remaining", no_wrap=True)


def _columns(width: int) -> list[ProgressColumn]:
    label = _Label(table_column=Column(no_wrap=True, overflow="ellipsis", ratio=1))
    kept: list[ProgressColumn] = [label]
    if width >= WIDE:
        kept.append(BarColumn(bar_width=max(10, min(40, width - 50))))
    if width >= MIDDLE:
        kept.append(_Count(table_column=Column(no_wrap=True, justify="right")))
    return [*kept, _Left(table_column=Column(no_wrap=True, justify="right", min_width=min(14, width // 2)))]


class Bars(Stages):
    """One bar for every stage that goes on, the oldest first, as many as the terminal has lines for."""

    def __init__(self, progress: Progress) -> None:
        super().__init__(time.monotonic)
        self._progress = progress
        self._tasks: dict[Stage, TaskID] = {}
        self._most = max(progress.console.height - KEPT_FREE, 2)

    def say(self, text: str) -> None:
        """Write a line above the bars."""
        self._progress.console.print(Text(text), soft_wrap=True)

    def _begun(self, stage: Stage, pace: Pace) -> None:
        visible = len(self._tasks) < self._most
        self._tasks[stage] = self._progress.add_task(
            str(stage), total=_counted(pace), pace=pace, visible=visible
        )

    def _went(self, stage: Stage, pace: Pace, now_s: float) -> None:
        self._progress.update(self._tasks[stage], completed=pace.done, total=_counted(pace))

    def _ended(self, stage: Stage, pace: Pace, now_s: float) -> None:
        self._progress.remove_task(self._tasks.pop(stage))
        for shown in list(self._tasks.values())[: self._most]:
            self._progress.update(shown, visible=True)


def _counted(pace: Pace) -> int | None:
    """Total of a bar; None, a bar that only moves, where a stage is one step."""
    return pace.total if pace.total > 1 else None


@contextmanager
def drawn() -> Iterator[Bars]:
    """Bars while the block runs; lines of the log and of the command are written above them."""
    console = Console(stderr=True)
    progress = Progress(
        *_columns(console.width),
        console=console,
        transient=True,
        expand=True,
        refresh_per_second=REFRESH_HZ,
        redirect_stdout=sys.stdout.isatty(),  # else it goes where it was sent, and cannot spoil the bars
    )
    with progress, _log_above():
        yield Bars(progress)


@contextmanager
def _log_above() -> Iterator[None]:
    """Let the log's handlers, which hold the bare error stream, write above the bars."""
    moved: list[tuple[Any, Any]] = []
    for handler in logging.getLogger().handlers:
        if isinstance(handler, logging.StreamHandler) and handler.stream in (sys.__stderr__, sys.__stdout__):
            moved.append((handler, handler.stream))
            handler.setStream(sys.stderr)
    try:
        yield
    finally:
        for handler, stream in moved:
            handler.setStream(stream)
