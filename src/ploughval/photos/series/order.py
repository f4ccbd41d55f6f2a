"""The order of photographs: of their names, of their times, and whether the two agree."""

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_COUNTER = re.compile(r"(.*?)([0-9]+)([^0-9]*)")
_ROLLED_DIGITS = 3
"""A counter of fewer digits than this is not taken to begin anew."""
CLOCK_STEP_S = 1800.0
"""Clocks are set by multiples of this where a time zone or summer time begins."""


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Sorting key that counts numbers in names as numbers.

    >>> sorted(["img10.png", "img9.png", "Img2.png"], key=natural_key)
    ['Img2.png', 'img9.png', 'img10.png']
    """
    parts = re.split(r"([0-9]+)", name)
    return tuple((0, int(p), p) if p.isdecimal() else (1, 0, p.casefold()) for p in parts if p)


def unroll(names: Sequence[str]) -> int:
    """How many names at the front of a natural order belong to its end: the camera's counter began anew.

    Parameters
    ----------
    names : sequence of str
        In natural order.

    Returns
    -------
    int
        Names that end in the lowest numbers of a counter whose highest number (9999) is among them too, where
        more than half of the counter lies between; 0 where nothing says so.

    Examples
    --------
    >>> unroll(["DSC_0001.jpg", "DSC_0002.jpg", "DSC_9998.jpg", "DSC_9999.jpg"])
    2
    """
    found = [_COUNTER.fullmatch(name) for name in names]
    if len(found) < 2 or not all(found):
        return 0
    parts = [m.groups() for m in found if m]
    width = len(parts[0][1])
    if width < _ROLLED_DIGITS or len({(p[0], len(p[1]), p[2]) for p in parts}) != 1:
        return 0
    number = np.array([int(p[1]) for p in parts])
    step = np.diff(number)
    if number[-1] != 10**width - 1 or number[0] > 1 or 2 * step.max() < 10**width:
        return 0
    return int(step.argmax()) + 1


def kinds_of_names(names: Sequence[str]) -> list[str]:
    """How many names there are of each kind, numbers apart, where numbered ones are of more than one."""
    kinds = Counter(re.sub(r"[0-9]+", "#", name) for name in names)
    if len(kinds) < 2 or max(kinds.values()) < 2:
        return []
    return [f"{count} as {kind}" for kind, count in kinds.most_common()]


def by_time(time_s: NDArray[np.float64]) -> NDArray[np.intp]:
    """Order of time (F,); a frame without a time keeps its place among its neighbours by name."""
    count, known = np.arange(len(time_s)), np.flatnonzero(np.isfinite(time_s))
    if not known.size:
        return count.astype(np.intp)
    return np.argsort(np.interp(count, known, time_s[known]), kind="stable")


def disagreement(time_s: NDArray[np.float64], names: Sequence[str]) -> str:
    """Where times (F,), given in the order of names, go back; empty where they do not."""
    known = np.flatnonzero(np.isfinite(time_s))
    back = np.flatnonzero(np.diff(time_s[known]) < 0)
    if not back.size:
        return ""
    earlier, later = (names[known[back[0] + k]] for k in (1, 0))
    more = f" ({back.size} such places)" if back.size > 1 else ""
    step = np.diff(time_s[known])
    usual = float(np.median(step))
    lost = usual - float(step[back[0]])  # what the clock lost, if it was set
    off = abs(lost - CLOCK_STEP_S * round(lost / CLOCK_STEP_S))
    if back.size == 1 and off <= usual / 2 < CLOCK_STEP_S / 20:
        more = (
            f"; the clock may have been set back by {lost / 60:.0f} min in between (summer time, time zone)"
        )
    return f"order of time differs from the order of names: {earlier} was taken before {later}{more}"
