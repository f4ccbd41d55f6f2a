"""Hard cases and their fate: a stated demand, a measured error, and what was said, make a verdict."""

import logging
import re
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from math import isnan
from typing import Any

from matplotlib.figure import Figure, SubFigure

from ploughval.errors import PloughvalError

Canvas = Figure | SubFigure
COLUMNS = ("case", "done", "must_hold", "happened", "error", "unit", "limit", "said", "verdict")
NO_WORDS = r"(?!)"
_SCRATCH = re.compile(rf"{re.escape(tempfile.gettempdir())}/tmp\w+/")  # of folders that are made anew
_SAID_SHOWN = 6  # distinct texts of a case that the table keeps


class Fate(StrEnum):
    """What a hard case may come to."""

    HOLDS = "holds"
    REFUSED = "refused with a message"
    DEGRADED = "degraded, and says so"
    WRONG = "WRONG and silent"


@dataclass(frozen=True, slots=True)
class Happened:
    """What came out of a hard case.

    Attributes
    ----------
    error : float
        In the unit of the case; NaN where nothing was measured.
    what : str
        The figures behind it, in words.
    told : tuple of str
        Statuses, faults, notes and reasons that came with the result.
    broken : tuple of str
        Further demands that are not met, whatever the error.
    shown : Any
        What the picture of the part draws.
    """

    error: float
    what: str
    told: tuple[str, ...] = ()
    broken: tuple[str, ...] = ()
    shown: Any = None


@dataclass(frozen=True, slots=True)
class HardCase:
    """A hard case: what is done, what must hold, and how large an error is still right.

    Attributes
    ----------
    name, done, must : str
        For the reader.
    run : callable
        Does it; returns what happened, or raises.
    limit : float
        Largest error that holds, in ``unit``.
    unit : str
    says : str
        Pattern of the words that own up to a larger error or to nothing measured; the default: none do.
    """

    name: str
    done: str
    must: str
    run: Callable[[], Happened]
    limit: float
    unit: str
    says: str = NO_WORDS


@dataclass(frozen=True, slots=True)
class Outcome:
    """A case, what happened, and the verdict."""

    case: HardCase
    happened: Happened
    fate: Fate

    def row(self) -> dict[str, object]:
        """A row of the table of its part."""
        case, happened = self.case, self.happened
        told = tuple(dict.fromkeys(_SCRATCH.sub("", text) for text in happened.told))
        more = (f"and {len(told) - _SAID_SHOWN} more",) if len(told) > _SAID_SHOWN else ()
        return {
            "case": case.name,
            "done": case.done,
            "must_hold": case.must,
            "happened": "; ".join((happened.what, *happened.broken)),
            "error": happened.error,
            "unit": case.unit,
            "limit": case.limit,
            "said": " | ".join((*told[:_SAID_SHOWN], *more)),
            "verdict": self.fate.value,
        }


@dataclass(frozen=True, slots=True)
class Part:
    """The hard cases of one part of the chain, and how one of them is drawn."""

    key: str
    title: str
    lead: str
    cases: Callable[[], Sequence[HardCase]]
    draw: Callable[[Canvas, HardCase, Any], None]


def judge(case: HardCase, happened: Happened) -> Fate:
    """Whether a result holds, owns up to what it lacks, or is wrong without a word.

    A result whose error is within the limit holds. Another one, or none at all, is degraded if one of the
    case's own words is among what was told; unrelated warnings do not help.
    """
    if not happened.broken and not isnan(happened.error) and abs(happened.error) <= case.limit:
        return Fate.HOLDS
    heard = any(re.search(case.says, text, re.IGNORECASE) for text in happened.told)
    return Fate.DEGRADED if heard else Fate.WRONG


def attempt(case: HardCase) -> Outcome:
    """Run a case; an error of ploughval's own is a refusal, any other one is wrong."""
    with listening() as heard:
        try:
            happened = case.run()
        except PloughvalError as error:
            text = " ".join(str(error).split())
            fate = Fate.REFUSED if text else Fate.WRONG
            return Outcome(case, Happened(float("nan"), "refused", (text, *heard)), fate)
        except Exception as error:  # whatever falls over is what this study looks for
            text = f"fell over: {type(error).__name__}: {error}"
            return Outcome(case, Happened(float("nan"), text, tuple(heard)), Fate.WRONG)
    told = (*happened.told, *heard)
    happened = Happened(happened.error, happened.what, told, happened.broken, happened.shown)
    return Outcome(case, happened, judge(case, happened))


@contextmanager
def listening() -> Iterator[list[str]]:
    """Collect what is logged as a warning by ploughval, and every Python warning."""
    heard: list[str] = []

    class Ear(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            heard.append(record.getMessage())

    logger, ear = logging.getLogger("ploughval"), Ear(logging.WARNING)
    logger.addHandler(ear)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield heard
        heard.extend(f"{w.category.__name__}: {w.message}" for w in caught)
    finally:
        logger.removeHandler(ear)
