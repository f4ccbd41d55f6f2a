"""What a job returned or raised, as JSON: between processes travel texts and numbers, no objects."""

from collections.abc import Mapping
from typing import Any

from ploughval.errors import PloughvalError
from ploughval.refusals import refusal_of
from ploughval.run.outcome import Outcome

OUTCOME, REFUSED, INTERNAL = "outcome", "refused", "internal"


class ElsewhereError(Exception):
    """An internal error in another process; its text begins with the type of the error there."""


class LostError(Exception):
    """The process that worked on a test died: nothing is known but how."""


def answer_of(result: Any) -> dict[str, Any]:
    """What became of a test, as a mapping that JSON holds.

    Parameters
    ----------
    result : Outcome or Exception
        What a job returned or raised.
    """
    if not isinstance(result, Exception):
        return {OUTCOME: result.to_json()}
    refused = refusal_of(result)
    return {INTERNAL: f"{type(result).__name__}: {result}"} if refused is None else {REFUSED: refused}


def result_of(answer: Mapping[str, Any]) -> Outcome | Exception:
    """The outcome, or an error with the text, that an answer tells of.

    >>> str(result_of(answer_of(PloughvalError("no log"))))
    'no log'
    >>> result_of(answer_of(KeyError("a")))
    ElsewhereError("KeyError: 'a'")
    """
    if REFUSED in answer:
        return PloughvalError(answer[REFUSED])
    if INTERNAL in answer:
        return ElsewhereError(answer[INTERNAL])
    return Outcome.from_json(answer[OUTCOME])
