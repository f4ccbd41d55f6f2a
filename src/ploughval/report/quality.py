"""How the numbers came about: blade, frames, settings, provenance."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from pydantic import BaseModel

from ploughval.axes import Status
from ploughval.report.blocks import Cell, Chapter, Drawing, Pen, Table
from ploughval.report.figures import blade_figure, noise_figure, volume_figure
from ploughval.report.text import MISSING, number
from ploughval.results import FrameEntry, NoiseEntry, Results
from ploughval.scene import Scene
from ploughval.scene_faults import table_of

SAME_MM = 1e-9
MISFIT = 3.0  # distances of the noise from a straight line, in their standard uncertainties


def quality_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Faults, blade and the frame ledger."""
    run = results.run
    drawings, tables = [], []
    if results.blade is not None and _tells(results.blade):
        drawings.append(
            pen.draw(
                blade_figure(results.blade),
                "Blade position seen in the photographs minus the displacement used, against displacement.",
                "Blade seen in the photographs against the displacement used: a slope would be a wrong "
                "scale, an offset a wrong clock. Bars: ± std.",
                name="blade-position",
                data=("blade.csv",),
            )
        )
    if results.volume is not None and results.volume["ratio"].notna().any():
        middle = float(results.volume["ratio"].median())
        drawings.append(
            pen.draw(
                volume_figure(results.volume),
                f"Area of the heap over the area swept by the blade; the median is {number(middle, 3)}.",
                "Area of the heap ahead of the blade over the area that the blade has swept, with twice its "
                "standard deviation: a check of scale, tip and surface. Above 1: sand has loosened.",
                name="heap-area",
                data=("volume.csv",),
            )
        )
    if run.noise is not None and run.noise.grey:
        drawings.append(_noise(run.noise, pen))
    lost = [entry for entry in run.frames if not entry.used]
    if lost:
        tables.append(_ledger("Photographs that were lost", lost, results, folded=False))
    if run.frames:
        tables.append(_ledger("All photographs", run.frames, results, folded=True))
    notes = [text for text in run.warnings if text not in run.faults]
    if not (drawings or tables or notes or run.faults):
        return None
    return Chapter("quality", "Quality", drawings=drawings, tables=tables, notes=notes, faults=run.faults)


def _tells(blade: pd.DataFrame) -> bool:
    """Whether the blade seen says something of the displacement used: not where the one is the other."""
    apart = (blade["blade_x_mm"] - blade["u_mm"]).abs()
    return bool(apart.max() > SAME_MM)


def _noise(entry: NoiseEntry, pen: Pen) -> Drawing:
    """Noise against grey level, in words as well."""
    level, grey = number(entry.std_at_mean_grey, 3), number(entry.mean_grey, 3)
    said = f"{level} grey levels at the sand's mean grey of {grey}"
    bent = ""
    if entry.misfit is not None and entry.misfit > MISFIT:
        bent = " It does not follow the line: the picture was compressed, or its grey is not linear in light."
    return pen.draw(
        noise_figure(entry.grey, entry.std, entry.std_std, gain=entry.gain, floor=entry.floor),
        f"Noise of the camera against grey level: {said}.",
        f"Noise of one photograph from the difference of the first two, in sand that stays: {said}. Dashed: "
        f"variance in proportion to light, and a floor.{bent} Standard deviations of displacements follow "
        "the residuals of their own subset, and with them the noise at its grey. Bars: ± 2 std.",
        name="camera-noise",
        data=("run.json",),
    )


def _ledger(caption: str, frames: Sequence[FrameEntry], results: Results, *, folded: bool) -> Table:
    """Photographs with times and displacements to fixed decimals; columns that say nothing are left out."""
    followed, uncertain = _followed(results), any(f.time_std_s for f in frames)
    said = any(f.reason or f.notes for f in frames)
    head = ["Frame", "File", "Time ± std, s" if uncertain else "Time, s", "u, mm"]
    head += ["Points followed, %"] if followed else []
    head += ["Status", *(["Reason and notes"] if said else [])]
    rows = []
    for f in frames:
        row = [Cell(str(f.frame), f.frame), Cell(f.file), _time(f, uncertain), _fixed(f.u_mm, 3)]
        row += [_fixed(followed.get(f.frame), 1)] if followed else []
        row.append(Cell(f.status.replace("_", " "), mark="" if f.used else "differs"))
        row += [Cell("; ".join([*([f.reason] if f.reason else []), *f.notes]))] if said else []
        rows.append(row)
    return Table(caption, head, rows, folded=folded)


