"""What `ploughval check` has found: how grave, in which file, where, what was expected, what to do."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, astuple, dataclass, field
from enum import StrEnum

from ploughval.errors import ConfigError, DataError, Fault, PloughvalError

SETTINGS = "test.toml"


class Level(StrEnum):
    """How grave a finding is."""

    REFUSED = "refused"  # the test cannot be processed
    LOST = "fault"  # it can, but something is wrong or will be missing
    REMARK = "remark"  # to be known


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was found; ``file`` is the name of the file it was found in."""

    level: Level
    file: str
    fault: Fault

    def __str__(self) -> str:
        place, value, expected, remedy = astuple(self.fault)
        text = f"{self.file}: {place}" if self.file else place
        if not expected:
            return f"{text}: {value}"
        got = f"{text}: got {value}" if self.file == SETTINGS else f"{text}: {value}"
        return f"{got}; expected {expected}" + (f". {remedy}" if remedy else "")

    def to_json(self) -> dict[str, str]:
        """As plain texts."""
        return {"level": self.level.value, "file": self.file, **asdict(self.fault)}


@dataclass(slots=True)
class Ledger:
    """All findings, each once, in the order in which they were found."""

    findings: list[Finding] = field(default_factory=list)

    def add(self, level: Level, file: str, fault: Fault) -> None:
        """Add a finding that is not there yet."""
        texts = {(f.fault.place, f.fault.value) for f in self.findings}
        if (fault.place, fault.value) not in texts:
            self.findings.append(Finding(level, file, fault))

    def note(
        self, level: Level, file: str, place: str, text: str, expected: str = "", remedy: str = ""
    ) -> None:
        """Add a finding from its parts."""
        self.add(level, file, Fault(place, text, expected, remedy))

    def refuse(self, error: PloughvalError, file: str, place: str, expected: str) -> None:
        """Add every fault that an error holds; one without parts stands for itself."""
        if isinstance(error, ConfigError):
            for fault in error.faults:
                self.add(Level.REFUSED, file, fault)
            return
        text, named = str(error), error.path if isinstance(error, DataError) else None
        if named is not None:
            text = text.removeprefix(f"{named}: ").removeprefix(f"{named}, ")
        self.note(Level.REFUSED, file, place, text, "" if "expected" in text else expected)

    @property
    def worst(self) -> Level | None:
        """The gravest level; None where nothing was found."""
        there = {finding.level for finding in self.findings}
        return next((level for level in Level if level in there), None)


@contextmanager
def heard(ledger: Ledger) -> Iterator[None]:
    """Take warnings that are logged meanwhile as remarks, where no finding says the same."""
    said: list[str] = []

    class Ear(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            said.append(record.getMessage())

    logger, ear = logging.getLogger("ploughval"), Ear(logging.WARNING)
    before = logger.propagate
    logger.addHandler(ear)
    logger.propagate = before and logger.isEnabledFor(logging.DEBUG)
    try:
        yield
    finally:
        logger.removeHandler(ear)
        logger.propagate = before
        for text in dict.fromkeys(said):
            if not any(f.fault.value in text for f in ledger.findings):
                ledger.note(Level.REMARK, "", "seen", text)
