"""One change of a source."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change.

    Attributes
    ----------
    operator : str
        cosmic-ray's name of the kind of change.
    function : str
        Where it is, as Class.function; empty: outside any.
    line : int
        Number of the first line that is another.
    before, after : str
        That line, without its indentation.
    part : str
        The changed function, or what stands outside any.
    source : str
        The whole changed source.
    """

    operator: str
    function: str
    line: int
    before: str
    after: str
    part: str
    source: str
