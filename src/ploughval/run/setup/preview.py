"""What a test folder holds and what would be measured in it, without changing anything."""

from dataclasses import dataclass
from pathlib import Path

from ploughval.run.setup.check_cells import check_cells
from ploughval.run.setup.check_findings import Finding, Ledger, Level, heard
from ploughval.run.setup.check_photographs import Seen, check_photographs
from ploughval.run.setup.check_settings import settings_of
from ploughval.scene import Scene


@dataclass(frozen=True, slots=True)
class Preview:
    """What was found in a test folder.

    Attributes
    ----------
    name : str
        Of the test.
    scene : Scene or None
        Its settings; where test.toml is refused, what is sound of them, or None.
    lines : tuple of str
        What will be measured.
    findings : tuple of Finding
        Everything that is wrong or to be known.
    worst : Level or None
        The gravest of them.
    seen : Seen
        The photographs, for the picture.
    """

    name: str
    scene: Scene | None
    lines: tuple[str, ...]
    findings: tuple[Finding, ...]
    worst: Level | None
    seen: Seen


def preview(folder: Path | str) -> Preview:
    """Validate a test folder and look at its first photographs and its logs.

    Parameters
    ----------
    folder : path-like
        Test folder, or its test.toml.

    Returns
    -------
    Preview
        Faults are findings: none of them hides another that can be seen without it.
    """
    ledger, lines = Ledger(), list[str]()
    settings = settings_of(folder, ledger)
    if settings is None:
        name = Path(folder).resolve().name
        return Preview(name, None, (), tuple(ledger.findings), ledger.worst, Seen())
    scene = settings.scene
    if settings.complete:
        lines.append(f"{scene.test.name}: steps {', '.join(step.value for step in scene.steps)}")
    told: list[str] = []
    with heard(ledger):
        record = check_cells(settings, ledger, told)
        seen = check_photographs(settings, ledger, lines, record)
    return Preview(scene.test.name, scene, (*lines, *told), tuple(ledger.findings), ledger.worst, seen)
