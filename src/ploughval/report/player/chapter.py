"""The chapter with the player: what it is given to show, and what it says it leaves out."""

import base64
import math
from collections.abc import Sequence
from importlib import resources
from typing import Any

import pandas as pd
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from ploughval.report.blocks import Chapter
from ploughval.report.figures.layers import Extent
from ploughval.report.photographs import Photographs
from ploughval.report.player.dots import Dots, frame_dots
from ploughval.report.player.frames import Moment, moments, spread
from ploughval.report.player.history import Curve, curve, envelope_of, values_at
from ploughval.report.player.lines import FrameLines, Lines, frame_lines
from ploughval.report.player.pictures import MOST_PICTURES, Pictures, frame_pictures
from ploughval.report.player.still import Panels, Scene, still
from ploughval.report.results import Results
from ploughval.report.scripts import json_block
from ploughval.report.stages import view

MOST_FRAMES = 300
_PEAK_KINDS = ("peak", "trough")
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
    data = _data(results, shown, lines, pictures, dots, names)
    unread = {} if photographs is None else photographs.unread
    for entry in data["frames"]:
        if entry["n"] in unread and not entry["why"]:
            entry["unread"] = unread[entry["n"]]
    data["still"] = row
    data["frames"][row].pop("p", None)  # it stands in the drawing
    panels = Panels.of(extent, names)
    scene = _scene(shown[row], results.thickness_mm, pictures)
    markup = _render(
        panels=panels,
        still=still(panels, lines, row, scene),
        frame=shown[row].frame,
        words=_words(shown[row], names, scene),
        last=len(shown) - 1,
        row=row,
        layers=_offered(names, lines, pictures, dots),
        dots=dots,
        force=results.force is not None or results.model_force is not None,
        block=json_block("player-data", data),
    )
    notes = _notes(every, shown, pictures, photographs, dots)
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


def _data(
    results: Results,
    shown: Sequence[Moment],
    lines: Lines,
    pictures: Pictures | None,
    dots: Dots | None,
    names: tuple[str, ...],
) -> dict[str, Any]:
    """What the script reads; templates/player_data.js names each entry."""
    values = values_at(results, shown)
    frames = []
    for k, moment in enumerate(shown):
        v, line = values[k], lines.frames[k]
        entry = {
            "n": moment.frame, "u": _known(moment.u_mm, 4), "x": _known(moment.blade_mm, 3),
            "why": moment.reason, "P": _known(v.force_N, 4), "s": _known(v.force_std_N, 4),
            "Q": _known(v.model_N, 4), "b": _known(v.beta_deg, 2), "bs": _known(v.beta_std_deg, 2),
            "c": _known(v.model_beta_deg, 2), "i": _known(v.band, 0), "j": _known(v.model_band, 0),
        }  # fmt: skip
        if moment.note:
            entry["note"] = moment.note
        frames.append(entry | _packed(line) | _dots_of(dots, k) | _picture_of(pictures, moment))
    tags = [[source, height] for source, height in lines.layers]
    return {
        "view": [round(side, 4) for side in view(results)], "panels": list(names),
        "depth": results.depth_mm, "thickness": results.thickness_mm, "P0": results.P0_N,
        "tolerance": lines.tolerance_mm, "tags": tags, "frames": frames,
        "pictures": None if pictures is None else {
            "kind": pictures.kind, "extent": [round(side, 4) for side in pictures.extent],
        },
        "dots": None if dots is None else {
            "start": list(dots.start), "quantum": dots.quantum_mm, "motion": dots.motion_top,
            "shear": dots.shear_top, "gauge": round(dots.gauge_mm, 2),
        },
        "force": _force(results),
    }  # fmt: skip


def _packed(line: FrameLines) -> dict[str, Any]:
    texts = {"L": line.layers, "M": line.model_layers, "S": line.surface, "T": line.model_surface}
    ends = {"B": line.band_mm, "C": line.model_band_mm}
    known: dict[str, Any] = {key: text for key, text in texts.items() if text}
    return known | {key: end.round(3).tolist() for key, end in ends.items() if len(end)}


def _dots_of(dots: Dots | None, k: int) -> dict[str, str]:
    if dots is None or not dots.frames[k].places:
        return {}
    one = dots.frames[k]
    return {"d": one.places, "m": one.motion, "g": one.shear}


def _picture_of(pictures: Pictures | None, moment: Moment) -> dict[str, str]:
    if pictures is None or moment.frame not in pictures.data:
        return {}
    return {"p": base64.b64encode(pictures.data[moment.frame]).decode("ascii")}


def _force(results: Results) -> dict[str, Any] | None:
    """Curves and marks of the chart, None without a force."""
    measured, model, envelope = results.force, results.model_force, envelope_of(results)
    if measured is None and model is None:
        return None
    return {
        "measured": None if measured is None else _curve(curve(measured, ("force_N", "force_std_N"))),
        "model": None if model is None else _curve(curve(model, ("force_N",))),
        "envelope": None if envelope is None else _curve(curve(envelope, ("low_N", "high_N"))),
        "peaks": _peaks(results.peaks),
        "starts": _starts(results.bands),
        "modelStarts": _starts(results.model_bands),
    }


def _curve(made: Curve) -> dict[str, Any]:
    return {
        "steps": made.steps,
        "columns": made.columns,
        "rows": made.rows,
        "kept": made.kept,
        "t": made.text,
    }


def _peaks(peaks: pd.DataFrame | None) -> list[list[Any]]:
    """Source and kind as numbers, u in mm, force in N."""
    if peaks is None:
        return []
    found: list[list[Any]] = []
    for source, kind, u, force in peaks[["source", "kind", "u_mm", "force_N"]].itertuples(index=False):
        if kind in _PEAK_KINDS and math.isfinite(u) and math.isfinite(force):
            found.append([int(source == "model"), _PEAK_KINDS.index(kind), round(u, 3), round(force, 4)])
    return found


def _starts(bands: pd.DataFrame | None) -> list[list[float]]:
    if bands is None:
        return []
    starts = bands[["band", "u_start_mm"]].dropna().to_numpy(dtype=float)
    return [[band, round(u, 3)] for band, u in starts.tolist()]


def _known(value: float, digits: int) -> float | None:
    return round(float(value), digits) if math.isfinite(value) else None


def _notes(
    every: Sequence[Moment],
    shown: Sequence[Moment],
    pictures: Pictures | None,
    photographs: Photographs | None,
    dots: Dots | None,
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


def _render(**context: Any) -> Markup:
    """The player's own template with everything escaped that is not a drawing or data."""
    folder = resources.files("ploughval.report").joinpath("templates")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    text = folder.joinpath("player.html.j2").read_text(encoding="utf-8")
    return Markup(environment.from_string(text).render(**context))
