"""What the command line says of a processed test: lines, exit code, a row of the JSON summary."""

from pathlib import Path
from typing import Any

from ploughval.talk import DONE, INCOMPLETE, INTERNAL, REFUSED, Talk


def outcome_row(talk: Talk, folder: Path, result: Any, *, several: bool) -> tuple[int, dict[str, Any]]:
    """Say what became of one test.

    Parameters
    ----------
    talk : Talk
        Who says it.
    folder : Path
        The test folder.
    result : Outcome or Exception
        What processing it returned or raised.
    several : bool
        Whether other tests go on after it, which an internal error must not stop.

    Returns
    -------
    code : int
        Exit code of this test.
    row : dict
        Its row of the JSON summary.
    """
    from ploughval.errors import PloughvalError

    if isinstance(result, PloughvalError):
        talk.warn(f"refused: {result}")
        return REFUSED, {"folder": str(folder), "exit_code": REFUSED, "error": str(result)}
    if isinstance(result, Exception):
        if not several:
            raise result
        talk.warn(f"{folder}: internal error: {type(result).__name__}: {result}")
        return INTERNAL, {"folder": str(folder), "exit_code": INTERNAL, "error": repr(result)}
    code = DONE if result.complete else INCOMPLETE
    for fault in result.faults:
        talk.warn(f"{result.name}: {fault}")
    for warning in result.warnings:
        talk.warn(f"{result.name}: warning: {warning}")
    talk.say(f"{result.name}: {'done' if code == DONE else 'done, incomplete'} in {result.seconds:.1f} s")
    talk.say(f"report: {result.report}")
    return code, {
        "folder": str(folder),
        "exit_code": code,
        "test": result.name,
        "results": str(result.results),
        "report": str(result.report),
        "faults": list(result.faults),
        "warnings": list(result.warnings),
        "metrics": result.metrics,
        "seconds": round(result.seconds, 2),
    }
