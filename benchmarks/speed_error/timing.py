"""How every time of speed against error is taken: compiled before, median of rounds, CPU and clock."""

import time
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np

Found = TypeVar("Found")


class Seconds(NamedTuple):
    """Time of one call, s.

    Attributes
    ----------
    cpu : float
        Of the process, all threads together: what other work on the machine hardly changes.
    wall : float
        By the clock.
    """

    cpu: float
    wall: float


def timed(call: Callable[[], Found], rounds: int, *, least_s: float = 0.0) -> tuple[Found, Seconds]:
    """Result of a call, and the medians of its times.

    Parameters
    ----------
    call : callable
        What is timed; whatever it compiles must have been compiled.
    rounds : int
        How often it is called.
    least_s : float, s
        Short calls are repeated within a round until they have taken this long together.
    """
    found, once = _round(call, 1)
    times = max(1, int(np.ceil(least_s / max(once.wall, 1e-7))))
    taken = [once] if times == 1 else []
    while len(taken) < rounds:
        found, seconds = _round(call, times)
        taken.append(seconds)
    return found, Seconds(*np.median(np.array(taken), axis=0).tolist())


def _round(call: Callable[[], Found], times: int) -> tuple[Found, Seconds]:
    wall, cpu = time.perf_counter(), time.process_time()
    for _ in range(times):
        found = call()
    return found, Seconds((time.process_time() - cpu) / times, (time.perf_counter() - wall) / times)
