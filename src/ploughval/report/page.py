"""Pages from result folders: one test, or several side by side; one self-contained file each."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from ploughval.errors import ConfigError, Fault
from ploughval.report.attached import Attached, attached
from ploughval.report.blocks import Chapter, Pen
from ploughval.report.calibration import calibration_chapter
from ploughval.report.chapters import bands_chapter, field_chapter
from ploughval.report.force import force_chapter
from ploughval.report.friction import friction_chapter
from ploughval.report.good_practice import good_practice_chapter
from ploughval.report.load_cells import load_cells_chapter
from ploughval.report.mound import mound_chapter
from ploughval.report.photographs import open_photographs
from ploughval.report.player import player_chapter
from ploughval.report.quality import provenance_chapter, quality_chapter
from ploughval.report.rendering import rendered
from ploughval.report.scripts import json_block, page_script
from ploughval.report.several import find_several, several_context, write_numbers
from ploughval.report.shear import shear_chapter
from ploughval.report.soil_fit import soil_fit_chapter
from ploughval.report.stages import layers_chapter
from ploughval.report.verdict import agreement_chapter, short_chapter, tiles, verdict
from ploughval.results import Results, read_results
from ploughval.run.kept.lock import locked
from ploughval.run.kept.written import write_text
from ploughval.watch import Progress, one_step, unheard

PAGE_NAME = "report.html"
COMPARISON_NAME = "comparison.html"
STAGE = "report"
STAGE_PIXELS = 400_000  # of photograph in the figures of the stages: the player shows every frame
SCRIPTS = ("downloads.js", "reading.js")
PLAYER_SCRIPTS = ("player_data.js", "player_stage.js", "player_chart.js", "player.js")


def write_report(
    results: Path | Sequence[Path], *, out: Path | None = None, progress: Progress = unheard
) -> Path:
    """Write the page of one result folder, or one that compares several.

    Parameters
    ----------
    results : path or sequence of paths
        Result folders (or test folders that hold ``results``).
    out : path, optional
        File to write to, or a folder: one that exists, or a name without an ending; absent:
        ``report.html`` in the result folder, for several ``comparison.html`` in the first, with its numbers
        beside it as .json and .csv.
    progress : callable
        Hears of (stage, done, total) of the chapters.

    Returns
    -------
    Path
        The page: one file that needs no other and no network.

    Raises
    ------
    DataError
        No result folder, a file in it that cannot be read, or a run at work where the page goes.
    ConfigError
        No folder at all.
    """
    folders = [results] if isinstance(results, str | Path) else list(results)
    if not folders:
        raise ConfigError("report", [Fault("results", "no folder", "at least one result folder")])
    tests = [read_results(folder) for folder in folders]
    name = PAGE_NAME if len(tests) == 1 else COMPARISON_NAME
    target = tests[0].folder if out is None else Path(out)
    target = target / name if target.is_dir() or not target.suffix else target
    own = any(target.parent.resolve() == test.folder.resolve() for test in tests)
    with locked(target.parent) if own else nullcontext():
        if len(tests) == 1:
            return _write_page(tests[0], target, progress)
        with one_step(progress, STAGE):
            found = find_several(tests)
            write_text(target, render("test.html.j2", **several_context(found, Pen())))
            write_numbers(found, target)
    return target


def write_single(results: Path, progress: Progress = unheard) -> Path:
    """Write the page of one result folder into it, for the run that holds the folder.

    Parameters
    ----------
    results : Path
        Result folder.
    progress : callable
        Hears of (stage, done, total).

    Returns
    -------
    Path
        The page.
    """
    return _write_page(read_results(results), results / PAGE_NAME, progress)


def _write_page(results: Results, target: Path, progress: Progress) -> Path:
    write_text(target, single_page(results, progress))
    return target


def single_page(results: Results, progress: Progress = unheard) -> str:
    """The page of one test, as HTML."""
    pen, photographs = Pen(), open_photographs(results)
    progress(STAGE, 0, 1)
    short, agreement = short_chapter(results), agreement_chapter(results, pen)
    makers: tuple[Callable[[], Chapter | None], ...] = (
        lambda: short or agreement,
        lambda: player_chapter(results, photographs),
        lambda: force_chapter(results, pen),
        lambda: layers_chapter(results, pen, photographs, photo_pixels=STAGE_PIXELS),
        lambda: mound_chapter(results, pen),
        lambda: bands_chapter(results, pen),
        lambda: field_chapter(results, pen),
        lambda: shear_chapter(results, pen),
        lambda: friction_chapter(results, pen),
        lambda: agreement if short else None,
        lambda: soil_fit_chapter(results, pen),
        lambda: load_cells_chapter(results, pen),
        lambda: calibration_chapter(results, pen),
        lambda: good_practice_chapter(results),
        lambda: quality_chapter(results, pen),
        lambda: provenance_chapter(results),
    )
    chapters: list[Chapter] = []
    for done, make in enumerate(makers, start=1):
        chapters += [chapter for chapter in (make(),) if chapter is not None]
        progress(STAGE, done, len(makers) + 1)
    page = render(
        "test.html.j2",
        title=results.name,
        notes=str(results.setting("test", "notes") or ""),
        verdict=verdict(results),
        tiles=tiles(results),
        chapters=chapters,
        version=results.run.ploughval,
        **with_files(attached(results, chapters)),
    )
    progress(STAGE, len(makers) + 1, len(makers) + 1)
    return page


def with_files(files: Mapping[str, Attached]) -> dict[str, Any]:
    """What a page needs to offer tables of the result folder: them by file, and what holds them."""
    texts = {name: {"name": file.name, "text": file.text} for name, file in files.items()}
    return {"files": files, "attached": json_block("attached", texts)}


def render(template: str, *, chapters: Sequence[Chapter], **context: Any) -> str:
    """A page of the package's templates with its scripts: the player's only where there is one."""
    played = any(chapter.player is not None for chapter in chapters)
    script = page_script(SCRIPTS + PLAYER_SCRIPTS if played else SCRIPTS)
    return str(rendered(template, script=script, played=played, chapters=chapters, **context))
