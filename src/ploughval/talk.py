"""What a command says while it runs and at its end: messages, exit codes, progress."""

import json
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import typer

DONE, INCOMPLETE, REFUSED, INTERNAL, INTERRUPTED = 0, 1, 2, 3, 130


class Talk:
    """What a command says: text, or one JSON value at its end."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json
        self.summary: dict[str, Any] = {}

    def say(self, text: str) -> None:
        """Print a line, unless JSON is asked for."""
        if not self.as_json:
            typer.echo(text)

    def warn(self, text: str) -> None:
        """Print a line beside the output."""
        typer.echo(text, err=True)

    def close(self, code: int) -> None:
        """Print the JSON value with the exit code, where it is asked for."""
        if self.as_json:
            typer.echo(json.dumps({"exit_code": code, **self.summary}, indent=1, sort_keys=True, default=str))


@contextmanager
def command(as_json: bool = False) -> Iterator[Talk]:
    """Turn what a command raises into its message and exit code: no traceback for what a user can cause."""
    from ploughval.errors import PloughvalError

    talk = Talk(as_json)
    try:
        yield talk
    except PloughvalError as error:
        talk.summary["error"] = str(error)
        talk.warn(f"refused: {error}")
        talk.close(REFUSED)
        raise typer.Exit(REFUSED) from None
    except KeyboardInterrupt:
        talk.warn("interrupted: finished stages are kept; the same command goes on from there")
        raise typer.Exit(INTERRUPTED) from None
    except typer.Exit as stop:
        talk.close(stop.exit_code)
        raise
    except Exception as error:
        logging.getLogger(__name__).debug("internal error", exc_info=True)
        talk.summary["error"] = f"{type(error).__name__}: {error}"
        talk.warn(
            f"internal error: {type(error).__name__}: {error}\n"
            "This is a fault in ploughval: run again as `ploughval --debug ...` and report what it prints."
        )
        talk.close(INTERNAL)
        raise typer.Exit(INTERNAL) from None
    else:
        talk.close(DONE)


@contextmanager
def said_once() -> Iterator[None]:
    """Without the log's warnings on photographs, which the outcome's warnings hold; not with --debug."""
    logger = logging.getLogger("ploughval.photos")
    before = logger.level
    if not logger.isEnabledFor(logging.DEBUG):
        logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(before)


@contextmanager
def shown_progress(talk: Talk) -> Iterator[Callable[[str, int, int], None] | None]:
    """A progress bar on a terminal, plain lines in a log, nothing with --json."""
    if talk.as_json:
        yield None
        return
    if not sys.stderr.isatty():
        yield _plain_lines(talk)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks: dict[str, Any] = {}

        def show(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=total)
            if done == total or total > 1:
                bar.update(tasks[stage], completed=done if total > 1 else bar.tasks[tasks[stage]].total)

        yield show


def _plain_lines(talk: Talk) -> Callable[[str, int, int], None]:
    said: dict[str, int] = {}

    def show(stage: str, done: int, total: int) -> None:
        tenth = 10 * done // total if total else 10
        if tenth > said.get(stage, 0) and (total > 1 or stage not in said):
            said[stage] = tenth
            if total > 1 and tenth % 2 == 0:
                talk.warn(f"{stage}: {done} of {total}")

    return show
