"""What a command says while it runs and at its end: messages, exit codes, progress, JSON."""

import io
import json
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, redirect_stdout
from typing import Any

import typer
from typer.core import TyperGroup

from ploughval.progress import Events, Lines, Stages
from ploughval.quiet import hushed
from ploughval.refusals import refusal_of
from ploughval.stopping import Stopped

DONE, INCOMPLETE, REFUSED, INTERNAL, INTERRUPTED = 0, 1, 2, 3, 130


class Talk:
    """What a command says: text, or JSON: one value at its end, lines of it on the error stream meanwhile."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json
        self.summary: dict[str, Any] = {}
        self.above: Callable[[str], None] | None = None  # writes above bars, while there are any

    def say(self, text: str) -> None:
        """Print a line, unless JSON is asked for."""
        if self.above is not None and sys.stdout.isatty():
            self.above(text)
        elif not self.as_json:
            typer.echo(text)

    def warn(self, text: str) -> None:
        """Print a line beside the output."""
        if self.as_json:
            self.send({"event": "message", "text": text})
        elif self.above is not None:
            self.above(text)
        else:
            typer.echo(text, err=True)

    def send(self, event: dict[str, Any]) -> None:
        """Print a mapping as a JSON line beside the output."""
        typer.echo(json.dumps(event, default=str), err=True)

    def close(self, code: int) -> None:
        """Print the JSON value with the exit code, where it is asked for."""
        if self.as_json:
            typer.echo(json.dumps({"exit_code": code, **self.summary}, indent=1, sort_keys=True, default=str))

    def fail(self, code: int, message: str) -> typer.Exit:
        """Say what went wrong, close, and return what ends the command."""
        self.warn(message)
        self.close(code)
        return typer.Exit(code)


@contextmanager
def command(as_json: bool = False) -> Iterator[Talk]:
    """Turn what a command raises into its message and exit code: no traceback for what a user can cause."""
    talk = Talk(as_json)
    with _log_as_json() if as_json else nullcontext(), _answers(talk):
        yield talk


@contextmanager
def _answers(talk: Talk) -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt as stop:
        by, code = (stop.by, stop.code) if isinstance(stop, Stopped) else ("", INTERRUPTED)
        kept = f"interrupted{by}: what is finished is kept; the same command goes on from there"
        talk.summary["error"] = kept
        raise talk.fail(code, kept) from None
    except typer.Exit as stop:
        talk.close(stop.exit_code)
        raise
    except BrokenPipeError:  # whoever read the output has gone: the frame of the command line ends quietly
        raise
    except Exception as error:
        refused = refusal_of(error)
        if refused is not None:
            talk.summary["error"] = refused
            raise talk.fail(REFUSED, f"refused: {refused}") from None
        logging.getLogger(__name__).debug("internal error", exc_info=True)
        talk.summary["error"] = f"{type(error).__name__}: {error}"
        message = (
            f"internal error: {type(error).__name__}: {error}\n"
            "This is a fault in ploughval: run again as `ploughval --debug ...` and report what it prints."
        )
        raise talk.fail(INTERNAL, message) from None
    else:
        talk.close(DONE)


class Verbs(TyperGroup):
    """The commands; one that is called wrongly answers as JSON too, where that is asked for."""

    def main(self, *args: Any, **options: Any) -> Any:
        """Run a command line and leave with its exit code."""
        line = args[0] if args else options.get("args")
        if "--json" not in (sys.argv[1:] if line is None else line):
            try:
                return super().main(*args, **options)
            except OSError as error:  # the help, on an output that is full
                typer.echo(f"refused: {refusal_of(error) or error}", err=True)
                sys.exit(REFUSED)
        try:
            code = super().main(*args, **options | {"standalone_mode": False})
        except Exception as error:
            if not hasattr(error, "format_message"):  # not one of the command line's own
                raise
            talk = Talk(as_json=True)
            talk.summary["error"] = error.format_message()
            talk.fail(REFUSED, error.format_message())
            code = REFUSED
        sys.exit(code or DONE)


class _JsonFormatter(logging.Formatter):
    """A line of the log as a JSON line."""

    def format(self, record: logging.LogRecord) -> str:
        text = record.getMessage()
        if record.exc_info:
            text = f"{text}\n{self.formatException(record.exc_info)}"
        event = {"event": "log", "level": record.levelname.lower(), "logger": record.name, "text": text}
        return json.dumps(event)


class _Heard(io.TextIOBase):
    """Takes what is printed, line by line, to a talk."""

    def __init__(self, talk: Talk) -> None:
        self._talk, self._rest = talk, ""

    def write(self, text: str) -> int:
        *lines, self._rest = (self._rest + text).split("\n")
        for line in filter(str.strip, lines):
            self._talk.warn(line)
        return len(text)

    def end(self) -> None:
        """Take what has no end of line."""
        if self._rest:
            self.write("\n")


@contextmanager
def _log_as_json() -> Iterator[None]:
    """The log, and warnings of Python with it, as JSON lines."""
    before = [(handler, handler.formatter) for handler in logging.getLogger().handlers]
    for handler, _ in before:
        handler.setFormatter(_JsonFormatter())
    logging.captureWarnings(True)
    try:
        yield
    finally:
        logging.captureWarnings(False)
        for handler, formatter in before:
            handler.setFormatter(formatter)


@contextmanager
def printed_aside(talk: Talk) -> Iterator[None]:
    """With JSON, what scripts print goes beside the output, which the JSON value has for itself."""
    if not talk.as_json:
        yield
        return
    heard = _Heard(talk)
    try:
        with redirect_stdout(heard):
            yield
    finally:
        heard.end()


def said_once() -> AbstractContextManager[None]:
    """Without the log's warnings on photographs, which the outcome's warnings hold; not with --debug."""
    return hushed("ploughval.photos", logging.ERROR)


@contextmanager
def shown_progress(talk: Talk) -> Iterator[Stages]:
    """Bars on a terminal, plain lines in a log, JSON lines with --json."""
    if talk.as_json:
        yield Events(talk.send)
    elif _can_draw():
        from ploughval.progress_bars import drawn

        with drawn() as drawing:
            talk.above = drawing.say
            try:
                yield drawing
            finally:
                talk.above = None
    else:
        yield Lines(talk.warn)


def _can_draw() -> bool:
    """Whether the error stream is a terminal that can move its cursor."""
    if sys.stderr is None or not sys.stderr.isatty():
        return False
    from rich.console import Console

    console = Console(stderr=True)
    return console.is_terminal and not console.is_dumb_terminal
