"""A value with its standard uncertainty: what every part of the comparison passes on."""

from typing import NamedTuple


class Quantity(NamedTuple):
    """A value with its standard uncertainty; NaN where it could not be had."""

    value: float
    std: float


MISSING = Quantity(float("nan"), float("nan"))
