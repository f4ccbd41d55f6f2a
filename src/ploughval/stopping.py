"""How a command is stopped: a first signal asks it to end in order, a second ends it at once."""

import _thread
import os
import signal
import threading
import time
from types import FrameType

_ASKED = ("SIGINT", "SIGTERM", "SIGHUP")
_BY_KEY = "SIGINT"
_SHELL = 128  # what shells add to the number of a signal
_AGAIN_S = 0.01  # until a signal that came during an import is sent again
_LONGEST_S = 5.0  # that imports may keep it waiting
_TOGETHER_S = 0.2  # within which a second signal is the first one again: `timeout` sends each twice
_heard_s: list[float] = []  # when the first one came
_waiting: list[int] = []  # what is to be sent again


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

    A signal that whoever started the process has had ignored (as ``nohup`` does) stays ignored. One that
    comes during an import waits for its end.
    """
    usual = (signal.SIG_DFL, signal.default_int_handler)
    for name in _ASKED:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) in usual:
            signal.signal(number, _ask)


def _ask(number: int, frame: FrameType | None) -> None:
    if _waiting:
        _at_once(number, frame)
        return
    if not _heard_s:
        _heard_s.append(time.monotonic())
    if _imports(frame) and _may_wait():
        _waiting.append(number)
        # not of threading: its locks may be held by what was interrupted
        _thread.start_new_thread(_send_again, (number,))
        return
    for name in _ASKED:
        other = getattr(signal, name, None)
        if other is not None and signal.getsignal(other) is _ask:
            signal.signal(other, _at_once)
    raise Stopped(number)


def _imports(frame: FrameType | None) -> bool:
    """Whether an import is going on.

    What is raised in one may leave Python's lock of imports taken, for which other threads then wait without
    end, or be hidden by a library that says its own initialization failed.
    """
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _send_again(number: int) -> None:
    time.sleep(_AGAIN_S)
    _waiting.clear()
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, number)
    else:  # another system's: the main thread hears of it when it next runs
        signal.raise_signal(number)


def _may_wait() -> bool:
    return time.monotonic() - _heard_s[0] < _LONGEST_S


def _at_once(number: int, _frame: FrameType | None) -> None:
    if time.monotonic() - _heard_s[0] >= _TOGETHER_S:
        os._exit(exit_code(number))
