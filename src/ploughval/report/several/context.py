"""The page of several tests: its chapters, tiles and what it says in one line."""

from typing import Any

from ploughval.report.blocks import Pen, Tile
from ploughval.report.several.depth import depth_chapter
from ploughval.report.several.errors import errors_chapter
from ploughval.report.several.findings import SeveralFindings
from ploughval.report.several.overview import overview_chapter
from ploughval.report.several.repeatability import repeatability_chapter
from ploughval.report.several.side_by_side import bands_chapter, forces_chapter, metrics_chapter
from ploughval.report.verdict import counts


def several_context(found: SeveralFindings, pen: Pen) -> dict[str, Any]:
    """What the page of several tests shows.

    Parameters
    ----------
    found : SeveralFindings
        What was found in the tests.
    pen : Pen
        Draws the figures.
    """
    chapters = [
        overview_chapter(found),
        forces_chapter(found, pen),
        repeatability_chapter(found, pen),
        depth_chapter(found, pen),
        errors_chapter(found, pen),
        metrics_chapter(found),
        bands_chapter(found),
    ]
    return {
        "title": f"{len(found.tests)} tests compared",
        "notes": "",
        "verdict": _verdict(found),
        "tiles": _tiles(found),
        "chapters": [chapter for chapter in chapters if chapter is not None],
        "version": ", ".join(sorted({test.run.ploughval for test in found.tests if test.run.ploughval})),
    }


def _agreement(found: SeveralFindings) -> tuple[int, int]:
    """Metrics that agree, of those that can be judged, over all tests."""
    ones = [counts(test.metrics.metrics) for test in found.tests if test.metrics is not None]
    agree = sum(one[0] for one in ones)
    return agree, agree + sum(one[1] for one in ones)


def _scatter(found: SeveralFindings) -> tuple[int, int]:
    """Metrics whose scatter is as stated, of those that can be judged, over all groups."""
    counted = [found.scatter(group) for group in found.repeats]
    return sum(one["explained"] for one in counted), sum(one["judged"] for one in counted)


def _verdict(found: SeveralFindings) -> str:
    agree, judged = _agreement(found)
    said = ["No metric of these tests can be judged."]
    if judged:
        said = [f"{agree} of {judged} metrics agree within twice the validation uncertainty."]
    explained, known = _scatter(found)
    if known:
        said.append(f"Between repeats {explained} of {known} metrics scatter as their uncertainties state.")
    told = [trend.verdict for trend in found.trends if trend.verdict != "unknown"]
    if told:
        said.append(f"In units of depth {told.count('none')} of {len(told)} metrics show no effect of depth.")
    return " ".join(said)


def _tiles(found: SeveralFindings) -> list[Tile]:
    grouping = found.grouping
    repeating = sum(len(group.members) > 1 for group in grouping.groups)
    tiles = [
        Tile("tests", str(len(found.tests))),
        Tile("groups of equal tests", str(len(grouping.groups)), f"{repeating} with repeats"),
    ]
    agree, judged = _agreement(found)
    if judged:
        tiles.append(Tile("metrics agree", f"{agree} / {judged}", "over all tests"))
    explained, known = _scatter(found)
    if known:
        tiles.append(Tile("scatter as stated", f"{explained} / {known}", "metrics of repeats"))
    worst = _worst(found)
    if worst is not None:
        tiles.append(worst)
    return tiles


def _worst(found: SeveralFindings) -> Tile | None:
    """The test on which the model agrees least; None where it agrees wherever it can be judged."""
    judged = [(test.name, counts(test.metrics.metrics)) for test in found.tests if test.metrics is not None]
    some = [(agree / (agree + differ), name, agree, differ) for name, (agree, differ, _) in judged if differ]
    if not some:
        return None
    _, name, agree, differ = min(some)
    return Tile("agree where fewest do", f"{agree} / {agree + differ}", f"test {name}")
