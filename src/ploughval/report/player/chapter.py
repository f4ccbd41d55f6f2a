"""The chapter with the player: what it is given to show, and what it says it leaves out."""

import base64
import math
from collections.abc import Sequence
from typing import Any

from ploughval.report.blocks import Chapter
from ploughval.report.figures.layers import Extent
from ploughval.report.photographs import Photographs
from ploughval.report.player.data import player_data
from ploughval.report.player.dots import Dots, frame_dots
from ploughval.report.player.frames import Moment, moments, spread
from ploughval.report.player.lines import Lines, frame_lines
from ploughval.report.player.pictures import MOST_PICTURES, Pictures, frame_pictures
from ploughval.report.player.still import Panels, Scene, still
from ploughval.report.rendering import rendered
from ploughval.report.scripts import json_block
from ploughval.report.stages import view
from ploughval.results import Results

MOST_FRAMES = (
    300  # of the slider: a screen tells no more apart, and their lines keep within a megabyte or two
)
_LAYERS = {
    "photograph": "Photograph",
    "tracks": "Tracked points",
    "layers-measured": "Layers, measured",
    "layers-predicted": "Layers, predicted",
    "bands": "Bands",
    "surface": "Free surface",
    "blade": "Blade",
}


def player_chapter(results: Results, photographs: Photographs | None) -> Chapter | None:
    """The player of one test; None where there is neither a photograph nor a line nor a tracked point.

    Parameters
    ----------
    results : Results
        The files of a run.
    photographs : Photographs or None
        Where the photographs are read; None where the test has none.
    """
    every = moments(results)
    if not every:
        return None
    shown = [every[place] for place in spread([m.u_mm for m in every], MOST_FRAMES)]
    extent = view(results)
    lines = frame_lines(results, shown, extent)
    pictures = _pictures(photographs, shown, extent)
    dots = frame_dots(results, shown, extent)
    names = _panels(lines, pictures, dots)
    if not names:
        return None
    row = _last(shown, lines, pictures)
    data = player_data(results, shown, lines, pictures, dots, names)
    unread = {} if photographs is None else photographs.unread
    for entry in data["frames"]:
        if entry["n"] in unread and not entry["why"]:
            entry["unread"] = unread[entry["n"]]
    data["still"] = row
    data["frames"][row].pop("p", None)  # it stands in the drawing
    panels = Panels.of(extent, names)
    scene = _scene(shown[row], results.thickness_mm, pictures)
    markup = rendered(
        "player.html.j2",
        panels=panels,
        still=still(panels, lines, row, scene),
        frame=shown[row].frame,
        words=_words(shown[row], names, scene),
        last=len(shown) - 1,
        row=row,
        layers=_offered(names, lines, pictures, dots),
        dots=dots,
        measured=results.force is not None,
        predicted=results.model_force is not None,
        marks=_marks(data["force"]),
        block=json_block("player-data", data),
    )
    notes = _notes(every, shown, pictures, photographs)
    return Chapter("player", "The test, frame by frame", notes=notes, player=markup)


def _pictures(photographs: Photographs | None, shown: Sequence[Moment], extent: Extent) -> Pictures | None:
    if photographs is None or photographs.missing:
        return None
    held = [moment for moment in shown if moment.file]
    chosen = [held[place].frame for place in spread([m.u_mm for m in held], MOST_PICTURES)]
    return frame_pictures(photographs, chosen, extent)


def _panels(lines: Lines, pictures: Pictures | None, dots: Dots | None) -> tuple[str, ...]:
    """Which panels have something to show, from the top."""
    predicted = any(frame.model_layers or frame.model_surface for frame in lines.frames)
    measured = any(frame.layers or frame.surface for frame in lines.frames) or pictures is not None
    measured = measured or dots is not None
    return ("predicted",) * predicted + ("measured",) * measured


def _last(shown: Sequence[Moment], lines: Lines, pictures: Pictures | None) -> int:
    """The last frame that has a photograph, or without any the last with a line."""
    with_picture = [k for k, m in enumerate(shown) if pictures is not None and m.frame in pictures.data]
    with_line = [k for k, f in enumerate(lines.frames) if f.layers or f.model_layers or f.surface]
    return (with_picture or with_line or [len(shown) - 1])[-1]


def _scene(moment: Moment, thickness_mm: float, pictures: Pictures | None) -> Scene:
    if pictures is None or moment.frame not in pictures.data:
        return Scene(moment.u_mm, moment.blade_mm, thickness_mm)
    text = base64.b64encode(pictures.data[moment.frame]).decode("ascii")
    image = f"data:{pictures.kind};base64,{text}"
    return Scene(moment.u_mm, moment.blade_mm, thickness_mm, image, pictures.extent)


def _words(moment: Moment, names: tuple[str, ...], scene: Scene) -> str:
    """The alternative text of the drawing without scripts."""
    where = f"u = {moment.u_mm:.1f} mm" if math.isfinite(moment.u_mm) else "the travel is not known"
    ground = " over the photograph" if scene.image else ""
    panels = " above ".join(f"{name}{ground if name == 'measured' else ''}" for name in names)
    return f"Frame {moment.frame}, {where}: layers, free surface, shear band and blade, {panels}."


def _offered(
    names: tuple[str, ...], lines: Lines, pictures: Pictures | None, dots: Dots | None
) -> dict[str, str]:
    """The overlays that can be switched: those that some frame has."""
    there = {
        "photograph": pictures is not None,
        "tracks": dots is not None and "measured" in names,
        "layers-measured": any(frame.layers for frame in lines.frames),
        "layers-predicted": any(frame.model_layers for frame in lines.frames),
        "bands": any(len(f.band_mm) or len(f.model_band_mm) for f in lines.frames),
        "surface": any(f.surface or f.model_surface for f in lines.frames),
        "blade": True,
    }
    return {key: words for key, words in _LAYERS.items() if there[key]}


def _marks(force: dict[str, Any] | None) -> str:
    """What the signs on the chart are."""
    if force is None:
        return ""
    there = (
        ("○ peak", bool(force["peaks"])),
        ("△ start of a band", bool(force["starts"] or force["modelStarts"])),
        ("shaded: 95 % of drawn inputs", force["envelope"] is not None),
    )
    return ", ".join(words for words, drawn in there if drawn)


def _notes(
    every: Sequence[Moment],
    shown: Sequence[Moment],
    pictures: Pictures | None,
    photographs: Photographs | None,
) -> list[str]:
    """What the player does not show."""
    notes = []
    if len(shown) < len(every):
        notes.append(
            f"{len(shown)} of {len(every)} frames are in the player, at even steps of travel; layers.csv, "
            "surface.csv and tracks.nc hold all."
        )
    if photographs is not None and photographs.missing:
        notes.append(photographs.missing)
    held = sum(1 for moment in every if moment.file and not moment.reason)
    if pictures is not None and len(pictures.data) < held and len(shown) > MOST_PICTURES:
        notes.append(
            f"The page holds {len(pictures.data)} of {held} photographs, at even steps of travel. Playing "
            "goes through these; the slider stops at the frames between as well, without a photograph."
        )
    return notes