def _time(entry: FrameEntry, uncertain: bool) -> Cell:
    text = _fixed(entry.time_s, 3).text
    if uncertain and entry.time_s is not None and entry.time_std_s:
        text += f" ± {entry.time_std_s:.3f}"
    return Cell(text, entry.time_s, std=entry.time_std_s)


def _fixed(value: float | None, places: int) -> Cell:
    """A number to so many decimals, so that a column lines up; a dash where there is none."""
    if value is None:
        return Cell(MISSING)
    return Cell(f"{value:z.{places}f}".replace("-", "−"), value)


def _followed(results: Results) -> dict[int, float]:
    """Share of the tracked points that was found in each frame, %; empty without tracks."""
    if results.tracks is None or results.tracks.sizes["point"] == 0:
        return {}
    good = np.isin(results.tracks["status"].to_numpy(), (Status.OK, Status.REPLACED)).mean(axis=1)
    numbers = results.tracks["frame"].to_numpy()
    return {int(n): 100.0 * float(share) for n, share in zip(numbers, good, strict=True)}


def provenance_chapter(results: Results) -> Chapter | None:
    """Settings, versions, hashes: folded, for those who repeat the run."""
    run = results.run
    tables = []
    if run.settings:
        tables.append(_settings(run.settings))
    for caption, pairs, head in (
        ("Versions", run.versions, ("Package", "Version")),
        ("Inputs", run.inputs, ("File", "SHA-256")),
    ):
        if pairs:
            rows = [[Cell(key), Cell(value)] for key, value in pairs.items()]
            tables.append(Table(caption, head, rows, folded=True))
    if not tables:
        return None
    lead = f"ploughval {run.ploughval}" if run.ploughval else ""
    if run.settings_hash:
        lead += f", settings {run.settings_hash[:12]}"
    return Chapter("provenance", "Settings and provenance", lead=lead.strip(", "), tables=tables)


def _settings(settings: dict[str, Any]) -> Table:
    """Every setting, whether it is as by default, and what it means; what was not given is named below."""
    known = [(key, value) for key, value in flatten(settings) if value not in (None, "", [], ())]
    open_keys = [key for key, value in flatten(settings) if value in (None, "", [], ())]
    rows = []
    for key, value in known:
        meaning, default = _meaning(key)
        cell = _setting(value)
        rows.append([Cell(key), cell, Cell("yes" if value == default else "no"), Cell(meaning)])
    notes = (f"Not given: {', '.join(open_keys)}.",) if open_keys else ()
    head = ("Key", "Value", "Default", "Meaning and unit")
    return Table("Settings", head, rows, folded=True, kind="cards", footnotes=notes)


def _meaning(key: str) -> tuple[str, Any]:
    """What a key of test.toml means, with its unit, and its default; empty and None for one unknown here."""
    model: type[BaseModel] | None = Scene
    field = None
    for name in key.split("."):
        if model is None or name not in model.model_fields:
            return "", None
        field = model.model_fields[name]
        model = table_of(field.annotation)
    if field is None:
        return "", None
    default = None if field.is_required() else field.get_default(call_default_factory=True)
    return field.description or "", list(default) if isinstance(default, tuple) else default


def flatten(settings: dict[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    """Nested settings as dotted keys in their order.

    >>> flatten({"blade": {"depth_mm": 30.0}, "box": {}})
    [('blade.depth_mm', 30.0)]
    """
    flat: list[tuple[str, Any]] = []
    for key, value in settings.items():
        if isinstance(value, dict):
            flat += flatten(value, f"{prefix}{key}.")
        else:
            flat.append((f"{prefix}{key}", value))
    return flat


def _setting(value: Any) -> Cell:
    if isinstance(value, list | tuple):
        return Cell(", ".join(_item(item) for item in value))
    if isinstance(value, bool | str):
        return Cell(str(value).lower() if isinstance(value, bool) else value)
    return Cell(f"{value:g}", value) if isinstance(value, int | float) else Cell(str(value))


def _item(item: Any) -> str:
    """A value in a list; a list in it, as a point, in brackets."""
    if isinstance(item, list | tuple):
        return f"({', '.join(_item(part) for part in item)})"
    return _setting(item).text
