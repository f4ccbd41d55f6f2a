"""Steps of a run: from a test folder to its result files, resumable and traceable.

Nothing heavy is imported until :func:`process_folder` is asked for: who hands tests to other processes does
not need it.
"""

from typing import TYPE_CHECKING, Any

from ploughval.run.outcome import Outcome

if TYPE_CHECKING:
    from ploughval.run.process import process_folder

__all__ = ["Outcome", "process_folder"]


def __getattr__(name: str) -> Any:
    if name != "process_folder":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from ploughval.run.process import process_folder

    return process_folder
