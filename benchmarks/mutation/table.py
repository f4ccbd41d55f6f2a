"""Verdicts of a run, kept so that a run may stop and go on, and what of them is explained."""

import csv
import hashlib
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from mutation.mutant import Mutant

EXPLAINED = Path(__file__).with_name("equivalent.csv")
FATES = ("mutants", "killed", "timed out", "equivalent", "surviving")


class Explained(NamedTuple):
    """A mutant that no test can notice, and why; a line of equivalent.csv."""

    module: str
    function: str
    before: str
    after: str
    why: str


class Kept:
    """Verdicts in a file, by the changed function and by the module and tests that gave them."""

    def __init__(self, path: Path, texts: Iterable[Path]) -> None:
        self._path = path
        self._context = _digest("".join(text.read_text(encoding="utf-8") for text in texts))
        self._fates: dict[str, tuple[str, str]] = {}
        if path.exists():
            with path.open(newline="", encoding="utf-8") as file:
                self._fates = {key: (context, fate) for key, context, fate in csv.reader(file)}

    def fate(self, mutant: Mutant, *, older: bool) -> str | None:
        """What became of it; ``older``: a kill by fewer tests or beside other functions is one too."""
        context, fate = self._fates.get(_digest(mutant.part), ("", ""))
        known = fate and (context == self._context or (older and fate != "survived"))
        return fate if known else None

    def add(self, mutant: Mutant, fate: str) -> None:
        """Keep a verdict."""
        key = _digest(mutant.part)
        self._fates[key] = (self._context, fate)
        with self._path.open("a", newline="", encoding="utf-8") as file:
            csv.writer(file).writerow([key, self._context, fate])


def explained() -> list[Explained]:
    """The lines of equivalent.csv."""
    with EXPLAINED.open(newline="", encoding="utf-8") as file:
        return [Explained(**row) for row in csv.DictReader(file)]


def judged(module: str, fates: Sequence[tuple[Mutant, str]]) -> list[tuple[Mutant, str]]:
    """Fates in which a survivor is equivalent, where explained, or surviving."""
    known = {line[:4] for line in explained()}
    return [(mutant, _judged(module, mutant, fate, known)) for mutant, fate in fates]


def _judged(module: str, mutant: Mutant, fate: str, known: set[tuple[str, ...]]) -> str:
    if fate != "survived":
        return fate
    return "equivalent" if (module, mutant.function, mutant.before, mutant.after) in known else "surviving"


def counted(fates: Iterable[str]) -> list[int]:
    """Numbers in the order of FATES."""
    counts = Counter(fates)
    return [counts.total(), *(counts[fate] for fate in FATES[1:])]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:20]
