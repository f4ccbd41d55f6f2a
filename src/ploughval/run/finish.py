"""How a run begins and ends in its result folder: cleared of unfinished files; record and page come last."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ploughval.run.findings import Findings
from ploughval.run.kept.stages import PAGE, STAGES, STATE, WINDOW, page_key
from ploughval.run.kept.store import Store
from ploughval.run.kept.written import clean_aside, write_bytes, write_json
from ploughval.run.provenance import file_digest
from ploughval.run.results import forget, run_record
from ploughval.scene import Scene

Page = Callable[[Path], Path]
"""Writes the report page of a result folder and returns its path."""
RECORD, REPORT = "run.json", "report.html"
QUICK = "always: it takes less time than reading what was kept"
RESUMED = "went on from the photographs that an interrupted run had done"
_TITLES = {stage.name: stage.title for stage in STAGES} | {PAGE: "report"}
_NOT_SHOWN = ("folder", "timings_s")  # parts of the record that a page does not show
_READ = (".csv", ".json", ".nc")  # files of a result folder that a page may show


def clear(results: Path, kept: Store) -> None:
    """Take back what says that a result folder is whole, and what killed runs left of unfinished files."""
    forget(results)
    for folder in (results, results / "model"):
        clean_aside(folder)
    kept.clean()


def finish(scene: Scene, found: Findings, kept: Store, page: Page | None) -> Path | None:
    """Write run.json, which says that the result files are whole, and after it the report page.

    Parameters
    ----------
    scene : Scene
        The settings of the test.
    found : Findings
        All of whose other files are written.
    kept : Store
        Of the result folder; holds an earlier page, which stands where nothing on it has changed.
    page : callable or None
        Writes the page; None: there is none.

    Returns
    -------
    Path or None
        The page.
    """
    record, results = run_record(scene, found), kept.results
    if page is None:
        write_json(results / RECORD, record | {"stages": stage_notes(found, kept)})
        return None
    shown = {name: value for name, value in record.items() if name not in _NOT_SHOWN}
    key = page_key(shown, _digests(results))
    arrays = kept.load(PAGE, key)
    write_json(results / RECORD, record | {"stages": stage_notes(found, kept)})
    if arrays is not None:
        write_bytes(results / REPORT, arrays["html"].tobytes())
        return results / REPORT
    written = page(results)
    kept.save(PAGE, key, {"html": np.frombuffer(written.read_bytes(), np.uint8)})
    return written


def stage_notes(found: Findings, kept: Store) -> dict[str, dict[str, Any]]:
    """What became of each stage, by its title: reused or run, and why."""
    notes: dict[str, dict[str, Any]] = {title: {"done": "run", "why": QUICK} for title in found.timings_s}
    for name, title in _TITLES.items():
        if name in kept.told:
            found_it, why = kept.told[name]
            notes[title] = {"done": "reused" if found_it else "run", "why": why}
    if kept.told.get(STATE, (False, ""))[0]:
        notes[WINDOW.title]["why"] = RESUMED
    return notes


def reused(kept: Store) -> tuple[str, ...]:
    """Titles of the stages that an earlier run's result stands for, in the order in which they run."""
    return tuple(title for name, title in _TITLES.items() if kept.told.get(name, (False, ""))[0])


def _digests(results: Path) -> dict[str, str]:
    """Digests of what a page reads, by name, but for the record of the run."""
    names = sorted(path for folder in (results, results / "model") for path in folder.glob("[!.]*"))
    files = [path for path in names if path.suffix in _READ and path.name != RECORD and path.is_file()]
    return {path.relative_to(results).as_posix(): file_digest(path) for path in files}
