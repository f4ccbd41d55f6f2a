"""What the command line says of processed tests: lines, exit codes, a table at the end, JSON."""

import textwrap
import time
from collections import Counter
from collections.abc import Sequence
from typing import Any

from ploughval.progress import Stages, duration
from ploughval.refusals import refusal_of
from ploughval.run.many.answers import ElsewhereError, LostError
from ploughval.run.many.places import folder_of
from ploughval.run.urls import last_name, shown
from ploughval.talk import DONE, INCOMPLETE, INTERNAL, REFUSED, Talk
from ploughval.watch import Progress

LOST = "lost"
WORDS = {DONE: "done", INCOMPLETE: "incomplete", REFUSED: "refused", INTERNAL: "internal error"}
MOST_SAID = 120
"""Signs of an error that stand in the table; the whole was said when the test ended."""
HEAD = ("test", "what became of it", "took", "metrics agree", "report")


def outcome_row(talk: Talk, folder: str, result: Any, *, name: str = "") -> tuple[int, dict[str, Any]]:
    """Say what became of one test.

    Parameters
    ----------
    talk : Talk
        Who says it.
    folder : str
        The test folder.
    result : Outcome or Exception
        What processing it returned or raised.
    name : str
        What the test is called among several, whose work an internal error must not stop; empty: it is the
        only one.

    Returns
    -------
    code : int
        Exit code of this test.
    row : dict
        Its row of the JSON summary.
    """
    if isinstance(result, Exception):
        code, ending, error = _failure(folder, result, several=bool(name))
        talk.warn(error if code == INTERNAL else f"refused: {error}")
        return code, {"folder": shown(folder), "exit_code": code, "ending": ending, "error": error}
    code = DONE if result.complete else INCOMPLETE
    called = name or result.name
    for fault in result.faults:
        talk.warn(f"{called}: {fault}")
    for warning in result.warnings:
        talk.warn(f"{called}: warning: {warning}")
    say = talk.warn if name else talk.say  # of several, the output tells of all together at the end
    if result.reused:
        say(f"{called}: reused: {', '.join(result.reused)}")
    say(f"{called}: {'done' if code == DONE else 'done, incomplete'} in {result.seconds:.1f} s")
    if not name:
        talk.say(f"report: {result.report}")
    return code, {
        "folder": shown(folder),
        "exit_code": code,
        "ending": WORDS[code],
        "test": result.name,
        "results": str(result.results),
        "report": str(result.report),
        "faults": list(result.faults),
        "warnings": list(result.warnings),
        "reused": list(result.reused),
        "metrics": result.metrics,
        "seconds": round(result.seconds, 2),
    }


def _failure(folder: str, error: Exception, *, several: bool) -> tuple[int, str, str]:
    """Exit code, ending and message of a test without outcome; a single one's internal error is raised."""
    refused = refusal_of(error)
    if refused is not None:
        return REFUSED, WORDS[REFUSED], refused
    if not several:
        raise error
    place = shown(folder)
    if isinstance(error, LostError):
        hint = "finished stages are kept: run it again, with fewer --workers where memory was short"
        return INTERNAL, LOST, f"{place}: lost: its process ended by {error}; {hint}"
    text = str(error) if isinstance(error, ElsewhereError) else f"{type(error).__name__}: {error}"
    return INTERNAL, WORDS[INTERNAL], f"{place}: internal error: {text}"


class Outcomes:
    """What becomes of the tests of one command: said as they end, and together at last, in the order given.

    Parameters
    ----------
    talk : Talk
        Who says it; its summary holds at any time the tests that have ended.
    folders : sequence of str
        The test folders.
    progress : Stages
        Hears how many have ended, where there are several.
    """

    def __init__(self, talk: Talk, folders: Sequence[str], progress: Stages) -> None:
        self._talk, self._folders, self._progress = talk, folders, progress
        self._names = names_of(folders)
        self._rows: dict[int, dict[str, Any]] = {}
        self._start_s = time.monotonic()
        self._count()

    def finished(self, index: int, result: Any) -> None:
        """Note what became of a test, and say it."""
        name = self._names[index] if self._several else ""
        _, row = outcome_row(self._talk, self._folders[index], result, name=name)
        self._rows[index] = row
        self._talk.summary["tests"] = [self._rows[key] for key in sorted(self._rows)]
        self._count()

    def watched(self, index: int) -> Progress:
        """Who hears of the stages of a test."""
        return self._progress.of(self._names[index]) if self._several else self._progress

    @property
    def _several(self) -> bool:
        return len(self._folders) > 1

    def _count(self) -> None:
        if self._several:
            self._progress("tests", len(self._rows), len(self._folders))

    def close(self) -> int:
        """Say what became of all, and return the greatest exit code."""
        rows: list[dict[str, Any]] = self._talk.summary["tests"]
        if self._several:
            self._talk.summary["endings"] = dict(Counter(row["ending"] for row in rows))
            for line in summary_lines(self._names, rows, time.monotonic() - self._start_s):
                self._talk.say(line)
        return max(int(row["exit_code"]) for row in rows)


def names_of(folders: Sequence[str]) -> list[str]:
    """What tests are called among several: the names of their folders, with the path where two share one.

    >>> names_of(["x/a", "y/a", "y/b"])
    ['x/a', 'y/a', 'b']
    """
    names = [last_name(folder_of(folder)) for folder in folders]
    count = Counter(names)
    chosen = (shown(folder) if count[name] > 1 else name for folder, name in zip(folders, names, strict=True))
    return ["".join(sign if sign.isprintable() else "?" for sign in name) for name in chosen]


def summary_lines(names: Sequence[str], rows: Sequence[dict[str, Any]], seconds: float) -> list[str]:
    """A table of tests, a line each, and a last line that counts them.

    Parameters
    ----------
    names : sequence of str
        What each test is called.
    rows : sequence of dict
        As :func:`outcome_row` makes them.
    seconds : float
        What all took together, s.
    """
    table = [HEAD, *map(_cells, names, rows)]
    widths = [max(len(cells[column]) for cells in table) for column in range(len(HEAD) - 1)]
    lines = ["  ".join([*map(str.ljust, cells, widths), cells[-1]]).rstrip() for cells in table]
    endings = Counter(row["ending"] for row in rows)
    counts = ", ".join(f"{count} {ending}" for ending, count in sorted(endings.items()))
    return [*lines, f"{len(rows)} tests in {duration(seconds)}: {counts}"]


def _cells(name: str, row: dict[str, Any]) -> tuple[str, ...]:
    """A line of the table; where there is no report, the first line of what was said instead."""
    if "error" in row:
        said = row["error"].splitlines()[0].removeprefix(f"{row['folder']}: {row['ending']}: ")
        return name, row["ending"], "", "", textwrap.shorten(said, MOST_SAID, placeholder=" ...")
    judged = [metric["agrees"] for metric in row["metrics"].values() if metric["agrees"] is not None]
    agreeing = f"{judged.count(True)} of {len(judged)}" if judged else ""
    return name, row["ending"], duration(row["seconds"]), agreeing, row["report"]
