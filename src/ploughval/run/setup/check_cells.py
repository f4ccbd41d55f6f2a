"""The load cells of a test as `ploughval check` sees them: log, empty runs, calibration, force."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pandas as pd

from ploughval.errors import PloughvalError
from ploughval.loadcells import ForceResult, Log, calibrate_cells, measure_force
from ploughval.loadcells.logs import log_paths, read_cell_log
from ploughval.run.setup.check_findings import Ledger, Level
from ploughval.run.setup.check_settings import Settings
from ploughval.scene import LoadCells, Scene

Value = TypeVar("Value")

_SOUND_ROWS = "rows in order, without gaps, strays and empty values"


def check_cells(settings: Settings, ledger: Ledger, lines: list[str]) -> pd.DataFrame | None:
    """Read logs and calibration; the force record where everything it needs is sound."""
    scene, cells = settings.scene, settings.scene.loadcells
    if cells is None:
        return None
    said = [_check_log(scene, cells, ledger, lines), _check_empty(scene, cells, ledger)]
    if not settings.complete:
        return None
    if cells.calibration.files or cells.calibration.staircases:
        said.append(_check_calibration(scene, ledger, lines))
    sound = [texts for texts in said if texts is not None]
    if len(sound) < len(said):
        return None  # the force would be refused for the same reason
    known = set[str]().union(*sound)
    force = _tried(lambda: measure_force(scene), ledger, "loadcells", "a log that can be used")
    if force is None:
        return None
    _say_force(force, lines)
    for text in force.faults:
        if text not in known:
            ledger.note(Level.REMARK, "", "loadcells", text)
    return force.record


def _tried(action: Callable[[], Value], ledger: Ledger, place: str, expected: str) -> Value | None:
    """The value, or None with the fault in the ledger."""
    try:
        return action()
    except PloughvalError as error:
        ledger.refuse(error, _file_of(error), place, expected)
        return None


def _file_of(error: PloughvalError) -> str:
    path = getattr(error, "path", None)
    return Path(path).name if path else "test.toml"


def _check_log(scene: Scene, cells: LoadCells, ledger: Ledger, lines: list[str]) -> set[str] | None:
    """The log itself; the texts that were said, None where it cannot be read."""
    paths = log_paths(scene, cells)
    found: Log | None = _tried(
        lambda: read_cell_log(paths, cells), ledger, "loadcells.log", "a log that can be read"
    )
    if found is None:
        return None
    name = ", ".join(path.name for path in paths[:3]) + (", ..." if len(paths) > 3 else "")
    time = found.data["time_s"]
    lines.append(f"log: {name}, {len(found.data)} rows from {time.iloc[0]:.6g} to {time.iloc[-1]:.6g} s")
    for text in found.faults:
        ledger.note(Level.LOST, name, "loadcells.log", text, _SOUND_ROWS)
    for text in found.notes:
        ledger.note(Level.REMARK, name, "loadcells.log", text)
    return {*found.faults, *found.notes}


def _check_empty(scene: Scene, cells: LoadCells, ledger: Ledger) -> set[str]:
    """Every empty-box run; the texts that the force will say of them."""
    said: set[str] = set()
    logs = set(log_paths(scene, cells))
    for pattern in cells.empty:
        if not scene.matches(pattern):
            text = "no file matches: the force does without"
            ledger.note(Level.LOST, pattern, "loadcells.empty", text, "at least one file that matches")
    for path in sorted({path for pattern in cells.empty for path in scene.matches(pattern)} - logs):
        try:
            found = read_cell_log(path, cells)
        except PloughvalError as error:
            text = str(error).removeprefix(f"{path}: ")
            ledger.note(Level.LOST, path.name, "loadcells.empty", text, "a run like the test's log: left out")
            said.add(f"empty-box run left out: {error}")
            continue
        for text in found.faults:
            ledger.note(Level.LOST, path.name, "loadcells.empty", text, _SOUND_ROWS)
            said.add(f"{path.name}: {text}")
    return said


def _check_calibration(scene: Scene, ledger: Ledger, lines: list[str]) -> set[str] | None:
    """Tables and staircases of known loads; the texts that were said, None where they are refused."""
    place = "loadcells.calibration"
    found = _tried(lambda: calibrate_cells(scene), ledger, place, "points that fix the cells' response")
    if found is None:
        return None
    scatter = " and ".join(f"{value:.2g}" for value in found.scatter_Nm)
    lines.append(f"cells: {found.model} through {len(found.points)} points, scatter {scatter} N m")
    for text in found.faults:
        ledger.note(Level.REMARK, "", place, text)
    return set(found.faults)


def _say_force(force: ForceResult, lines: list[str]) -> None:
    record = force.record
    known = record["force_N"].notna()
    lines.append(
        f"load cells: {len(record)} rows, u to {record['u_mm'].max():.2f} mm, force to "
        f"{record.loc[known, 'force_N'].max():.3g} N, "
        f"{'friction compensated' if force.compensated else 'no friction compensation'}"
    )
