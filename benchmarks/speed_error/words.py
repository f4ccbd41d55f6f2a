"""Sentences whose numbers come from tables and whose sense follows the numbers."""

from ploughval.report.text import brief
from speed_error.points import SAME, Panel, Point

WAITING = 1.2
"""Clock over CPU beyond which something else ran."""
BUSY = "The clock of this table tells of other work on the machine: what two threads gain is not said."


def shown(value: float) -> str:
    """A number to three digits."""
    return brief(value, 3)


def change(ratio: float, what: str) -> str:
    """What becomes of a quantity.

    >>> change(0.74, "the error"), change(1.01, "the time")
    ('lowers the error by 26 %', 'leaves the time as it is')
    >>> change(3.2, "the time"), change(0.1, "the error")
    ('multiplies the time by 3.2', 'divides the error by 10')
    """
    if abs(ratio - 1.0) <= SAME:
        return f"leaves {what} as it is"
    if ratio >= 2.0:
        return f"multiplies {what} by {brief(ratio, 2)}"
    if ratio <= 0.5:
        return f"divides {what} by {brief(1.0 / ratio, 2)}"
    return f"{'lowers' if ratio < 1.0 else 'raises'} {what} by {abs(100.0 * (ratio - 1.0)):.0f} %"


def against(one: Point, other: Point, error: str = "the error", time: str = "the time") -> str:
    """What a setting does in place of another: to the error, and to the time."""
    if max(abs(one.error / other.error - 1.0), abs(one.time / other.time - 1.0)) <= SAME:
        return f"changes neither {error} nor {time}"
    first, second = change(one.error / other.error, error), change(one.time / other.time, time)
    return f"{first} {'but' if _pays(one, other) else 'and'} {second}"


def _pays(one: Point, other: Point) -> bool:
    """Whether one of error and time falls and the other rises by something."""
    error, time = one.error / other.error - 1.0, one.time / other.time - 1.0
    return min(abs(error), abs(time)) > SAME and error * time < 0.0


def dominance(panel: Panel, quantity: str) -> str:
    """Whether anything measured is both faster and more exact than the default."""
    better, mine = panel.better(), panel.standard
    if not better:
        count = len(panel.measured)
        return f"{quantity}: none of {count} settings is both faster and more exact than the default."
    here = f"default {shown(mine.error)} at {shown(mine.time)}"
    names = "; ".join(
        f"{p.family} {p.setting} ({shown(p.error)} at {shown(p.time)}, {here})" for p in better[:3]
    )
    more = f", and {len(better) - 3} more" if len(better) > 3 else ""
    return f"{quantity}: both faster and more exact than the default here: {names}{more}."


def quiet(*times: tuple[float, float]) -> bool:
    """Whether pairs of CPU and clock are those of a machine with nothing else to do: a call never waits.

    >>> quiet((1.0, 1.05), (1.1, 0.6)), quiet((1.0, 3.0))
    (True, False)
    """
    return all(clock <= WAITING * cpu for cpu, clock in times)


def best(points: dict[str, Point]) -> Point:
    """The point of least error."""
    return min((p for p in points.values() if p.known), key=lambda p: p.error)
