"""How a command is stopped: a first signal asks it to end in order, a second ends it at once."""

import os
import signal
from types import FrameType
from typing import NoReturn

_ASKED = ("SIGINT", "SIGTERM", "SIGHUP")
_BY_KEY = "SIGINT"
_SHELL = 128  # what shells add to the number of a signal


class Stopped(KeyboardInterrupt):
    """A signal asked the process to end.

    Parameters
    ----------
    number : int
        Of the signal.
    """

    def __init__(self, number: int) -> None:
        self.code = exit_code(number)
        name = signal.Signals(number).name
        self.by = "" if name == _BY_KEY else f" by {name}"
        super().__init__(name)


def exit_code(number: int) -> int:
    """Exit code of a process that a signal ended, as shells tell it.

    >>> exit_code(signal.SIGINT), exit_code(signal.SIGTERM)
    (130, 143)
    """
    return _SHELL + int(number)


def listen() -> None:
    """From here on the first signal raises :class:`Stopped` in the main thread, the second ends the process.

    A signal that whoever started the process has had ignored (as ``nohup`` does) stays ignored.
    """
    usual = (signal.SIG_DFL, signal.default_int_handler)
    for name in _ASKED:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) in usual:
            signal.signal(number, _ask)


def _ask(number: int, _frame: FrameType | None) -> NoReturn:
    for name in _ASKED:
        other = getattr(signal, name, None)
        if other is not None and signal.getsignal(other) is _ask:
            signal.signal(other, _at_once)
    raise Stopped(number)


def _at_once(number: int, _frame: FrameType | None) -> NoReturn:
    os._exit(exit_code(number))
